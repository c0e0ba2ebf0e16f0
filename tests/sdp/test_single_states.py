"""Look-ups of one state, by a kernel of its own, against those of arrays."""

import numpy as np
import pytest
from executor_problems import belief, dulling, rayleigh

from sdpgrind import sdp

QUADRATIC = sdp.Charge(under=sdp.Quadratic(2.0), over=sdp.Linear(10.0))
LINEAR = sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0))


def grinding(charge=LINEAR, late=None, modes=("one",), above="refuse"):
    """One axis: two moves, so that cells have kinks."""
    levels = {"mean": sdp.Levels(0.0, 0.6, 33)}
    moves = [
        sdp.Move("fast", levels, sdp.Shift("height", rayleigh), charge=0.005),
        sdp.Move("slow", {"mean": sdp.Levels(0.0, 1.2, 33)}, sdp.Shift("height", rayleigh), duration=2),
    ]
    axis = sdp.Axis("height", 0.0, 2.0, 31, "mm", below="stop", above=above)
    stages = sdp.Stages(5, 2.0, late=late)
    return sdp.Problem([axis], moves, [sdp.Stop("stop", charge)], stages, modes=modes)


def worn(s, c):
    return (s.wear + 0.1, s.heat)


def cubes():
    """Three axes."""
    axes = [
        sdp.Axis("height", 0.0, 1.0, 7, "mm", below="stop"),
        sdp.Axis("wear", 0.0, 1.0, 4, above="hold"),
        sdp.Axis("heat", 0.0, 1.0, 3),
    ]
    move = sdp.Move("grind", {"mean": sdp.Levels(0.05, 0.6, 9)}, sdp.Shift("height", rayleigh, worn))
    return sdp.Problem(axes, [move], [sdp.Stop("stop", LINEAR)], sdp.Stages(2, 1.0))


PROBLEMS = {
    "kinks": grinding,
    "late": lambda: grinding(late=sdp.Linear(0.3)),
    "bent stop": lambda: grinding(QUADRATIC),
    "modes": lambda: grinding(modes=("one", "other")),
    "held above": lambda: grinding(above="hold"),
    "two axes": dulling,
    "endless, logarithm, value at the edge": belief,
    "three axes": cubes,
}


def states(policy, rng, count):
    """States inside, at nodes, at and beyond edges that are not refused; late ones where they are known."""
    layout, given = policy.layout, {}
    for axis, nodes in zip(layout.axes, policy.grid.coordinates, strict=True):
        low = axis.low if axis.below == "refuse" or axis.scale == "log" else axis.low - 0.1
        high = axis.high if axis.above == "refuse" else axis.high + 0.1
        given[axis.name] = np.where(
            rng.uniform(size=count) < 0.2, rng.choice(nodes, count), rng.uniform(low, high, count)
        )
    if not layout.endless:
        least = policy.countdown.lowest if layout.late is None else -3
        given[layout.stage_name] = layout.step * rng.integers(least, layout.count + 1, count).astype(float)
    if len(layout.modes) > 1:
        given["mode"] = rng.integers(0, len(layout.modes), count)
    return given


@pytest.mark.parametrize("name", PROBLEMS)
def test_one_state_is_looked_up_as_many_are(name):
    """To the bit; on a logarithmic axis to the rounding of two logarithms."""
    policy = sdp.plan(PROBLEMS[name]())
    logs = any(axis.scale == "log" for axis in policy.layout.axes)
    same = np.testing.assert_array_equal if not logs else close
    given = states(policy, np.random.default_rng(0), 600)
    value, action = policy.value(**given), policy.action(**given)
    ones = [{key: x[k].item() for key, x in given.items()} for k in range(600)]
    same([policy.value(**one) for one in ones], value)
    found = [policy.action(**one) for one in ones]
    for field in ("stop", "name", "duration"):
        np.testing.assert_array_equal([getattr(one, field) for one in found], getattr(action, field))
    same([one.gap for one in found], action.gap)
    for control, values in action.controls.items():
        same([one.controls[control] for one in found], values)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_the_kernel_answers_inside_the_table_and_the_arrays_elsewhere():
    """Else the test above would compare the arrays with themselves."""
    policy = sdp.plan(grinding(late=sdp.Linear(0.3)))
    assert policy.single.value(6.0, 1.234) == policy.value(height=np.array([1.234]), time_left=6.0)[0]
    assert policy.single.act(6.0, -0.1)[:3] == (1, -1, 0)
    for time, height in ((6.0, 2.1), (6.0, np.nan), (np.nan, 1.0), (99.0, 1.0)):
        assert policy.single.act(time, height) is None and policy.single.value(time, height) is None
    assert policy.single.value(-4.0, 1.0) is None and policy.single.act(-4.0, 1.0) is not None


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"height": 2.1, "time_left": 4.0}, "height must be <= 2"),
        ({"height": float("nan"), "time_left": 4.0}, "height must be finite"),
        ({"height": 1.0, "time_left": 40.0}, "time_left must be <= 10"),
        ({"height": 1.0, "time_left": 4.0, "mode": 2}, "mode must be a whole number"),
        ({"height": 1.0, "time_left": 4.0, "mode": "third"}, "mode must be one of one, other"),
    ],
)
def test_a_state_outside_is_refused_as_in_arrays(state, message):
    policy = sdp.plan(grinding(modes=("one", "other")))
    for look_up in (policy.value, policy.action):
        with pytest.raises(ValueError, match=message):
            look_up(**state)
    with pytest.raises(TypeError, match="a state is given by"):
        policy.value(height=1.0)
