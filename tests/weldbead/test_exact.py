"""Problems without scatter: the closed form against all sequences of passes, one by one."""

import pickle
from functools import lru_cache

import numpy as np
import pytest

import sdpgrind
from sdpgrind import sdp, weldbead

P1 = weldbead.preset("P1").replace(
    scatter=weldbead.Scatter("C1", 0.0), durations=(6, 8, 12), horizon=26.0, pass_charge=0.03
)
QUADRATIC = sdp.Charge(under=sdp.Quadratic(1.5, 0.05), over=sdp.Linear(10.0))
PROBLEMS = {
    "plain": P1.replace(pass_charge=0.0),
    "passes": P1,
    "finish": P1.replace(finish_charge=weldbead.FinishCharge(0.4, reference_rate=12.5)),
    "quadratic": P1.replace(height_charge=QUADRATIC),
    "jump": P1.replace(height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Constant(5.0))),
}


@lru_cache
def planned(name):
    return weldbead.plan(PROBLEMS[name])


def by_all_sequences(problem, height, time_left, last_charge=0.0):
    """Least charge over every sequence of passes at the greatest force; one that ends at the target is free."""
    best = float(problem.height_charge(height)) + last_charge
    for duration in problem.durations:
        if duration > time_left:
            break
        feed = problem.feed_rate(duration)
        cut = float(problem.depths.moments(problem.model, problem.force_interval(duration)[1], feed)[0])
        finish = 0.0 if problem.finish_charge is None else float(problem.finish_charge(feed))
        left = max(0.0, height - cut)
        rest = by_all_sequences(problem, left, time_left - duration, finish)
        best = min(best, problem.pass_charge + rest)
    return best


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_value_is_the_least_over_all_sequences(name):
    policy = planned(name)
    assert policy.status == "exact" and policy.error == 0.0
    rng = np.random.default_rng(1)
    for height, time in zip(rng.uniform(0.01, 2.0, 40), 2.0 * rng.integers(0, 14, 40), strict=True):
        expected = by_all_sequences(PROBLEMS[name], height, time)
        assert policy.value(height, time) == pytest.approx(expected, abs=1e-9)
        found = policy.alternatives(height, time, within=np.inf)
        assert min(found.values()) == pytest.approx(expected, abs=1e-9)
        best = policy.action(height, time)
        name_of = "stop" if best.stop else f"{best.duration:g} s"
        assert found[name_of] == pytest.approx(expected, abs=2e-9)


def test_values_of_the_specification():
    """No scatter: 0, 0, .456766, 0; .06, .02, .496766, .02 with a pass charge of .02."""
    process = weldbead.sequence.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    stand = weldbead.SequenceProblem(
        process, bead_length=150.0, reset_time=2.0, durations=range(12, 41, 4), force_max=50.0,
        burn_limit=weldbead.sequence.ForceBurnLimit(16.0), scatter=weldbead.Scatter("K1", 0.0), height_max=2.0,
        horizon=60.0, stage=4.0, height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)),
    )  # fmt: skip
    height, time = np.array([1.0, 0.5, 1.0, 0.2]), np.array([60.0, 36.0, 36.0, 12.0])
    free, charged = (weldbead.plan(stand.replace(pass_charge=each)) for each in (0.0, 0.02))
    np.testing.assert_allclose(free.value(height, time), [0, 0, 0.456766, 0], atol=1e-6)
    np.testing.assert_allclose(charged.value(height, time), [0.06, 0.02, 0.496766, 0.02], atol=1e-6)


@pytest.mark.parametrize("name", PROBLEMS)
def test_following_it_costs_what_it_says(name):
    policy = planned(name)
    for height, time in ((1.7, 26.0), (0.9, 26.0), (0.35, 14.0), (0.2, 4.0)):
        runs = policy.simulate(runs=3, height=height, time_left=time)
        assert runs.mean == pytest.approx(policy.value(height, time), abs=1e-8)
        assert np.all(runs.final["height"] >= 0)


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_table_is_laid_out_as_the_solver_does_and_knows_the_moves_where_it_stops(name):
    table = planned(name).table
    solved = sdp.plan(weldbead.sequence.sdp_problem(PROBLEMS[name], 41, levels=3))
    assert table.layout == solved.layout and table.kinks.start.size == 1
    stops = table.table.best < 0
    np.testing.assert_array_equal(table.table.move[stops], solved.table.move[stops])
    np.testing.assert_array_equal(table.table.move[~stops], table.table.best[~stops])
    assert np.any(table.table.move[stops] >= 0) and np.any(table.table.move[stops] < 0)
    assert not np.any(table.table.entry)


def test_the_slope_is_that_of_the_value():
    policy, height = planned("quadratic"), np.linspace(0.03, 1.97, 31)
    step = 1e-6
    slope = (policy.value(height + step, 14.0) - policy.value(height - step, 14.0)) / (2 * step)
    np.testing.assert_allclose(policy.gradient(height, 14.0), slope, atol=1e-5)


@pytest.mark.parametrize("name", ["passes", "finish"])
def test_files_and_pickles_hold_it(name, tmp_path):
    policy, heights = planned(name), np.linspace(0.0, 2.0, 77)
    policy.save(tmp_path / "p.nc")
    for other in (sdpgrind.load(tmp_path / "p.nc"), pickle.loads(pickle.dumps(policy))):
        np.testing.assert_array_equal(other.value(heights, 20.0), policy.value(heights, 20.0))
        found, known = other.action(heights, 20.0), policy.action(heights, 20.0)
        np.testing.assert_array_equal(found.normal_force, known.normal_force)
        assert repr(other) == repr(policy) and other.status == "exact"


def test_a_grid_that_is_asked_for_is_solved():
    grid = weldbead.plan(PROBLEMS["plain"], tolerance=None, nodes=401)
    assert grid.nodes == 401 and grid.status == "given grid"
    heights = np.linspace(0.0, 2.0, 401)
    difference = grid.value(heights, 26.0) - planned("plain").value(heights, 26.0)
    assert np.all(difference > -1e-9) and np.max(difference) < grid.error


def test_where_the_closed_form_does_not_hold_a_grid_is_refined():
    small = P1.replace(durations=(12,), horizon=12.0)
    for problem in (small.replace(min_cut=0.1), small.replace(lateness_charge=sdp.Linear(0.5))):
        assert weldbead.plan(problem, tolerance=0.1).status != "exact"
