"""Simulated repetitions against non-central F laws and a slow loop; further runs against a surface fitted by
hand.
"""

import numpy as np
import pytest
from finishing_inside import analysed
from scipy import optimize, stats

from sdpgrind import finishing as fin
from sdpgrind import sdp, units

STUDY = fin.Study.published("wang-2001")
MODEL = fin.roughness.RoughnessModel.published()
RANKING = ("pattern", "normal_force", "tool_diameter", "feed_rate")


def test_the_bars_of_2000_simulated_studies():
    found = STUDY.power(rng=0, runs=2000)
    assert found.ranking == RANKING
    assert found.ranking_returned >= 0.80
    assert abs(found.ranking_returned - 0.86) < 3.5 * found.standard_error(0.86)
    assert 0.03 <= found.significant["feed_rate"] <= 0.08
    assert found.without_effect == ("feed_rate",)
    text = repr(found)
    assert (
        "feed_rate is significant (p < 0.05) in" in text
        and "wrongly" in text
        and "1.667 beats 1.111 in" in text
    )


def test_shares_by_the_non_central_law():
    """What each effect's F exceeds, with the true sums of squares; the truth has less effect here, so that
    shares lie between.
    """
    small = {"tool_diameter": 0.15, "pattern": 0.3, "feed_rate": 0.2, "normal_force": 0.1}
    y = np.zeros(18)
    for name, size in small.items():
        y += (
            size
            * np.array([-1.0, 1.0, 0.3])[[STUDY.levels(name).index(level) for level in STUDY.settings[name]]]
        )

    def drawn(settings, rng, runs):
        return 10 ** (-(y + 0.5 * rng.standard_normal((runs, 18))) / 20)

    found = STUDY.power(rng=3, runs=20000, model=drawn)
    for name, basis in zip(STUDY.factors, analysed(STUDY).model.bases, strict=True):
        centrality, df = np.sum((basis.T @ y) ** 2) / 0.25, basis.shape[1]
        share = stats.ncf.sf(stats.f.isf(0.05, df, 10), df, 10, centrality)
        assert abs(found.significant[name] - share) < 4 * found.standard_error(share), name
        assert 0.05 < share < 0.95


def test_which_force_wins_by_the_normal_law():
    found = STUDY.power(rng=1, runs=20000)
    y, force = STUDY.sn_ratio, STUDY.settings["normal_force"]
    sd = np.sqrt(STUDY.anova(pool="F<1").error.ms * 2 / 6)
    share = stats.norm.cdf(-(y[force == 1.111].mean() - y[force == 1.667].mean()) / sd)
    assert abs(found.beats("normal_force", 1.667, 1.111) - share) < 4 * found.standard_error(share)
    assert found.beats("normal_force", 1.667, 1.111) + found.beats(
        "normal_force", 1.111, 1.667
    ) == pytest.approx(1)
    assert share == pytest.approx(0.34, abs=0.03)


def test_the_roughness_model_gives_the_same():
    found = STUDY.power(rng=2, runs=4000, model=MODEL)
    own = STUDY.power(rng=5, runs=4000)
    assert found.without_effect == ()
    for one, other in (
        (found.ranking_returned, own.ranking_returned),
        (found.significant["feed_rate"], own.significant["feed_rate"]),
    ):
        assert abs(one - other) < 4 * np.sqrt(2) * own.standard_error(other)
    assert 0.03 <= found.significant["feed_rate"] <= 0.08 and found.ranking_returned >= 0.80


def test_a_slow_loop_finds_the_same():
    """The same noise, study by study, through the whole analysis."""
    runs = 60
    found = STUDY.power(rng=7, runs=runs)
    noise = np.random.default_rng(7).standard_normal((runs, 18))
    kept = STUDY.anova(pool="F<1")
    settings = {name: values.tolist() for name, values in STUDY.settings.items()}
    y = STUDY.sn_ratio
    mean = y.mean() + sum(
        np.array([y[STUDY.settings[name] == level].mean() for level in settings[name]]) - y.mean()
        for name in RANKING[:3]
    )
    tables = [
        fin.Study.of_runs(settings, mean + np.sqrt(kept.error.ms) * row, ratio="none").anova()
        for row in noise
    ]
    assert found.ranking_returned == pytest.approx(np.mean([table.ranking == RANKING for table in tables]))
    for name in STUDY.factors:
        assert found.significant[name] == pytest.approx(np.mean([table[name].p < 0.05 for table in tables]))


def test_results_depend_on_the_source_of_randomness_alone():
    assert (
        STUDY.power(rng=4, runs=200).significant
        == STUDY.power(rng=np.random.default_rng(4), runs=200).significant
    )
    assert STUDY.power(rng=4, runs=200).ranking_returned != STUDY.power(rng=5, runs=200).ranking_returned


def test_power_of_unbalanced_runs():
    settings = {name: values[:-3].tolist() for name, values in STUDY.settings.items() if name != "feed_rate"}
    study = fin.Study.of_runs(settings, STUDY.readings[:-3, 0], reference=0.01)
    found = study.power(rng=0, runs=400, pool=None)
    assert found.significant["pattern"] > 0.99
    assert "type II" in study.anova().method


def test_the_next_runs_lie_about_the_best_force():
    runs = STUDY.next_runs(3)
    forces = [run.settings["normal_force"] for run in runs]
    assert len(runs) == 3 and forces == sorted(forces)
    assert forces[1] == pytest.approx(MODEL.best_force(), rel=1e-9)
    assert all(1.15 < force < 1.5 for force in forces)
    assert all(run.settings["pattern"] == "hilbert5" and run.settings["tool_diameter"] == 4.0 for run in runs)
    assert all("feed_rate" not in run.settings for run in runs)
    assert "best at 4, the greatest level tried" in runs.notes[0]
    assert "confirms" in runs[1].why and "below the top 1.301" in runs[0].why
    assert runs[1].why in repr(runs)


def test_their_laws_are_those_of_the_roughness_model():
    """The same surface by the other fit: coefficients uncertain, in mm."""
    for run in STUDY.next_runs(4):
        law = MODEL.law("hilbert5", 4.0, run.settings["normal_force"], uncertain=True)
        assert isinstance(run.law, sdp.LogNormal)
        assert float(run.law.mean) == pytest.approx(float(law.mean), rel=1e-9)
        assert float(run.law.sd) == pytest.approx(float(law.sd), rel=1e-9)


def test_the_gain_is_that_of_the_surface():
    found = optimize.minimize_scalar(
        lambda force: float(MODEL.median("hilbert5", 4.0, force)), bounds=(0.6, 1.6), method="bounded"
    )
    gain = 20 * np.log10(float(MODEL.median("hilbert5", 4.0, 1.111)) / found.fun)
    assert STUDY.next_runs(1).gain == pytest.approx(gain, abs=1e-6)
    assert STUDY.next_runs(1)[0].settings["normal_force"] == pytest.approx(found.x, rel=1e-4)


def test_the_spread_is_that_of_where_the_best_may_lie():
    """By drawing slopes and bends from Student's law: where the vertex falls, against the three runs."""
    forces = np.log([run.settings["normal_force"] for run in STUDY.next_runs(3)])
    names = slice(4, 6)
    rng, size = np.random.default_rng(0), 40000
    noise = rng.multivariate_normal([0.0, 0.0], np.array(MODEL.covariance)[names, names], size)
    drawn = np.array(MODEL.coefficients)[names] + noise * np.sqrt(12 / rng.chisquare(12, size))[:, None]
    place = np.log(1.111) - drawn[:, 0] / (2 * drawn[:, 1])
    wanted = np.quantile(place, [1 / 6, 1 / 2, 5 / 6])
    np.testing.assert_allclose(forces, wanted, atol=0.004)


def test_two_peaks_are_spread_over_both_axes():
    rng = np.random.default_rng(2)
    array = fin.study.orthogonal_array("L9")
    a, b = (np.array([1.0, 2.0, 4.0])[array.matrix[:, k]] for k in (0, 1))
    y = np.exp(0.5 * np.log(a / 2.2) ** 2 + 0.4 * np.log(b / 1.8) ** 2 + 0.01 * rng.standard_normal(9))
    study = fin.Study(array, {"a": (1.0, 2.0, 4.0), "b": (1.0, 2.0, 4.0)}, y, columns=(1, 2))
    runs = study.next_runs(5)
    for name, best in (("a", 2.2), ("b", 1.8)):
        values = [run.settings[name] for run in runs]
        assert len(set(np.round(values, 9))) == 5
        assert np.median(values) == pytest.approx(best, rel=0.05)


def test_a_nominal_study_gives_laws_in_db():
    y = np.random.default_rng(0).normal(
        10.0, [[0.1], [0.2], [0.4], [0.2], [0.1], [0.2], [0.4], [0.4], [0.1]], (9, 4)
    )
    study = fin.Study("L9", {"a": (1.0, 2.0, 3.0), "b": ("x", "y", "z")}, y, ratio="nominal")
    run = study.next_runs(1, pool=None)[0]
    assert isinstance(run.law, sdp.Normal) and float(run.law.mean) == pytest.approx(run.mean)
    assert study.predict(study.best()).response is None
    assert "dB" in repr(study.next_runs(1, pool=None))


def test_rounded_readings_change_little():
    rounded = STUDY.power(
        rng=1, runs=4000, model=lambda s, **how: MODEL.responses(s, **how, rounding=units.um(0.25))
    )
    assert 0.03 <= rounded.significant["feed_rate"] <= 0.08 and rounded.ranking_returned >= 0.80
