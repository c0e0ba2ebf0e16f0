"""Value lost by rounded actions: against sweeps of the test's own, with interpolation and expectation of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from sdp_inside import forever, value_lost, value_lost_within

from sdpgrind import sdp

NODES, STAGES = 81, 12
FACTOR, WEIGHT = (0.7, 1.0, 1.3), (0.25, 0.5, 0.25)  # 1 + 0.6 w, w = -0.5, 0, 0.5


def next_of(s, c, e):
    return (s.x - c.a * e.factor,)


@pytest.fixture(scope="module")
def chain():
    """Actions of 4001 sizes that cost and miss, 12 times; then 3 x^2 is charged."""
    cut = sdp.Move(
        "cut",
        {"a": sdp.Levels(0.0, 0.4, 4001, search=False)},
        sdp.Sampled(next_of, {"factor": sdp.Discrete(FACTOR, WEIGHT)}),
        charge=lambda s, c: 2.0 * c.a**2 + 0.02 * (c.a > 0.0),
    )
    end = sdp.Stop("end", lambda s: 3.0 * s.x**2, allowed=lambda s: s.left <= 0.0)
    axis = sdp.Axis("x", 0.0, 1.0, NODES, below="hold")
    return sdp.plan(sdp.Problem([axis], [cut], [end], sdp.Stages(STAGES, 1.0, "left", "")))


def expected(after, action):
    """Cost ($) of actions at nodes, by linear interpolation of what follows."""
    x = np.linspace(0.0, 1.0, NODES).reshape(-1, *[1] * (action.ndim - 1))
    hits = [
        w * np.interp(np.clip(x - action * k, 0, 1), x.ravel(), after)
        for k, w in zip(FACTOR, WEIGHT, strict=True)
    ]
    return 2.0 * action**2 + 0.02 * (action > 0.0) + sum(hits)


def solved():
    """Value-to-go and best action [row, node] by trying every action at every node."""
    every, values, actions = (
        np.linspace(0.0, 0.4, 4001),
        [3.0 * np.linspace(0.0, 1.0, NODES) ** 2],
        [np.zeros(NODES)],
    )
    for _ in range(STAGES):
        costs = expected(values[-1], np.broadcast_to(every, (NODES, every.size)))
        values.append(costs.min(axis=1))
        actions.append(every[costs.argmin(axis=1)])
    return np.array(values), np.array(actions)


def swept(plan, action):
    """Costs of following `action` [row, node], and of one such action followed by the plan, [row, node]."""
    cost, once = [plan[0]], [plan[0]]
    for row in range(1, STAGES + 1):
        once.append(expected(plan[row - 1], action[row]))
        cost.append(expected(cost[-1], action[row]))
    return np.array(cost), np.array(once)


def test_actions_of_the_plan_lose_what_ties_do(chain):
    """Of costs within 1e-9 $ and 1e-7 of the least the plan takes the first."""
    found = value_lost(chain, chain.table.control)
    assert 0.0 <= found.all_stages <= found.bound < STAGES * (1e-9 + 1e-7 * chain.table.value.max())


@pytest.mark.parametrize(
    ("step", "wanted"),
    [
        (0.05, (2.703e-3, 7.659e-3, 1.509e-2)),
        (0.01, (3.031e-4, 3.687e-4, 1.122e-3)),
        (0.002, (3.762e-5, 6.575e-5, 1.513e-4)),
    ],
)
def test_rounded_actions(chain, step, wanted):
    """Numbers that were worked out before there was code; and a sweep in plain numpy."""
    plan, best = solved()
    rounded = step * np.rint(best / step)
    found = value_lost(chain, rounded[:, None])
    assert (found.first_stage, found.all_stages, found.bound) == pytest.approx(wanted, rel=3e-4)
    cost, once = swept(plan, rounded)
    assert np.max(np.abs(found.cost[:, 0] - cost)) < 1e-12
    assert found.all_stages == pytest.approx(np.max(cost - plan), abs=1e-12)
    assert found.first_stage == pytest.approx(np.max(cost[-1] - plan[-1]), abs=1e-12)
    assert found.bound == pytest.approx(np.sum(np.max(once - plan, axis=1)), abs=1e-12)
    assert found.bound >= found.all_stages >= found.first_stage > 0.0


def test_more_than_is_asked_is_found_early(chain):
    best = solved()[1]
    rounded, told = (0.01 * np.rint(best / 0.01))[:, None], []
    most = value_lost(chain, rounded).all_stages
    assert value_lost_within(chain, rounded, 0.1 * most, told.append) is None and 0 < len(told) < STAGES
    found = value_lost_within(chain, rounded, most, told.append)
    assert found.all_stages == most and told[-1] == 1.0 and len(told) > STAGES


def late(charge, window=None):
    """A chain with two modes, charged when late; after a hit one may polish, which costs more without a stop."""
    hit = sdp.Shift("x", lambda s, c: sdp.Normal(c.a, 0.1 + 0.2 * c.a))
    moves = [
        sdp.Move("hit", {"a": sdp.Levels(0.0, 1.0, 41)}, hit, charge=0.01, into="hit"),
        sdp.Move("polish", {"a": [0.05, 0.1]}, hit, duration=2, into="polished"),
    ]
    extra = {"extra": lambda s: np.where(s.mode == 2, 0.0, 0.05)}
    stop = sdp.Stop("end", sdp.Charge(under=sdp.Linear(3.0), over=sdp.Quadratic(5.0)), **extra)
    stages = sdp.Stages(5, 1.0, "left", "", late=charge, late_window=window)
    axis = sdp.Axis("x", 0.0, 1.0, 31, below="stop", above="hold")
    return sdp.plan(sdp.Problem([axis], moves, [stop], stages, modes=("new", "hit", "polished")))


@pytest.mark.parametrize(("charge", "window"), [(sdp.Linear(0.02), None), (sdp.Quadratic(0.01), 6.0)])
def test_late_and_in_modes(charge, window):
    """The forward recursion from a state, adjoint to the sweep, has its cost as mean; late without an end, too."""
    plan = late(charge, window)
    rounded = 0.25 * np.rint(plan.table.control / 0.25)
    found = value_lost(plan, rounded)
    other = sdp.Policy(plan.problem, plan.layout, replace(plan.table, control=rounded), None)
    assert (plan.table.best[0] >= 0).any() == (window is None)
    for left, x, mode in ((5, 0.9, 0), (3, 0.5, 1), (1, 0.7, 2), (-4, 0.8, 0)):
        row, node = int(plan.countdown.row(left)), round(30 * x)
        cost = found.cost[row, mode, node] + (
            plan.countdown.late(left) if plan.countdown.in_base(row) else 0.0
        )
        assert cost == pytest.approx(other.distribution(left=left, x=x, mode=mode).mean, abs=1e-10)
    assert found.bound >= found.all_stages > 1e-3


def test_without_a_deadline():
    """A fixed point, against repeated sweeps of the test's own."""
    cut = sdp.Move(
        "cut",
        {"a": sdp.Levels(0.0, 0.4, 41, search=False)},
        sdp.Sampled(next_of, {"factor": sdp.Discrete(FACTOR, WEIGHT)}),
        charge=lambda s, c: 2.0 * c.a**2 + 0.02,
    )
    axis = sdp.Axis("x", 0.0, 1.0, NODES, below="hold")
    plan = sdp.plan(sdp.Problem([axis], [cut], [sdp.Stop("end", lambda s: 3.0 * s.x**2)], sdp.Forever()))
    rounded = np.maximum(0.05, 0.05 * np.rint(plan.table.control / 0.05))
    found, stop = value_lost(plan, rounded), plan.table.best[0, 0] < 0
    x = np.linspace(0.0, 1.0, NODES)
    cost = 3.0 * x**2
    for _ in range(200):
        cost = np.where(
            stop, 3.0 * x**2, expected(cost, np.nan_to_num(rounded[0, 0])) + 0.02 * (rounded[0, 0] <= 0.0)
        )
    assert np.max(np.abs(found.cost[0, 0] - cost)) < 1e-12
    assert found.all_stages == found.first_stage == found.bound > 1e-4
    endless = value_lost(plan, np.zeros_like(rounded))
    assert endless.all_stages == np.inf


def test_a_cost_that_steps_do_not_reach_is_not_told():
    """A ten-thousandth of the way in a step, from 1 to 10 000: too far for the rounds of many states."""
    slow = sparse.diags_array(np.full(forever.DIRECT + 1, 0.9999), format="csr")
    start = np.full(slow.shape[0], 1.0)
    assert np.isnan(forever.settled(slow, np.full(start.size, 1.0), start)).all()
    near = forever.settled(slow, np.full(start.size, 1.0), np.full(start.size, 1e4))
    np.testing.assert_allclose(near, 1e4, rtol=1e-12)
