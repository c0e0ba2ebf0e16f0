"""A user's step of `sdp.Sampled` is compiled where that pays, with the values that numpy gives."""

import numpy as np
import pytest
from numba.core.errors import NumbaError
from sdp_inside import Grid, Menu, PointBundle

from sdpgrind import sdp


def scattered(s, c, e):
    return (np.minimum(np.maximum(s.x - c.d * np.exp(0.3 * e.z), 0.0), 1.0),)


def not_for_numba(s, c, e):
    return (np.asarray(scattered(s, c, e)[0]).astype(float),)


def evaluated(count, step=scattered, timed=False, compiled=None, stages=None):
    """A move of `count` evaluations a stage, in hundreds: 10 levels and 10 points of noise."""
    to = sdp.Sampled(step, {"z": sdp.Normal(0.0, 1.0)}, points=10, compiled=compiled)
    move = sdp.Move("go", {"d": np.linspace(0.1, 0.5, 10)}, to, charge=0.1, timed=timed)
    stop = sdp.Stop("end", lambda s: 3.0 * s.x**2)
    return sdp.Problem([sdp.Axis("x", 0.0, 1.0, count)], [move], [stop], stages or sdp.Stages(2, 1.0))


@pytest.mark.parametrize(
    ("problem", "compiles"),
    [
        (evaluated(1_000, timed=True), True),
        (evaluated(999, timed=True), False),
        (evaluated(10_000), True),
        (evaluated(9_999), False),
        (evaluated(10_000, stages=sdp.Forever()), False),
        (evaluated(10_000, compiled=False), False),
        (evaluated(10, compiled=True), True),
        (evaluated(10_000, not_for_numba), False),
    ],
    ids=["once", "few once", "kept", "few kept", "forever", "numpy asked", "asked", "does not compile"],
)
def test_a_step_is_compiled_where_it_pays(problem, compiles):
    menu = Menu(problem, Grid.of(problem), 0)
    bundle = PointBundle(menu, False, slice(0, 2), 1.0, keep=not problem.moves[0].timed)
    assert bundle.compiled == compiles


@pytest.mark.parametrize("timed", [False, True], ids=["kept", "once"])
@pytest.mark.parametrize("step", [scattered, not_for_numba])
def test_compiled_or_not_a_large_move_has_the_same_value(step, timed, monkeypatch):
    for name in ("COMPILED_ONCE", "COMPILED_KEPT"):
        monkeypatch.setattr(f"sdpgrind.sdp._solve.point_backup.{name}", 1)
    monkeypatch.setattr("sdpgrind.sdp._transitions.step_kernels._ROOM", 40)  # 53 pieces, the last one short
    own, numpy = (sdp.plan(evaluated(21, step, timed, compiled)).table.value for compiled in (None, False))
    np.testing.assert_allclose(own, numpy, rtol=0, atol=1e-15)


def test_a_step_that_must_compile_and_cannot_is_refused():
    with pytest.raises(NumbaError):
        sdp.plan(evaluated(21, not_for_numba, compiled=True))


def test_a_compiled_step_divides_by_zero_as_numpy_does():
    def step(s, c, e):
        return (np.minimum(1.0 / (s.x * 0.0 + e.z), 1.0),)

    def planned(compiled):
        to = sdp.Sampled(step, {"z": sdp.Discrete([0.0, 2.0])}, compiled=compiled)
        move = sdp.Move("go", {}, to, charge=-0.1)
        stop = sdp.Stop("end", lambda s: s.x)
        return sdp.plan(sdp.Problem([sdp.Axis("x", 0.0, 1.0, 3)], [move], [stop], sdp.Stages(2, 1.0)))

    with np.errstate(divide="ignore"):
        np.testing.assert_array_equal(planned(True).table.value, planned(False).table.value)


def too_few(s, c, e):
    return (s.x + e.z,)


def too_many(s, c, e):
    return s.x + e.z, s.y, s.y


@pytest.mark.parametrize(("step", "got"), [(too_few, 1), (too_many, 3)])
@pytest.mark.parametrize("compiled", [True, False])
def test_a_step_gives_a_coordinate_for_each_axis(step, got, compiled):
    """Compiled, one too few was taken from the state before, and one too many written behind its array."""
    move = sdp.Move("go", {}, sdp.Sampled(step, {"z": sdp.Discrete([0.0])}, compiled=compiled), charge=0.1)
    axes = [sdp.Axis(name, 0.0, 1.0, 3) for name in "xy"]
    problem = sdp.Problem(axes, [move], [sdp.Stop("end", lambda s: s.x)], sdp.Stages(1, 1.0))
    said = f"move 'go': step must return a tuple of 2 coordinates; got a tuple of {got}"
    with pytest.raises(TypeError, match=said):
        sdp.plan(problem)


def ratio(s, c, e):
    return (c.to / c.over + e.z,)


def moved(to, over=1.0, **edges):
    """Plan of a compiled move to a coordinate, from each node of an axis from 0 to 2."""
    step = sdp.Sampled(ratio, {"z": sdp.Discrete([0.0])}, compiled=True)
    move = sdp.Move("go", {"to": [to], "over": [over]}, step, charge=-10.0)
    stop = sdp.Stop("end", lambda s: s.x)
    return sdp.plan(sdp.Problem([sdp.Axis("x", 0.0, 2.0, 5, **edges)], [move], [stop], sdp.Stages(1, 1.0)))


@pytest.mark.parametrize(
    ("to", "over", "told"),
    [(-0.25, 1.0, "got -0.25"), (2.25, 1.0, "got 2.25"), (1.0, 0.0, "infinity"), (0.0, 0.0, "NaN")],
)
def test_a_compiled_step_must_not_leave_a_refused_edge(to, over, told):
    with pytest.raises(ValueError, match=f"move 'go'.*{told}"):
        moved(to, over)


@pytest.mark.parametrize("to", [-1e-9, 2.0 + 1e-9])
def test_rounding_beyond_a_refused_edge_is_none(to):
    """It is held at the edge; the length of the axis is 2, and 1e-9 of it is counted as rounding."""
    np.testing.assert_array_equal(moved(to).table.value[1, 0], min(max(to, 0.0), 2.0) - 10.0)


@pytest.mark.parametrize(("edges", "to"), [({"below": "hold"}, -0.25), ({"above": "hold"}, 2.25)])
def test_a_compiled_step_may_leave_an_edge_that_holds(edges, to):
    np.testing.assert_array_equal(moved(to, **edges).table.value[1, 0], min(max(to, 0.0), 2.0) - 10.0)


def test_beyond_a_stopping_edge_the_further_charge_of_the_mode_is_paid():
    def gone(s, c, e):
        return (s.x - 3.0 + e.z,)

    def planned(compiled):
        to = sdp.Sampled(gone, {"z": sdp.Discrete([0.0, 0.5])}, compiled=compiled)
        moves = [sdp.Move(name, {}, to, into=name, charge=-4.0) for name in ("soft", "hard")]
        charge = sdp.Charge(under=sdp.Linear(5.0), over=sdp.Linear(1.0))
        stop = sdp.Stop("end", charge, extra=lambda s: 2.0 * (s.mode == 1) + 1.0)
        axis = sdp.Axis("x", 0.0, 2.0, 5, below="stop", above="stop")
        return sdp.plan(sdp.Problem([axis], moves, [stop], sdp.Stages(1, 1.0), modes=("soft", "hard")))

    own = planned(True)
    np.testing.assert_allclose(own.table.value, planned(False).table.value, rtol=0, atol=1e-15)
    x = np.linspace(0.0, 2.0, 5)
    np.testing.assert_allclose(
        own.table.value[1, 0], np.minimum(5.0 * x + 1.0, 2.75 - x - 4.0 + 1.0), atol=1e-14
    )


def ended(charge, compiled, reached=0.5, low=1.0, **edges):
    """Plan of a move to a coordinate beyond an edge that stops, from the nodes of an axis to 3."""
    to = sdp.Sampled(lambda s, c, e: (e.z,), {"z": sdp.Discrete([reached])}, compiled=compiled)
    move, stop = sdp.Move("go", {}, to, charge=-100.0), sdp.Stop("end", charge)
    return sdp.plan(sdp.Problem([sdp.Axis("x", low, 3.0, 3, **edges)], [move], [stop], sdp.Stages(1, 1.0)))


@pytest.mark.parametrize("compiled", [True, False])
def test_beyond_an_edge_above_the_target_too_little_is_charged(compiled):
    """The charge of its other side, 0.5 $, was paid compiled."""
    charge = sdp.Charge(under=sdp.Linear(5.0), over=sdp.Linear(1.0))
    np.testing.assert_allclose(ended(charge, compiled, below="stop").table.value[1, 0], -97.5, atol=1e-13)


def test_a_function_that_charges_a_stop_leaves_its_moves_to_numpy(monkeypatch):
    """Compiled, nothing was charged beyond the edge."""
    monkeypatch.setattr("sdpgrind.sdp._solve.point_backup.COMPILED_KEPT", 1)
    charge = sdp.Charge(under=lambda z: z**3)
    edges = {"reached": 4.0, "above": "stop"}
    np.testing.assert_allclose(ended(charge, None, **edges).table.value[1, 0], -36.0, atol=1e-13)
    with pytest.raises(ValueError, match="move 'go': beyond an edge 'stop' a compiled move needs a charge"):
        ended(charge, True, **edges)
    below = ended(charge, True, reached=-1.0, low=0.0, below="stop")  # there `over` charges, which is nothing
    np.testing.assert_array_equal(below.table.value[1, 0], -100.0)


@pytest.mark.parametrize("compiled", [True, False])
def test_a_charge_of_the_next_coordinates_that_is_no_number_is_refused(compiled):
    """Compiled, the move was never chosen, in silence."""
    to = sdp.Sampled(scattered, {"z": sdp.Discrete([0.0])}, lambda s, c, n: n.x * np.nan, compiled=compiled)
    move, stop = sdp.Move("go", {"d": [0.1]}, to, charge=-1.0), sdp.Stop("end", lambda s: s.x)
    with pytest.raises(ValueError, match="move 'go': charge of the next coordinates must be a number"):
        sdp.plan(sdp.Problem([sdp.Axis("x", 0.0, 1.0, 3)], [move], [stop], sdp.Stages(1, 1.0)))
