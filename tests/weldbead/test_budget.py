"""Limits of time and memory: which grid is the last, its error, and that it can be solved again to the bit."""

import itertools
import tracemalloc
from functools import cache

import numpy as np
import pytest
from bead_plans import solved

import sdpgrind
from sdpgrind import sdp, weldbead
from sdpgrind.sdp._plan.budget import Resources

pytestmark = pytest.mark.filterwarnings("ignore:the expected penalty is known:UserWarning")  # of jumps
P1 = weldbead.preset("P1").replace(durations=(6, 10), horizon=24.0)
JUMPS = P1.replace(height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Constant(2.0)))
CONSTANT = P1.replace(height_charge=sdp.Charge(under=sdp.Constant(2.0), over=sdp.Linear(10.0)))
LOGNORMAL = JUMPS.replace(scatter=weldbead.Scatter("C1", 0.15, law="lognormal"))
LEVELS = 401
TABLES = ("value", "best", "move", "control", "entry", "gap")


def same_bits(one, other):
    return all(
        np.array_equal(getattr(one.table.table, name), getattr(other.table.table, name), equal_nan=True)
        for name in TABLES
    )


@cache
def fine_plan(problem, nodes=1601, levels=LEVELS):
    """Plan of a fine grid that several tests compare with."""
    return solved(problem, nodes, levels=levels)


def largest_difference(policy, fine, above=-1.0):
    """Over heights between the nodes of both, above one, at all stages."""
    height = np.linspace(0.0, policy.problem.height_max, 4321)[:, None]
    height = height[height[:, 0] > above]
    time = np.arange(0.0, policy.problem.horizon + 1, policy.problem.stage)
    return np.max(np.abs(policy.value(height, time) - fine.value(height, time)))


@pytest.fixture
def clock(monkeypatch):
    """Set the seconds that each grid takes."""

    def set_times(*seconds):
        times = itertools.accumulate(itertools.chain([0.0], seconds, itertools.repeat(1e9)))
        monkeypatch.setattr("sdpgrind.sdp._plan.budget.monotonic", lambda: next(times))
        # The default of a field is bound when the class is made.
        monkeypatch.setattr(
            "sdpgrind.sdp._plan.budget.Resources.of",
            classmethod(lambda cls, time, memory: cls(time, memory, next(times))),
        )

    return set_times


@pytest.mark.parametrize(
    ("seconds", "limit", "nodes"),
    [
        ((0.1, 0.4), 1.0, 201),  # the next takes 1.6 s at least
        ((0.1, 0.1), 1.2, 401),  # and 0.4 s here, as time grows fourfold at least
        ((0.1, 0.4, 1.6), 5.0, 401),
        ((0.1, 0.7), 4.0, 201),  # sevenfold growth goes on
        ((0.1, 0.7), 7.3, 401),
        ((50.0, 0.1), 1.0, 201),  # two grids, whatever they take
    ],
)
def test_the_next_halving_is_begun_only_if_its_time_is_left(seconds, limit, nodes, clock):
    clock(*seconds)
    policy = weldbead.plan(JUMPS, time_limit=limit)
    assert (policy.nodes, policy.status) == (nodes, "time limit")


def test_the_last_grid_is_solved_again_to_the_bit(clock):
    clock(0.1, 0.1, 0.2)
    policy = weldbead.plan(JUMPS, time_limit=1.0)
    assert policy.nodes == 401
    assert policy._options == {"tolerance": None, "nodes": 401, "levels": policy.levels, "method": "cautious"}
    again = weldbead.plan(JUMPS, tolerance=None, nodes=policy.nodes, levels=policy.levels)
    assert same_bits(policy, again) and again.status == "given grid"
    fine = fine_plan(JUMPS, levels=1604)
    assert largest_difference(policy, fine) <= policy.error < 5e-3


def test_memory_is_predicted_before_it_is_taken():
    largest = 50e6
    policy = weldbead.plan(JUMPS, memory_limit=largest)
    assert policy.status == "memory limit"
    # weight and charge of 401 levels of two moves, and as much for working on them
    assert 16 * policy.nodes * 2 * policy.levels < largest < 12 * 16 * policy.nodes * 2 * policy.levels


def peak_bytes(solve):
    tracemalloc.start()
    found = solve()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return found, peak


@pytest.mark.parametrize("problem", [P1, LOGNORMAL], ids=["P1", "log-normal"])
def test_memory_is_held_from_the_first_grid_on(problem):
    grid = weldbead.sequence.sdp_problem(problem, 101)
    first, second = (Resources(memory_limit=1.0).bytes(grid, refine) for refine in (1, 2))
    with pytest.raises(ValueError, match=r"^memory_limit must be >= \S+, which the first grid of 101 nodes"):
        weldbead.plan(problem, memory_limit=0.99 * first)
    fine = fine_plan(problem)
    for limit, nodes in ((1.01 * first, 101), (0.99 * second, 101), (1.01 * second, 201)):
        policy, peak = peak_bytes(lambda limit=limit: weldbead.plan(problem, memory_limit=limit))
        assert (policy.nodes, policy.levels, policy.status) == (nodes, LEVELS, "memory limit")
        assert peak <= limit
        assert largest_difference(policy, fine) <= policy.error
    with pytest.raises(sdp.ToleranceError, match=r"got 1e-05: try"):
        weldbead.plan(problem, tolerance=1e-5, memory_limit=1.01 * first)
    assert weldbead.plan(problem, tolerance=0.1, memory_limit=1.01 * first).status == "tolerance reached"


def test_a_limit_is_no_error_unless_a_tolerance_was_asked_for(clock):
    clock(1.0, 1.0)
    with pytest.raises(sdp.ToleranceError, match=r"reachable within 1 s and 2 GiB of tables") as refused:
        weldbead.plan(JUMPS, tolerance=1e-5, time_limit=1.0)
    assert refused.value.policy.status == "time limit"
    clock(1.0, 1.0)
    policy = weldbead.plan(JUMPS, tolerance=1e-5, time_limit=1.0, throw=False)
    assert policy.error > 1e-5 and policy.status == "time limit"


def test_limits_that_are_not_met_change_nothing(tmp_path):
    policy = weldbead.plan(P1, tolerance=1e-3, time_limit=1e6, memory_limit=1e12)
    assert policy.status == "tolerance reached" and same_bits(policy, weldbead.plan(P1, tolerance=1e-3))
    policy.save(tmp_path / "p.nc")
    assert sdpgrind.load(tmp_path / "p.nc").status == "tolerance reached"


@pytest.mark.parametrize("nodes", [3, 40, 101])
@pytest.mark.parametrize("problem", [P1, JUMPS], ids=["P1", "jumps"])
def test_a_single_grid_has_an_error(problem, nodes):
    policy = weldbead.plan(problem, tolerance=None, nodes=nodes)
    fine = fine_plan(problem, levels=1604)
    assert largest_difference(policy, fine) <= policy.error < 30 * largest_difference(policy, fine)
    alone = sdp.plan(weldbead.sequence.sdp_problem(problem, nodes))
    assert np.array_equal(policy.table.table.value, alone.table.value) and alone.error is None


def test_a_charge_that_jumps_is_told_once(clock):
    under = sdp.Constant(1.0, 0.1)
    problem = P1.replace(height_charge=sdp.Charge(under=under, over=sdp.Linear(10.0)))
    clock(1.0, 1.0)
    with pytest.warns(UserWarning, match=r"jumps, at 0.1 mm, is of order 1: twice the nodes halve") as found:
        policy = weldbead.plan(problem, time_limit=1.0)
    jumps = [each for each in found if "jumps" in str(each.message)]
    assert len(jumps) == 1 and jumps[0].filename == __file__
    fine = fine_plan(problem, nodes=3201)
    assert largest_difference(policy, fine) <= policy.error


@pytest.mark.parametrize("problem", [JUMPS, LOGNORMAL, CONSTANT], ids=["over", "log-normal", "under"])
def test_neither_error_is_below_the_true_one(problem):
    fine = fine_plan(problem)
    for nodes in (101, 201):
        policy = weldbead.plan(problem, tolerance=None, nodes=nodes)
        assert largest_difference(policy, fine) <= policy.error
        if problem is CONSTANT:  # passes end next to the jump from everywhere
            assert policy.error_away is None
        else:
            away = largest_difference(policy, fine, above=2.0 / (nodes - 1))
            assert away <= policy.error_away < 20 * away and policy.error_away < policy.error / 2


def test_the_error_away_from_a_jump_is_told_and_kept(clock, tmp_path):
    clock(0.1, 0.4)
    with pytest.warns(
        UserWarning, match=r"\(\S+ \$ away from its jump at 0 mm\), not to .* jumps, at 0 mm, is of"
    ):
        policy = weldbead.plan(JUMPS, time_limit=1.0)
    fine = fine_plan(JUMPS)
    away = largest_difference(policy, fine, above=2.0 / (policy.nodes - 1))
    assert away <= policy.error_away <= policy.error
    assert f"({policy.error_away:.1g} $ away from its jump at 0 mm)" in repr(policy)
    policy.save(tmp_path / "p.nc")
    assert sdpgrind.load(tmp_path / "p.nc").error_away == policy.error_away
    assert weldbead.plan(P1, tolerance=1e-2).error_away is None


def test_messages():
    for name, unit in (("time_limit", "s"), ("memory_limit", "bytes")):
        with pytest.raises(ValueError, match=rf"{name} must be > 0 \({unit}\); got -1"):
            weldbead.plan(P1, **{name: -1.0})
        with pytest.raises(ValueError, match=rf"{name} must be None with tolerance=None, a single grid"):
            weldbead.plan(P1, tolerance=None, **{name: 1.0})
        with pytest.raises(ValueError, match=rf"{name} must be None with feed='continuous'"):
            weldbead.plan(P1, feed="continuous", **{name: 1.0})
