"""Wang and Jan (2001), Tables 2 and 3, from the published readings: every number of the analysis."""

import numpy as np
import pytest
from scipy import stats

from sdpgrind import finishing as fin
from sdpgrind import units

STUDY = fin.Study.published("wang-2001")
PRINTED_RATIO = [
    6.021, 9.119, 8.519, 1.671, 4.437, 4.437, 7.432, 5.597, 3.414,
    6.936, 4.082, 6.021, 2.499, 3.414, -0.424, 3.414, 0.677, 3.742,
]  # fmt: skip
FACTORS = ("tool_diameter", "pattern", "feed_rate", "normal_force")


def test_the_table_is_the_printed_one():
    codes = [[STUDY.levels(name).index(level) for level in levels] for name, levels in STUDY.settings.items()]
    np.testing.assert_array_equal(np.transpose(codes), fin.study.orthogonal_array("L18").matrix[:, :4])
    assert STUDY.columns == (1, 2, 3, 4)
    settings = STUDY.settings
    assert settings["tool_diameter"].tolist() == [4.0] * 9 + [3.0] * 9
    assert settings["pattern"].tolist() == (["hilbert5"] * 3 + ["hilbert4"] * 3 + ["zigzag"] * 3) * 2
    assert settings["feed_rate"].tolist() == [12.5, 25.0, 37.5] * 6
    assert settings["normal_force"][9:15].tolist() == [1.667, 0.556, 1.111, 1.111, 1.667, 0.556]
    assert np.all(np.abs(STUDY.readings / units.um(0.25) % 1) < 1e-9), "all are multiples of 0.25 um"


def test_ratios():
    np.testing.assert_allclose(STUDY.sn_ratio, PRINTED_RATIO, atol=5e-4)
    np.testing.assert_allclose(STUDY.sn_ratio, -20 * np.log10(STUDY.readings[:, 0] / 0.010), rtol=1e-13)


def test_sums_of_squares():
    table = STUDY.anova()
    ss = [table[name].ss for name in (*FACTORS, "error", "total")]
    np.testing.assert_allclose(ss, [22.86223, 52.54950, 0.45308, 33.48709, 3.65585, 113.00775], atol=1e-5)
    np.testing.assert_allclose(ss, [22.862, 52.549, 0.453, 33.487, 3.656, 113.008], atol=6e-4)  # as printed
    assert [row.df for row in table.rows] == [1, 2, 2, 2, 10, 17]


def test_sums_of_squares_by_level_means():
    y, table = STUDY.sn_ratio, STUDY.anova()
    for name in FACTORS:
        column = STUDY.settings[name]
        means = [(y[column == level].mean(), np.sum(column == level)) for level in STUDY.levels(name)]
        assert table[name].ss == pytest.approx(sum(n * (m - y.mean()) ** 2 for m, n in means), rel=1e-12)


def test_rounded_ratios_give_other_sums():
    rounded = fin.Study("L18", STUDY.factors, PRINTED_RATIO, ratio="none").anova()
    assert rounded["pattern"].ss == pytest.approx(52.551, abs=6e-4)
    assert rounded["normal_force"].ss == pytest.approx(33.491, abs=6e-4)


def test_plain_and_pure_contributions():
    table = STUDY.anova()
    plain = [100 * row.contribution for row in table.rows[:-1]]
    np.testing.assert_allclose(plain, [20.2, 46.5, 0.4, 29.6, 3.235], atol=0.05)
    pure = [100 * row.pure_contribution for row in table.rows[:-1]]
    np.testing.assert_allclose(pure, [19.907, 45.854, -0.246, 28.986, 5.500], atol=1e-3)
    assert sum(pure) == pytest.approx(100, abs=1e-9)
    np.testing.assert_allclose(
        [table[name].pure_ss for name in FACTORS], [22.497, 51.818, -0.278, 32.756], atol=6e-4
    )
    assert [row.note for row in table.effects] == ["", "", "F < 1: pool", ""]


def test_f_and_p():
    table = STUDY.anova()
    np.testing.assert_allclose(
        [table[name].F for name in FACTORS], [62.536, 71.870, 0.620, 45.799], atol=1e-3
    )
    p = [stats.f.sf(table[name].F, table[name].df, 10) for name in FACTORS]
    np.testing.assert_allclose([table[name].p for name in FACTORS], p, rtol=1e-10)
    assert table["feed_rate"].p == pytest.approx(0.56, abs=5e-3)
    assert table.significant() == ("tool_diameter", "pattern", "normal_force")
    assert table.ranking == ("pattern", "normal_force", "tool_diameter", "feed_rate")


def test_the_reference_changes_no_sum_of_squares():
    other = fin.Study("L18", STUDY.factors, STUDY.readings, reference=1.0, unit="mm")
    assert other.sn_ratio[0] != pytest.approx(STUDY.sn_ratio[0])
    for row, same in zip(STUDY.anova().rows, other.anova().rows, strict=True):
        assert row.ss == pytest.approx(same.ss, abs=1e-10)


def test_prediction_with_the_feed_pooled():
    found = STUDY.predict({"tool_diameter": 4, "pattern": "hilbert5", "normal_force": 1.111}, confirm=1)
    assert found.mean == pytest.approx(8.951, abs=1e-3)
    assert 1e3 * found.response == pytest.approx(3.568, abs=1e-3)
    assert 1 / found.n_eff == pytest.approx(1 / 3, rel=1e-12)
    assert found.ci_mean == pytest.approx(0.736, abs=1e-3)
    assert found.ci_confirm == pytest.approx(1.472, abs=1e-3)
    assert found.error_df == 12


def test_predictions_of_all_four_factors():
    means = {}
    for force in (1.667, 1.111):
        levels = {"tool_diameter": 4.0, "pattern": "hilbert5", "feed_rate": 12.5, "normal_force": force}
        found = STUDY.predict(levels)
        means[force] = found.mean
        assert found.ci_mean == pytest.approx(0.898, abs=1e-3)
        assert found.n_eff == pytest.approx(18 / 8, rel=1e-12)
    assert means[1.667] == pytest.approx(8.957, abs=1e-3)
    assert means[1.111] == pytest.approx(9.113, abs=1e-3)


def test_intervals_by_the_formulas():
    levels = {"tool_diameter": 3.0, "pattern": "zigzag", "normal_force": 0.556}
    found = STUDY.predict(levels, confirm=4, confidence=0.9)
    y = STUDY.sn_ratio
    mean = y.mean() + sum(
        y[STUDY.settings[name] == level].mean() - y.mean() for name, level in levels.items()
    )
    variance = STUDY.anova(pool=["feed_rate"]).error.ms
    F = stats.f.isf(0.1, 1, 12)
    assert found.mean == pytest.approx(mean, rel=1e-12)
    assert found.ci_mean == pytest.approx(np.sqrt(F * variance * 6 / 18), rel=1e-10)
    assert found.ci_confirm == pytest.approx(np.sqrt(F * variance * (6 / 18 + 1 / 4)), rel=1e-10)
    low, high = found.response_confirm
    assert low == pytest.approx(0.010 * 10 ** (-(mean + found.ci_confirm) / 20), rel=1e-10)
    assert low < found.response_mean[0] < found.response < found.response_mean[1] < high


def test_best_levels_and_ties():
    best = STUDY.best()
    assert dict(best) == {
        "tool_diameter": 4.0,
        "pattern": "hilbert5",
        "feed_rate": 12.5,
        "normal_force": 1.111,
    }
    assert best.arbitrary == ("feed_rate",)
    (tie,) = best.ties
    assert (tie.factor, tie.level) == ("normal_force", 1.667)
    assert tie.behind == pytest.approx(0.155, abs=1e-3)
    assert tie.p == pytest.approx(0.67, abs=5e-3)
    width = np.sqrt(STUDY.anova().error.ms * 2 / 6)
    assert tie.p == pytest.approx(2 * stats.t.sf(tie.behind / width, 10), rel=1e-9)
    assert "feed_rate" not in STUDY.best(pool="F<1")
    assert STUDY.predict(STUDY.best(), confirm=1).mean == pytest.approx(9.113, abs=1e-3)


def test_level_means():
    means = STUDY.level_means()
    assert means["normal_force"][1.111] == pytest.approx(5.541, abs=1e-3)
    assert means["normal_force"][1.667] == pytest.approx(5.386, abs=1e-3)
    assert list(means) == list(FACTORS) and len(means) == 4
    row = next(row for row in means.rows if row.level == "zigzag")
    assert row.half_width == pytest.approx(
        stats.t.isf(0.025, 10) * np.sqrt(STUDY.anova().error.ms / 6), rel=1e-10
    )
    assert row.response == pytest.approx(0.010 * 10 ** (-row.mean / 20), rel=1e-12)


def test_pooling_keeps_a_record_and_both_tables():
    table = STUDY.anova(pool="F<1")
    assert (table.pooling.rule, table.pooling.names, table.pooling.df, table.pooling.error_df) == (
        "F < 1",
        ("feed_rate",),
        2,
        12,
    )
    assert table.error.ss == pytest.approx(3.65585 + 0.45308, abs=2e-5)
    assert abs(table.unpooled["feed_rate"].F - 0.620) < 1e-3
    assert table.unpooled.pooling is None and table.pooling.only_after == ()
    assert table.significant() == ("tool_diameter", "pattern", "normal_force")
    text = str(table)
    assert (
        text.index("before pooling")
        < text.index("feed_rate")
        < text.index("after pooling")
        < text.rindex("error")
    )
    named = STUDY.anova(pool=["feed_rate"])
    assert named.pooling.rule == "named" and named.error.ss == table.error.ss


def test_table_as_data():
    table = STUDY.anova()
    data = table.dataset
    assert float(data.ss.sel(source="error")) == table.error.ss and data.ss.attrs["units"] == "dB^2"
    assert np.isnan(float(data.F.sel(source="error")))
    assert table.error.F is None and int(data.df.sel(source="feed_rate")) == 2
    plain = fin.Study.of_runs(STUDY.settings, STUDY.readings, ratio="none", unit="mm").anova().dataset
    assert plain.ss.attrs["units"] == "mm^2" and plain.F.attrs["units"] == "1"
