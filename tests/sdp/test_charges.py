"""Charges for each side: expectations against quadrature, sums and samples; messages."""

import itertools
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from sdpgrind import sdp
from sdpgrind.base import stored

SIDES = [
    sdp.Constant(5.0),
    sdp.Constant(5.0, tolerance=0.2),
    sdp.Linear(2.0),
    sdp.Linear(2.0, tolerance=0.2),
    sdp.Quadratic(3.0),
    sdp.Quadratic(3.0, tolerance=0.2),
]


def test_values_on_either_side():
    charge = sdp.Charge(under=sdp.Quadratic(2.0, tolerance=0.5), over=sdp.Constant(7.0, tolerance=0.1))
    np.testing.assert_allclose(charge([-0.2, -0.1, -0.05, 0.0, 0.5, 1.5]), [7.0, 7.0, 0.0, 0.0, 0.0, 2.0])
    np.testing.assert_allclose(charge.slope([-0.2, 0.0, 0.5, 1.5]), [0.0, 0.0, 0.0, 4.0])
    assert float(sdp.Charge(under=sdp.Constant(1.0))(0.0)) == 0.0
    assert float(sdp.Charge()(3.0)) == 0.0
    assert float(sdp.Charge(over=sdp.Linear(10.0)).slope(-1.0)) == -10.0


def test_quadratic_is_taguchi():
    # (2.6), (2.7): A0 at D0; E k (x - target)^2 = k [s^2 + (m - target)^2] over both sides.
    k = 8.0 / 2.0**2
    charge = sdp.Charge(under=sdp.Quadratic(k), over=sdp.Quadratic(k))
    assert float(charge(2.0)) == pytest.approx(8.0)
    law = sdp.Normal(0.7, 0.4)
    assert float(charge.expected(law, 1.0)) == pytest.approx(k * (0.4**2 + 0.3**2), rel=1e-13)
    assert float(charge.expected(law, 0.7)) == pytest.approx(k * 0.4**2, rel=1e-13)


def test_constant_is_the_probability_of_being_out():
    charge = sdp.Charge(under=sdp.Constant(4.0, tolerance=0.3), over=sdp.Constant(4.0, tolerance=0.3))
    law = sdp.Normal(0.7, 0.4)
    out = stats.norm(0.3, 0.4).cdf(-0.3) + stats.norm(0.3, 0.4).sf(0.3)
    assert float(charge.expected(law, 1.0)) == pytest.approx(4.0 * out, rel=1e-13)


@pytest.mark.parametrize("side", SIDES, ids=str)
def test_expectations_against_quadrature(side):
    mean, sd = 1.0, 0.3
    q = sd / sqrt(2 - np.pi / 2)
    density = stats.rayleigh(mean - q * sqrt(np.pi / 2), q).pdf
    law = sdp.Rayleigh(mean, sd)
    start, end = (float(edge) for edge in law.support)
    for x in (0.7, 1.0, 1.6):
        cuts = sorted({start, end, *(p for p in (x, x + 0.2, x - 0.2) if start < p < end)})

        def expect(f, cuts=cuts):
            return sum(
                integrate.quad(lambda d: f(d) * density(d), a, b, epsabs=1e-14, epsrel=1e-12)[0]
                for a, b in itertools.pairwise(cuts)
            )

        over = expect(lambda d, x=x: float(side(max(d - x, 0.0))))
        under = expect(lambda d, x=x: float(side(max(x - d, 0.0))))
        assert float(side.expected_over(law, x)) == pytest.approx(over, rel=1e-9, abs=1e-12)
        assert float(side.expected_under(law, x)) == pytest.approx(under, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("side", SIDES, ids=str)
def test_expectations_at_atoms(side):
    # Atoms on the target and on the edge of the tolerance: free on the first, charged on the second.
    values, weights = np.array([0.75, 1.0, 1.25, 2.0]), np.array([0.1, 0.2, 0.3, 0.4])
    side = side.replace(tolerance=0.25 if side.tolerance else 0.0)
    law = sdp.Discrete(values, weights)
    x = np.array([1.0, 1.25, 2.0, 0.5])
    gap = values - x[:, None]
    np.testing.assert_allclose(side.expected_over(law, x), side(np.maximum(gap, 0)) @ weights, atol=1e-15)
    np.testing.assert_allclose(side.expected_under(law, x), side(np.maximum(-gap, 0)) @ weights, atol=1e-15)


@settings(max_examples=50, deadline=None)
@given(x=st.floats(-1, 3), mean=st.floats(0.05, 2), ratio=st.floats(0, 0.5), rate=st.floats(0, 10))
def test_expectation_is_at_least_that_of_the_mean(x, mean, ratio, rate):
    # Jensen: both sides convex.
    charge = sdp.Charge(under=sdp.Linear(rate), over=sdp.Quadratic(rate, tolerance=0.1))
    law = sdp.LogNormal(mean, ratio * mean)
    assert charge.expected(law, x) >= charge(x - law.mean) - 1e-9 * (1 + rate)


@pytest.mark.parametrize("side", SIDES, ids=str)
def test_slope_is_the_derivative(side):
    z = np.array([0.05, 0.15, 0.25, 0.7])
    difference = (side(z + 1e-6) - side(z - 1e-6)) / 2e-6
    np.testing.assert_allclose(side.slope(z), difference, atol=1e-8)


def test_zero_and_convex():
    assert sdp.Linear(0.0).zero
    assert sdp.Quadratic(0.0).zero
    assert sdp.Constant(0.0).zero
    assert not sdp.Linear(1.0).zero
    assert sdp.Linear(1.0, tolerance=1.0).convex
    assert not sdp.Constant(1.0).convex


def test_a_function_for_the_under_side():
    charge = sdp.Charge(under=lambda z: 1 - np.exp(-z), over=sdp.Linear(10.0))
    charge.check(2.0)
    law = sdp.Normal(0.3, 0.1)
    norm = stats.norm(0.3, 0.1)
    exact = norm.expect(lambda d: 1 - np.exp(-(1 - d)), ub=1.0) + 10 * norm.expect(lambda d: d - 1, lb=1.0)
    assert float(charge.expected(law, 1.0)) == pytest.approx(exact, abs=3e-7)  # h^2/8 with h = 1.55/2000
    assert float(charge.slope(0.5)) == pytest.approx(np.exp(-0.5), rel=1e-8)
    assert float(charge.expected(law, -5.0)) == pytest.approx(10 * 5.3, rel=1e-12)


def test_saved_and_restored():
    charge = sdp.Charge(under=sdp.Quadratic(2.0, 0.1), over=sdp.Constant(3.0))
    assert stored.decode(stored.encode(charge)) == charge
    assert charge.replace(over=sdp.Linear(1.0)).over == sdp.Linear(1.0)


MESSAGES = [
    (lambda: sdp.Linear(-1.0), ValueError, r"rate must be >= 0 \(\$ per unit of distance\); got -1.0"),
    (
        lambda: sdp.Quadratic(np.nan),
        ValueError,
        r"factor must be finite \(\$ per squared unit of distance\); got nan",
    ),
    (
        lambda: sdp.Constant(1.0, tolerance=-0.1),
        ValueError,
        r"tolerance must be >= 0 \(unit of distance\); got -0.1",
    ),
    (lambda: sdp.Constant("much"), TypeError, r"amount must be a number \(\$\); got 'much'"),
    (
        lambda: sdp.Charge(under=2.0),
        TypeError,
        "under must be a one-sided charge, a function or None; got 2.0",
    ),
    (lambda: sdp.Charge(over=np.sqrt), TypeError, "over must be Constant, Linear, Quadratic or None; got"),
    (
        lambda: sdp.Charge(under=lambda z: z + 1).check(2.0),
        ValueError,
        r"under must be 0 at the target \(\$\); got 1 at distance 0",
    ),
    (lambda: sdp.Charge(under=lambda z: -z).check(2.0), ValueError, r"under must be >= 0 \(\$\); got -0.002"),
    (
        lambda: sdp.Charge(under=lambda z: z * (1.5 - z)).check(1.0),
        ValueError,
        r"under must be non-decreasing away from the target \(\$\); got 0.5624\d* at distance 0.751",
    ),
    (lambda: sdp.Charge(under=lambda z: z / 0.0 * 0).check(2.0), ValueError, "under must be finite"),
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("action", "error", "message"), MESSAGES)
def test_messages(action, error, message):
    with pytest.raises(error, match=message):
        action()
