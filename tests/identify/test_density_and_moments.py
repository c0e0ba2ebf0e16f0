"""Densities from samples, propagation of moments: the specification's numbers, and samples of a known law."""

from math import exp, log, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate
from scipy.interpolate import CubicSpline, PchipInterpolator

from sdpgrind import identify

AXIS = np.linspace(0, 6, 1201)
RAYLEIGH = AXIS * np.exp(-(AXIS**2) / 2)


def squared_error(pdf):
    return np.trapezoid((pdf - RAYLEIGH) ** 2, AXIS)


def through_all(sample, curve):
    """The derivative of a curve through every point of the cumulative plot (Brown 1988, section 8.3)."""
    ordered = np.r_[0, np.sort(sample)]
    slope = curve(ordered, np.arange(ordered.size) / (ordered.size - 1))(np.minimum(AXIS, ordered[-1]), 1)
    return np.where(ordered[-1] >= AXIS, slope, 0.0)


def test_which_density_is_best():
    # 50 Rayleigh data, median integrated squared error: kernel 0.010, reflected 0.016, log-kernel 0.020,
    # monotone curve
    # through all points 0.93, cubic spline 17 and negative on a part of the axis, 8 quantile bins 0.061; leak
    # 2.4 %.
    rng = np.random.default_rng(0)
    errors, leaks, negative = {}, [], []
    for _ in range(200):
        sample = rng.rayleigh(size=50)
        densities = {
            name: identify.kernel_density(sample, method=name) for name in ("truncated", "reflected", "log")
        }
        densities["quantile"] = identify.quantile_density(sample)
        curves = {name: density.pdf(AXIS) for name, density in densities.items()}
        curves["all"] = through_all(sample, PchipInterpolator)
        curves["spline"] = through_all(sample, CubicSpline)
        for name, curve in curves.items():
            errors.setdefault(name, []).append(squared_error(curve))
        leaks.append(densities["truncated"].leak)
        negative.append(np.mean(curves["spline"] < 0))
    median = {name: np.median(values) for name, values in errors.items()}
    assert median["truncated"] == pytest.approx(0.010, abs=0.002)
    assert median["reflected"] == pytest.approx(0.016, abs=0.002)
    assert median["log"] == pytest.approx(0.020, abs=0.003)
    assert median["quantile"] == pytest.approx(0.061, abs=0.012)
    assert median["all"] > 0.5
    assert median["spline"] > 10
    assert np.median(negative) > 0.1
    assert np.mean(leaks) == pytest.approx(0.024, abs=0.002)


@pytest.mark.parametrize("method", ["truncated", "reflected", "log"])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(2, 30))
def test_kernel_density_is_a_density_on_amounts(method, seed, n):
    sample = np.random.default_rng(seed).rayleigh(size=n)
    density = identify.kernel_density(sample, method=method)
    assert float(density.pdf(-0.01)) == 0.0
    assert float(density.cdf(-0.01)) == 0.0
    assert density.cdf(sample.max() * 50 + 50) == pytest.approx(1.0, abs=1e-6 if method != "log" else 0.02)
    a, b = 0.2, 1.7
    mass = integrate.quad(
        lambda d: float(density.pdf(d)), a, b, points=np.sort(sample)[:5], epsabs=1e-8, limit=500
    )[0]
    assert mass == pytest.approx(float(density.cdf(b) - density.cdf(a)), abs=1e-6)


@pytest.mark.parametrize("method", ["truncated", "reflected", "log"])
def test_kernel_density_draws_from_itself(method):
    sample = np.random.default_rng(3).rayleigh(size=40)
    density = identify.kernel_density(sample, method=method, bandwidth=0.4)
    drawn = density.sample(1, 50_000)
    assert drawn.min() >= 0
    for d in (0.1, 0.5, 1.0, 2.0):
        assert np.mean(drawn <= d) == pytest.approx(float(density.cdf(d)), abs=4.5 * 0.5 / sqrt(50_000))


def test_bandwidth():
    sample = np.random.default_rng(3).rayleigh(size=40)
    default = identify.kernel_density(sample)
    assert default.bandwidth == pytest.approx(sample.std(ddof=1) * 30**-0.2)
    assert identify.kernel_density(sample, bandwidth=0.1).bandwidth == 0.1


def test_standardised_sample_of_an_outcome_law():
    sample = np.random.default_rng(3).rayleigh(size=40)
    unit, width = identify.kernel_density(sample, bandwidth=0.2).standardised()
    assert np.mean(unit) == pytest.approx(0.0, abs=1e-14)
    assert np.std(unit) == pytest.approx(1.0)
    assert width == pytest.approx(0.2 / sample.std())
    log_width = identify.kernel_density(sample, bandwidth=0.2, method="log").standardised()[1]
    assert log_width == pytest.approx(0.2 * sample.mean() / sample.std())


def test_quantile_density():
    sample = np.random.default_rng(3).rayleigh(size=200)
    density = identify.quantile_density(sample, bins=5)
    np.testing.assert_allclose(density.cdf(np.quantile(sample, [0.2, 0.6])), [0.2, 0.6])
    assert float(density.cdf(0.0)) == 0.0
    assert float(density.cdf(99.0)) == 1.0
    np.testing.assert_array_equal(density.pdf([-0.1, 99.0]), 0.0)
    assert np.trapezoid(density.pdf(AXIS), AXIS) == pytest.approx(1.0, abs=2e-3)
    assert np.all(density.pdf(AXIS) >= 0)


def correlated(x, y, r, n=1_000_000):
    z = np.random.default_rng(2).standard_normal((2, n))
    return x[0] + x[1] * z[0], y[0] + y[1] * (r * z[0] + sqrt(1 - r * r) * z[1])


@pytest.mark.parametrize("r", [-0.8, 0.0, 0.5])
def test_moments_against_jointly_normal_samples(r):
    x, y = (3.0, 0.3), (2.0, 0.3)
    a, b = correlated(x, y, r)
    for function, drawn in [
        (identify.sum_moments, a + b),
        (identify.difference_moments, a - b),
        (identify.product_moments, a * b),
    ]:
        mean, sd = function(x, y, correlation=r)
        assert mean == pytest.approx(drawn.mean(), abs=4.5 * drawn.std() / 1e3)
        assert sd == pytest.approx(drawn.std(), rel=4.5 / sqrt(2e6))


def test_numbers_of_table_2_1():
    x, y = (3.0, 0.3), (2.0, 0.3)
    for r, true in [(-0.8, 0.319), (0.8, 2.047)]:
        assert identify.product_moments(x, y, correlation=r).sd ** 2 == pytest.approx(true, abs=5e-4)
        assert identify.product_moments(x, y, correlation=r, method="printed").sd ** 2 == pytest.approx(
            1.932, abs=5e-4
        )
    # 1/Y, c = 0.2: relative variance 0.0400 to first order, 0.0385 as printed; 0.0433 for a log-normal Y.
    assert identify.ratio_moments((1.0, 0.0), (1.0, 0.2)).sd ** 2 == pytest.approx(0.0400, abs=5e-5)
    assert identify.ratio_moments((1.0, 0.0), (1.0, 0.2), method="printed").sd ** 2 == pytest.approx(
        0.0385, abs=5e-5
    )
    s2 = log(1 + 0.2**2)
    mean = exp(s2 / 2) * exp(s2 / 2)  # E 1/Y of a log-normal Y with mean 1: here the second order is exact
    assert identify.ratio_moments((1.0, 0.0), (1.0, 0.2)).mean == pytest.approx(mean)
    assert mean**2 * (exp(s2) - 1) == pytest.approx(0.0433, abs=5e-5)


def test_printed_columns_disagree():
    x, y = (3.0, 0.3), (2.0, 0.3)
    independent = identify.ratio_moments(x, y, method="printed").sd
    nearly = identify.ratio_moments(x, y, correlation=1e-12, method="printed").sd
    assert nearly == pytest.approx(identify.ratio_moments(x, y).sd)
    assert independent < nearly * 0.995
    assert identify.ratio_moments(x, y, method="printed").mean == 1.5


@given(
    mx=st.floats(-5, 5), my=st.floats(1, 5), cx=st.floats(0, 0.3), cy=st.floats(0, 0.05), r=st.floats(-1, 1)
)
def test_ratio_is_the_delta_method(mx, my, cx, cy, r):
    sx, sy = cx, cy * my
    covariance = [[sx**2, r * sx * sy], [r * sx * sy, sy**2]]
    delta = identify.delta_method(lambda q: q[0] / q[1], [mx, my], covariance)
    mean, sd = identify.ratio_moments((mx, sx), (my, sy), correlation=r)
    assert delta.mean == pytest.approx(mean, rel=1e-5, abs=1e-6)
    assert delta.sd == pytest.approx(sd, rel=1e-4, abs=1e-5)


def test_delta_method_is_exact_for_a_square():
    # q^2 of a normal q: mean m^2 + s^2; first-order variance 4 m^2 s^2.
    moments = identify.delta_method(lambda q: q[0] ** 2, [3.0], [0.5])
    assert moments.mean == pytest.approx(9.25, rel=1e-9)
    assert moments.sd == pytest.approx(3.0, rel=1e-9)
    assert identify.delta_method(lambda q: q[0] ** 2, [3.0], [0.5], order=1).mean == 9.0
    assert identify.delta_method(lambda q: q[0] * q[1], [3.0, 2.0], [0.3, 0.0]).sd == pytest.approx(0.6)


def test_sample_moments_divide_by_one_less():
    sample = np.random.default_rng(0).standard_normal((20_000, 5))
    corrected = np.mean([identify.sample_moments(row).sd ** 2 for row in sample])
    printed = np.mean([identify.sample_moments(row, method="printed").sd ** 2 for row in sample])
    assert corrected == pytest.approx(1.0, abs=4 * sqrt(2 / 4 / 20_000))
    assert printed == pytest.approx(0.8, abs=4 * sqrt(2 / 4 / 20_000))


MESSAGES = [
    (lambda: identify.kernel_density([]), r"sample must be at least two different values; got \[\]"),
    (
        lambda: identify.kernel_density([0.5, -0.1, 0.2, -0.3]),
        "sample must be >= 0; got 2 of 4 values that are not, the least -0.3",
    ),
    (
        lambda: identify.kernel_density([0.5, 0.0], method="log"),
        "sample must be > 0; got 1 of 2 values that are not",
    ),
    (lambda: identify.kernel_density([0.5, np.nan]), r"sample\[1\] must be finite; got nan"),
    (lambda: identify.kernel_density([0.5, 0.6], bandwidth=0.0), "bandwidth must be > 0; got 0.0"),
    (
        lambda: identify.kernel_density([0.5, 0.6], method="spline"),
        "method must be one of truncated, reflected, log",
    ),
    (
        lambda: identify.quantile_density([0.5, 0.5, 0.5, 0.9], bins=4),
        "bins must be so few that no two quantiles",
    ),
    (lambda: identify.sum_moments((1, -1), (1, 1)), "x sd must be >= 0; got -1.0"),
    (
        lambda: identify.product_moments((1, 1), (1, 1), correlation=1.1),
        r"correlation must be in \[-1, 1\] \(1\)",
    ),
    (
        lambda: identify.ratio_moments((1, 1), (1.0, 0.5)),
        r"y must have abs\(mean\) > 2 sd for a ratio; got mean 1.0 and sd 0.5",
    ),
    (lambda: identify.sample_moments([1.0]), r"sample must be at least two numbers; got \[1.0\]"),
    (
        lambda: identify.delta_method(sum, [1.0, 2.0], [1.0]),
        r"covariance must fit 2 quantities; got shape \(1, 1\)",
    ),
    (
        lambda: identify.delta_method(sum, [1.0, 2.0], [[1.0, 2.0], [2.0, 1.0]]),
        "covariance must be without negative eigenvalues; got -1.0",
    ),
    (
        lambda: identify.delta_method(sum, [1.0, 2.0], [[1.0, 2.0], [0.0, 1.0]]),
        "covariance must be a symmetric matrix or a list of standard deviations",
    ),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
