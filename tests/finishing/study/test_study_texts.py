"""What a study says and draws."""

import numpy as np
import pytest

from sdpgrind import finishing as fin

WANG = fin.Study.published("wang-2001")


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")


def test_the_report_says_what_the_data_cannot_tell():
    text = WANG.report()
    for said in (
        "18 runs in the L18(2^1 3^7), 1 reading each",
        "0 dB is 10 µm",
        "tool_diameter [mm]   pattern  feed_rate [mm/s]  normal_force [N]",
        "it carries no information on noise",
        "none hides one whole",
        "before pooling",
        "after pooling: rule F < 1: feed_rate counted as error, 2 of its 12 degrees of freedom",
        "Significant at 5 %: tool_diameter, pattern, normal_force. Not seen: feed_rate.",
        "feed_rate: 12.5 (arbitrary: no effect is told from the scatter)",
        "normal_force: 1.111 (tie: 1.667, 0.155 dB lower, p = 0.67)",
        "mean 8.951 dB (3.568 µm)",
        "feed_rate 25, normal_force 1.111 with 9.119 dB",
        "wrongly: the simulated truth has no such effect",
        "normal_force at the top of the surface",
    ):
        assert said in text, said
    assert "nan" not in text and "inf " not in text
    assert WANG.report() == text, "the same source of randomness, the same text"


def test_reports_of_other_studies():
    lacking = WANG.readings[:, 0].copy()
    lacking[4] = np.nan
    text = fin.Study("L18", WANG.factors, lacking, reference=0.01, unit="mm").report()
    assert "missing: 5" in text and "type II" in text and "missing" in text.splitlines()[7]
    runs = fin.Study.of_runs({"wool": ["A", "A", "B", "B"]}, [1.0, 2.0, 4.0, 5.5], ratio="none").report()
    assert "4 runs of any kind" in runs and "Best levels" not in runs
    hidden = fin.Study(
        "L8", {"a": (0, 1), "b": (0, 1), "c": (0, 1)}, np.arange(1.0, 9.0), columns=(1, 2, 3)
    ).report()
    assert "c or a x b" in hidden
    clear = fin.Study("L8", {"a": (0, 1), "b": (0, 1), "c": (0, 1)}, np.arange(1.0, 9.0)).report()
    assert "No interaction of two factors falls on a main effect." in clear
    twice = fin.Study(
        "L4", {"a": (0, 1)}, [[1.0, 1.2], [2.0, 2.2], [3.0, 3.2], [4.0, 4.2]], ratio="larger"
    ).report()
    assert "2 readings each" in twice and "no information on noise" not in twice
    together = fin.Study(
        "L8", {"a": (0, 1), "b": (0, 1)}, np.arange(1.0, 9.0), columns=(1, 2), interactions=[("a", "b")]
    )
    assert "a x b" in together.report()


def test_tables_line_up():
    lines = str(WANG.anova()).splitlines()
    assert lines[0].startswith("source") and lines[1].startswith("tool_diameter   1   22.86223")
    ends = {line.index(" %") for line in lines[1:6]}
    assert len(ends) == 1
    assert lines[3].endswith("F < 1: pool")
    assert repr(WANG) == (
        "Study(roughness R_a: 18 runs, an L18(2^1 3^7); factors tool_diameter, pattern, feed_rate, normal_force)"
    )


def test_confounding_of_the_published_columns():
    found = WANG.confounding
    assert not found.whole and not found.clear
    lines = [line.split("  ") for line in str(found).splitlines()]
    cells = [[cell.strip() for cell in line if cell.strip()] for line in lines]
    assert ["tool_diameter x feed_rate", "normal_force", "33.3 %"] in cells
    assert fin.Study.of_runs({"a": [0, 1, 1]}, [1.0, 2.0, 3.0]).confounding is None


def test_picture(pyplot):
    figure = WANG.plot()
    panels = figure.axes[:4]
    means = WANG.level_means()
    for axis, factor in zip(panels, means, strict=True):
        levels = list(means[factor])
        levels = sorted(levels) if isinstance(levels[0], float) else levels
        np.testing.assert_allclose(axis.lines[0].get_ydata(), [means[factor][level] for level in levels])
        assert [label.get_text() for label in axis.get_xticklabels()] == [
            f"{x:g}" if isinstance(x, float) else x for x in levels
        ]
    assert panels[0].get_ylabel() == "mean ratio [dB]"
    assert [axis.get_title() for axis in panels] == [
        "tool diameter [mm]",
        "pattern",
        "feed rate [mm/s]",
        "normal force [N]",
    ]
    right = figure.axes[4]
    assert right.get_ylabel() == "roughness R_a [µm]"
    tick, label = right.get_yticks()[0], right.get_yticklabels()[0].get_text()
    assert float(label) == pytest.approx(10 * 10 ** (-tick / 20), rel=5e-3)
    assert right.get_ylim() == panels[-1].get_ylim()


def test_pictures_without_intervals_or_a_way_back(pyplot):
    saturated = fin.Study("L4", dict.fromkeys("abc", (0, 1)), [1.0, 2.0, 3.0, 5.0]).plot()
    assert not saturated.axes[0].collections
    y = np.random.default_rng(0).normal(10.0, 0.2, (4, 3))
    nominal = fin.Study("L4", {"a": (0, 1), "b": ("x", "y")}, y, ratio="nominal").plot()
    assert len(nominal.axes) == 2
    plain = fin.Study.of_runs(
        {"a": [0, 1, 1, 0]}, [1.0, 2.0, 3.0, 4.0], ratio="none", name="depth", unit="mm"
    ).plot()
    assert plain.axes[0].get_ylabel() == "depth [mm]"


def test_predictions_of_plain_readings():
    study = fin.Study.of_runs({"a": [0, 1, 1, 0]}, [1.0, 2.0, 3.0, 4.0], ratio="none", unit="V")
    found = study.predict({"a": 1})
    assert found.mean == 2.5 and found.response == 2.5
    assert "mean 2.500 V, as good as the mean of 2 runs" in repr(found) and "dB" not in repr(found)
    assert found.response_mean == pytest.approx((2.5 - found.ci_mean, 2.5 + found.ci_mean))


def test_a_changed_copy():
    larger = WANG.replace(ratio="larger")
    np.testing.assert_allclose(larger.sn_ratio, -WANG.sn_ratio, rtol=1e-12)
    free = fin.Study.of_runs({"a": [0, 1, 1, 0]}, [1.0, 2.0, 3.0, 4.0]).replace(ratio="none")
    assert free.anova().total.ss == pytest.approx(5.0)
