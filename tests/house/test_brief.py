"""What is printed is short: six digits, units, no long rows; what a slip of a name or of a unit leads to."""

import numpy as np
import pytest

from sdpgrind import finishing, locus, plunge, weldbead
from sdpgrind.base.progress import UnaskedLine


def test_a_law_of_many_passes_is_printed_in_a_line():
    sample = tuple(np.random.default_rng(0).rayleigh(size=3606).tolist())
    text = repr(weldbead.Scatter("K1", 0.1, law="empirical", sample=sample))
    assert text == "Scatter(attribution='K1', relative_sd=0.1, law='empirical', sample=<3606 values>)"


def test_models_and_problems_are_printed_with_units_and_six_digits():
    process = weldbead.preset("P1").model.replace(specific_energy=10 / 3)
    assert repr(process).startswith(
        "GrindingProcess(specific_energy=3.33333 J/mm^3, idle_power=100 W, friction_ratio=0.3, "
    )
    text = repr(plunge.preset("simulation"))
    assert (
        "stock=0.282 mm, command_rate_max=0.0448 mm/s, roundness_max=0.003 mm, time_constant=1.93341 s)"
        in text
    )


def test_a_point_and_an_estimate_of_scatter_are_printed_short():
    point = repr(locus.plan(locus.preset("koren-example")).at(x=1.1))
    assert point.startswith("Point(hidden={x: 1.1}, controls={u: ") and max(map(len, point.split("."))) < 40
    process, rng = weldbead.preset("P1").model, np.random.default_rng(0)
    force, feed = np.tile([15.0, 30.0, 50.0], 60), np.repeat([3.0, 12.0], 90)
    depth = weldbead.Scatter("K2", 0.3).cut(process, force, feed).sample(rng)
    data = {"normal_force": force, "feed_rate": feed, "cut_depth": depth}
    text = repr(weldbead.identify(data, "scatter", model=process))
    assert (
        text.startswith("ScatterEstimate(K2 favoured of relative sd C1 0.")
        and " ± 0.0" in text
        and len(text) < 300
    )


def test_a_field_deeper_inside_is_shown_the_way():
    with pytest.raises(
        ValueError, match=r"no field 'B'; take replace\(burning=x.model.burning.replace\(B=...\)\) of it, x"
    ):
        plunge.preset("simulation").replace(B=3.0)
    with pytest.raises(ValueError, match="has no field 'stokc'; is stock meant"):
        plunge.preset("simulation").replace(stokc=0.3)


def test_percent_for_a_share_is_asked_about():
    problem = weldbead.preset("P1")
    with pytest.warns(
        UserWarning, match="relative_sd is 2.5, a share of the mean .*: divide by 100 where percent is meant"
    ):
        problem.replace(scatter=weldbead.Scatter("K1", 2.5))
    problem.replace(scatter=weldbead.Scatter("K1", 1.0))
    with pytest.raises(TypeError, match=r"attribution must be 'C1', or several of .*; got 0.15"):
        weldbead.Scatter(0.15, "C1")


def test_control_points_alone_are_led_to_a_b_spline():
    with pytest.raises(TypeError, match=r"degree and knots must be given; Surface.bspline\(control_points\)"):
        finishing.Surface(np.zeros((4, 4, 3)))


def test_a_finishing_plan_shows_its_progress_by_default(monkeypatch):
    told = []
    monkeypatch.setattr(UnaskedLine, "__call__", lambda self, share, text: told.append((share, text)))
    path = finishing.hilbert(finishing.preset("nominal").surface, 2)
    finishing.plan(finishing.FinishingProblem(path))
    assert told[-1] == (1.0, "time laws") and len(told) > 1
