"""The next pass planned anew: against fine plans of the whole table, for every law and charge."""

from functools import cache

import numpy as np
import pytest
from bead_plans import solved
from stand_job import BOTH

from sdpgrind import sdp, weldbead
from sdpgrind.weldbead.sequence._replan import next_pass

STATES = ((1.0, 60.0), (0.5, 36.0), (1.0, 36.0), (0.2, 12.0), (0.1, 48.0), (0.05, 24.0))
TOLERANCE = 2e-4  # $: the bar of a replan; the fine plans err by less than a tenth of it
# $: laws and charges with a kink between levels or nodes; measured 3.6e-4, 4.0e-4 and 3.3e-4
KINKED = {"rayleigh": 5e-4, "normal": 5e-4, "free near the target": 5e-4}
NAMES = ("K1", "K2", "mu")


def scattering(law, relative_sd=0.15):
    return weldbead.Scatter(NAMES, (relative_sd,) * 3, law=law, mean="coefficient")


CASES = {
    "log-normal": BOTH,
    "rayleigh": BOTH.replace(scatter=scattering("rayleigh")),
    "normal": BOTH.replace(scatter=scattering("normal")),
    "passes alone": BOTH.replace(bead_scatter=None, scatter=scattering("lognormal")),
    "charge of a pass": BOTH.replace(pass_charge=0.02),
    "leads": BOTH.replace(lead_length=15.0),
    "droop": BOTH.replace(speed_droop=0.02),
    "quadratic": BOTH.replace(height_charge=sdp.Charge(under=sdp.Quadratic(2.0), over=sdp.Quadratic(20.0))),
    "free near the target": BOTH.replace(
        height_charge=sdp.Charge(under=sdp.Linear(2.0, tolerance=0.05), over=sdp.Linear(10.0, tolerance=0.03))
    ),
}


@cache
def fine_case(name):
    """Plan of a case on cells of 0.0025 mm, up to the greatest height asked: higher ones change nothing in it."""
    return solved(CASES[name].replace(height_max=1.0), 401)


@pytest.mark.parametrize("name", CASES)
def test_it_is_that_of_a_fine_plan(name):
    problem, tolerance = CASES[name], KINKED.get(name, TOLERANCE)
    fine = fine_case(name)
    for height, left in STATES:
        found, planned = next_pass(problem, "cautious", height, left), fine.action(height, left)
        assert found.penalty == pytest.approx(fine.value(height, left), abs=tolerance)
        assert found.action.stop == planned.stop
        if not planned.stop and planned.gap > 2 * tolerance:
            assert found.action.duration == planned.duration
            assert found.action.gap == pytest.approx(planned.gap, abs=2 * tolerance)
            # the cost is flat: measured, 1 N loses 2e-4 $; of a quadratic charge, all forces 2e-5 $ at 0.05 mm
            if (name, height) != ("quadratic", 0.05):
                assert found.action.normal_force == pytest.approx(planned.normal_force, abs=1.0)


def test_the_force_chosen_costs_what_is_said():
    """Its expected cost by an own sum over the fine plan's values, drawn by 4000 quantiles, no grid."""
    found = next_pass(BOTH, "cautious", 0.5, 36.0)
    law = BOTH.cut(found.action.duration, found.action.normal_force)
    depth = np.exp(np.quantile(np.log(law.sample(0, 400_000)), (np.arange(4000) + 0.5) / 4000))
    fine = fine_case("log-normal")
    left = 36.0 - found.action.duration
    after = np.where(
        depth < 0.5, fine.value(np.maximum(0.5 - depth, 0.0), left), 10.0 * np.maximum(depth - 0.5, 0.0)
    )
    error = after.std() / np.sqrt(400_000)
    assert found.penalty == pytest.approx(after.mean(), abs=4 * error + TOLERANCE)


@pytest.mark.parametrize("left", [0.0, 11.9, 12.0, 35.9, 36.0 - 1e-12, -3.0])
def test_time_between_stages_is_that_of_the_stage_below(left):
    found = next_pass(BOTH, "cautious", 0.5, left)
    on = max(np.floor(left / BOTH.stage + 1e-9), 0.0) * BOTH.stage
    assert found.penalty == next_pass(BOTH, "cautious", 0.5, on).penalty
    assert found.action.stop == (on < 12.0)
    if found.action.stop:
        assert found.penalty == pytest.approx(1.0, rel=1e-12)  # 2 $/mm


def test_without_scatter_it_reaches_the_target_where_time_allows():
    """The weldbead-learning page's values, by adding up mean cuts."""
    problem = BOTH.replace(
        scatter=scattering("lognormal", 0.0), bead_scatter=weldbead.CoefficientScatter(0, 0, 0)
    )
    for (height, left), value in zip(STATES, (0.0, 0.0, 0.456766, 0.0), strict=False):
        assert next_pass(problem, "cautious", height, left).penalty == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "tolerance"),
    [
        ({"scatter": scattering("lognormal", 0.01), "bead_scatter": None}, 6e-4),  # levels do not resolve it
        ({"finish_charge": weldbead.FinishCharge(0.02, reference_rate=10.0)}, TOLERANCE),
        ({"lateness_charge": sdp.Linear(0.02)}, TOLERANCE),
    ],
    ids=["narrow", "finish", "late"],
)
def test_what_stages_do_not_know_is_planned_by_the_solver(change, tolerance):
    problem = BOTH.replace(**change)
    fine = solved(problem.replace(height_max=1.0), 801)
    for height, left in STATES[:4]:
        found = next_pass(problem, "cautious", height, left)
        assert found.penalty == pytest.approx(fine.value(height, left), abs=tolerance), (height, left)
