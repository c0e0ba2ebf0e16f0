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
