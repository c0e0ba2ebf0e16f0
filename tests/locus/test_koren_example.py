"""Koren's own example: published numbers, the errors in them, and closed forms against searches."""

import math

import cvxpy as cp
import numpy as np
import pytest
from closed_forms import GAINS, koren_run, named, slacks
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import _presets
from scipy.optimize import brentq, minimize

from sdpgrind.locus.processes import KorenExample

EXAMPLE = KorenExample()
X = st.floats(0.5, 20.0)


def test_published_points():
    assert EXAMPLE.point(0.3) == (1.0, 4.0) == EXAMPLE.point(0.5)
    u, v = EXAMPLE.point([1.0, 20.0])
    np.testing.assert_allclose(u, [2.0, 479 / 401], rtol=1e-15)
    np.testing.assert_allclose(v, [3.0, 44 / 401], rtol=1e-15)
    np.testing.assert_allclose((v[1], u[1]), (0.1097257, 1.1945137), atol=5e-8)
    assert EXAMPLE.multiplier(1.0) == pytest.approx(2.0)
    turn = (1 + math.sqrt(5)) / 2
    # u is greatest here, and no coordinate
    np.testing.assert_allclose(EXAMPLE.point(turn), (math.sqrt(5), 2.0), rtol=1e-14)


@pytest.mark.parametrize("x", [0.3, 0.52, 1.0, 4.0, 20.0])
def test_points_against_a_convex_solver(x):
    u, v = cp.Variable(), cp.Variable()
    limit = x * v + 16 - 4 * v <= 17 + u - 4 * v
    cp.Problem(cp.Minimize((u - 1) ** 2 + (v - 4) ** 2), [limit, u >= 0, u <= 5, v <= 10]).solve(
        solver=cp.CLARABEL
    )
    np.testing.assert_allclose(EXAMPLE.point(x), (u.value, v.value), atol=2e-6)
    np.testing.assert_allclose(EXAMPLE.multiplier(x), limit.dual_value, atol=1e-5)


@given(X)
def test_every_point_is_on_the_circle_with_a_multiplier_above_zero(x):
    u, v = EXAMPLE.point(x)
    assert u**2 + (v - 2) ** 2 == pytest.approx(5.0, abs=1e-13)
    assert EXAMPLE.u_on_locus(v) == pytest.approx(u, rel=1e-13)
    assert EXAMPLE.hidden_state(v) == pytest.approx(x, rel=1e-12)
    lagrangian = (2 * (u - 1) - EXAMPLE.multiplier(x), 2 * (v - 4) + EXAMPLE.multiplier(x) * x)
    np.testing.assert_allclose(lagrangian, 0, atol=1e-12)


@given(X)
@settings(max_examples=50)
def test_loop_slope_is_the_slope_of_the_error_along_the_circle(x):
    v, step = float(EXAMPLE.point(x)[1]), 1e-6
    error = [1 + math.sqrt(5 - (w - 2) ** 2) - x * w for w in (v - step, v + step)]
    assert EXAMPLE.loop_slope(x) == pytest.approx((error[1] - error[0]) / (2 * step), rel=1e-7)


@pytest.mark.parametrize(("x", "stable", "no_overshoot"), [(x, *gains) for x, gains in GAINS.items()])
def test_gains(x, stable, no_overshoot):
    assert (EXAMPLE.gain_max(x), EXAMPLE.gain_without_overshoot(x)) == (
        pytest.approx(stable, abs=5e-5),
        pytest.approx(no_overshoot, abs=5e-5),
    )


def test_no_gain_is_greater_than_that_near_1_1235():
    x = np.linspace(0.5, 20, 20001)
    gains = EXAMPLE.gain_max(x)
    assert x[np.argmax(gains)] == pytest.approx(1.1235, abs=1e-3)
    assert gains.max() == pytest.approx(1.3462, abs=5e-5)


def test_limits_of_the_printed_gains():
    def where(function, gain, low, high):
        return brentq(lambda x: float(function(x)) - gain, low, high, xtol=1e-13)

    assert where(EXAMPLE.gain_max, 0.6, 2, 10) == pytest.approx(4.05217, abs=1e-5)
    assert where(EXAMPLE.gain_max, 0.9, 0.5, 1) == pytest.approx(0.54758, abs=1e-5)
    assert where(EXAMPLE.gain_max, 0.9, 2, 4) == pytest.approx(2.61890, abs=1e-5)
    assert where(EXAMPLE.gain_without_overshoot, 0.6, 0.5, 1) == pytest.approx(0.758, abs=5e-4)
    assert where(EXAMPLE.gain_without_overshoot, 0.6, 1.2, 4) == pytest.approx(1.721, abs=5e-4)
    assert EXAMPLE.gain_without_overshoot(np.linspace(0.5, 20, 2001)).min() == pytest.approx(0.0543, abs=5e-5)


@pytest.mark.parametrize(
    ("gain", "rest", "wander"), [(0.6, 4.02, 4.08), (0.9, 2.60, 2.64), (0.9, 0.56, 0.54)]
)
def test_runs_come_to_rest_inside_these_limits_only(gain, rest, wander):
    for x, settles in ((rest, True), (wander, False)):
        path = koren_run(x, gain, 4000)
        assert (np.ptp(path[-50:, 0]) < 1e-6) == settles


def test_run_of_the_paper():
    path = koren_run(1.0, 0.6, 5)
    v, u = path[:, 0], path[:, 1]
    np.testing.assert_allclose(v[1:], [1.36060, 2.42986, 2.88856, 2.98659, 2.99863], atol=1e-5)
    limit = 17 + u - 4 * v
    errors = 100 * np.abs(np.array([v / 3, u / 2, limit / 7]) - 1)
    np.testing.assert_allclose(errors[:, 5], (0.046, 0.034, 0.088), atol=1e-3)  # printed: all < 0.5 %
    # printed: all < 4 %, which the limit is not
    np.testing.assert_allclose(errors[:, 3], (3.715, 2.597, 7.110), atol=1e-3)


def test_ramp_of_the_paper():
    x = np.maximum(1 - 0.01 * np.arange(61), 0.52)
    path = koren_run(x, 0.6, 60)
    u, v = EXAMPLE.point(x)
    behind = 100 * np.abs(path[:, :2] / np.array([v, u]).T - 1)[4:]
    np.testing.assert_allclose(behind.max(axis=0), (1.21, 2.09), atol=0.01)  # printed: < 3 %
    assert path[:49, 2].min() > 0  # never violated while it runs ...
    assert path[49:, 2].min() == pytest.approx(-0.0118, abs=2e-4)  # ... but just after it stops
    tightening = koren_run(
        np.minimum(0.52 + 0.01 * np.arange(200), 1.0), 0.6, 199, start=float(EXAMPLE.point(0.52)[1])
    )
    assert tightening[:, 2].min() == pytest.approx(-0.0397, abs=2e-4)


def test_retrieval_runs_away_from_6_92738_on():
    limit = brentq(lambda x: float(EXAMPLE.retrieval_multiplier(x)) + 1, 5, 10, xtol=1e-12)
    assert limit == pytest.approx(6.92738, abs=1e-5)
    np.testing.assert_allclose(EXAMPLE.retrieval_multiplier([1.0, 20.0]), (0.667, -6.6), rtol=2e-2)
    v = EXAMPLE.point(3.0)[1]
    # by hand: response read at v + step, then v of the limit that equals it
    step, rate = 1e-6, EXAMPLE.retrieval_multiplier(3.0)
    read = 3.0 * (v + step) + 16 - 4 * (v + step)
    called = brentq(lambda w: 17 + math.sqrt(5 - (w - 2) ** 2) - 4 * w - read, v - 0.1, v + 0.1, xtol=1e-15)
    assert (called - v) / step == pytest.approx(float(rate), rel=1e-4)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_an_unknown_scale_calibrates_by_x_anew_but_not_by_the_response(scale):
    """Uncertainty and hidden state enter by their product alone: the optimum as a function of the response
    does not know it.
    """
    problem = _presets.preset("koren-example").replace(scale=scale)
    for x in (1.0, 5.0):
        found = minimize(
            lambda z: problem.objective(None, named(u=z[0], v=z[1])), (2.0, 0.5), method="SLSQP", options={"ftol": 1e-15},
            constraints=[{"type": "ineq", "fun": lambda z, x=x: slacks(problem, {"x": x}, {"u": z[0], "v": z[1]})[0]}],
        )  # fmt: skip
        u, v = found.x
        np.testing.assert_allclose(problem.model.point(x), (u, v), atol=1e-6)
        assert problem.model.hidden_state(v) == pytest.approx(x, abs=1e-5)
        assert EXAMPLE.hidden_state(v) == pytest.approx(scale * x, abs=1e-5)
        response = problem.varying[0].response(named(x=x), named(u=u, v=v))
        # the limit of scale 1 at that v
        assert response == pytest.approx(17 + math.sqrt(5 - (v - 2) ** 2) - 4 * v, abs=1e-6)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: KorenExample(scale=0.0), "scale must be > 0; got 0.0"),
        (lambda: EXAMPLE.u_on_locus(4.1), "v must be in .0, 4., where the locus is; got 4.1"),
        (lambda: EXAMPLE.loop_slope(0.3), "x must be >= 0.5, where the constraint is active; got 0.3"),
        (lambda: EXAMPLE.retrieval_multiplier(float("nan")), "must be finite"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError, match=words):
        call()
