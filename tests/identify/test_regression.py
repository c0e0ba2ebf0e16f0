"""Regression: against lstsq, against the objective it claims to minimise, and for honest covariances."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sdpgrind import identify
from sdpgrind.base import stored


def line_data(n=40, seed=0, noise=0.5):
    rng = np.random.default_rng(seed)
    x = rng.uniform(0, 10, n)
    return np.column_stack([np.ones(n), x]), 3.0 + 2.0 * x + noise * rng.standard_normal(n)


def test_value_and_covariance_against_scipy():
    matrix, y = line_data()
    fit = identify.least_squares(matrix, y, names=("start", "slope"), units=("mm", "mm/s"))
    twin = stats.linregress(matrix[:, 1], y)
    assert fit["slope"] == pytest.approx(twin.slope, rel=1e-12)
    assert fit["start"] == pytest.approx(twin.intercept, rel=1e-12)
    np.testing.assert_allclose(fit.sd, [twin.intercept_stderr, twin.stderr], rtol=1e-10)
    assert fit.freedom == 38
    low, high = fit.interval(0.9)[1]
    reach = stats.t(38).ppf(0.95) * twin.stderr
    assert (low, high) == (pytest.approx(twin.slope - reach), pytest.approx(twin.slope + reach))


def test_interval_of_known_noise_is_normal():
    fit = identify.Estimate(("a",), [1.0], [[4.0]])
    np.testing.assert_allclose(fit.interval(0.99), [[1 - 2 * 2.5758293, 1 + 2 * 2.5758293]], rtol=1e-7)


def test_weights_are_repetitions():
    matrix, y = line_data(6)
    weights = np.array([1, 3, 2, 1, 1, 4])
    fit = identify.least_squares(matrix, y, weights=weights, noise_sd=0.5)
    twin = identify.least_squares(np.repeat(matrix, weights, axis=0), np.repeat(y, weights), noise_sd=0.5)
    np.testing.assert_allclose(fit.value, twin.value, rtol=1e-12)
    np.testing.assert_allclose(fit.covariance, twin.covariance, rtol=1e-10)


@settings(max_examples=30)
@given(seed=st.integers(0, 1000), nudge=st.floats(-0.1, 0.1), which=st.integers(0, 1))
def test_no_neighbour_fits_better(seed, nudge, which):
    matrix, y = line_data(12, seed)
    value = identify.least_squares(matrix, y).value
    other = value + np.eye(2)[which] * nudge
    assert np.sum((y - matrix @ value) ** 2) <= np.sum((y - matrix @ other) ** 2) + 1e-9


def test_units_of_the_columns_do_not_matter():
    matrix, y = line_data()
    scale = np.array([1e-9, 1e9])
    fit, scaled = identify.least_squares(matrix, y), identify.least_squares(matrix * scale, y)
    np.testing.assert_allclose(scaled.value * scale, fit.value, rtol=1e-12)
    np.testing.assert_allclose(scaled.correlation, fit.correlation, rtol=1e-10)


def test_undetermined_values_are_said_to_be():
    matrix = np.column_stack([np.ones(5), np.full(5, 3.0)])
    with pytest.raises(ValueError, match="the data do not determine all values: take points at more"):
        identify.least_squares(matrix, np.arange(5.0))
    fit = identify.least_squares(matrix, np.arange(5.0), throw=False)
    assert not fit.ok
    assert fit.status is identify.Status.UNDETERMINED
    assert np.all(np.isfinite(fit.value))
    assert np.all(np.isinf(fit.sd))
    np.testing.assert_array_equal(fit.correlation, np.eye(2))


def test_total_least_squares_minimises_what_it_says():
    matrix, y = line_data(30, noise=3.0)
    x, ratio = matrix[:, 1], 0.7
    fit = identify.total_least_squares(x, y, noise_ratio=ratio)

    def objective(value):
        return np.sum((y - value[0] - value[1] * x) ** 2) / (ratio**2 + value[1] ** 2)

    best = objective(fit.value)
    for step in (1e-4, 1e-2, 0.3):
        for direction in np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1]]):
            assert objective(fit.value + step * direction) > best


def test_limits_of_the_noise_ratio():
    matrix, y = line_data(30, noise=3.0)
    x = matrix[:, 1]
    all_on_y = identify.total_least_squares(x, y, noise_ratio=1e5)
    np.testing.assert_allclose(all_on_y.value, identify.least_squares(matrix, y).value, rtol=1e-6)
    np.testing.assert_allclose(all_on_y.sd, identify.least_squares(matrix, y).sd, rtol=1e-6)
    all_on_x = identify.total_least_squares(x, y, noise_ratio=1e-4)
    assert all_on_x["slope"] == pytest.approx(1 / stats.linregress(y, x).slope, rel=1e-6)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_total_least_squares_is_unbiased_and_knows_its_spread(ratio):
    rng, true_x = np.random.default_rng(1), np.linspace(0, 10, 60)
    fits = []
    for _ in range(400):
        x = true_x + 0.8 * rng.standard_normal(60)
        y = 1.0 + 1.5 * true_x + 0.8 * ratio * rng.standard_normal(60)
        fits.append(identify.total_least_squares(x, y, noise_ratio=ratio))
    values = np.array([fit.value for fit in fits])
    spread = values.std(axis=0, ddof=1)
    np.testing.assert_allclose(values.mean(axis=0), [1.0, 1.5], atol=4 * spread.max() / sqrt(400))
    np.testing.assert_allclose(np.mean([fit.sd for fit in fits], axis=0), spread, rtol=0.12)
    np.testing.assert_allclose(
        np.mean([fit.correlation[0, 1] for fit in fits]), np.corrcoef(values.T)[0, 1], atol=0.05
    )


def test_a_round_cloud_has_no_line():
    x, y = np.array([1.0, 0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0, -1.0])
    with pytest.raises(ValueError, match="the data do not determine all values"):
        identify.total_least_squares(x, y, noise_ratio=1.0)
    assert not identify.total_least_squares(x, y, noise_ratio=1.0, throw=False).ok
    assert not identify.total_least_squares(np.ones(4), y, noise_ratio=1.0, throw=False).ok


def fed(matrix, y, forgetting=1.0):
    rls = identify.RecursiveLeastSquares(("start", "slope"), forgetting=forgetting)
    for row, target in zip(matrix, y, strict=True):
        rls.update(row, target)
    return rls


def test_recursive_is_batch():
    matrix, y = line_data()
    recursive, batch = fed(matrix, y).estimate, identify.least_squares(matrix, y)
    np.testing.assert_allclose(recursive.value, batch.value, rtol=1e-11)
    np.testing.assert_allclose(recursive.covariance, batch.covariance, rtol=1e-9)
    assert recursive.freedom == pytest.approx(batch.freedom)


def test_forgetting_is_a_weight():
    matrix, y = line_data()
    weights = 0.9 ** np.arange(39, -1, -1.0)
    np.testing.assert_allclose(
        fed(matrix, y, 0.9).estimate.value,
        identify.least_squares(matrix, y, weights=weights).value,
        rtol=1e-11,
    )


def test_covariance_with_forgetting_is_honest():
    fits = [fed(*line_data(60, seed), forgetting=0.9).estimate for seed in range(400)]
    values = np.array([fit.value for fit in fits])
    # The x of each run differ, so compare each error with its own standard deviation.
    scaled = (values - [3.0, 2.0]) / np.array([fit.sd for fit in fits])
    np.testing.assert_allclose(np.mean(scaled**2, axis=0), 1.0, atol=0.3)
    inside = [np.all((fit.interval(0.9)[1] - 2.0) * [-1, 1] > 0) for fit in fits]
    assert np.mean(inside) == pytest.approx(0.9, abs=0.05)


def test_undetermined_until_it_is_not_and_after_a_reset():
    rls = identify.RecursiveLeastSquares(("start", "slope"))
    assert not rls.estimate.ok
    rls.update([1.0, 2.0], 3.0)
    rls.update([1.0, 2.0], 3.1)
    assert rls.estimate.status is identify.Status.UNDETERMINED
    assert np.all(np.isfinite(rls.estimate.value))
    rls.update([1.0, 4.0], 7.0)
    assert rls.estimate.ok
    assert rls.count == 3
    rls.reset()
    assert rls.count == 0
    assert not rls.estimate.ok


def test_many_rows_leave_a_covariance():
    # Nearly collinear rows and strong forgetting: the plain covariance form turns indefinite here.
    rls = identify.RecursiveLeastSquares(("start", "slope"), forgetting=0.95)
    rng = np.random.default_rng(0)
    for x in 1.0 + 1e-5 * rng.standard_normal(20_000):
        rls.update([1.0, x], 3.0 + 2.0 * x + 1e-6 * rng.standard_normal())
    covariance = rls.estimate.covariance
    assert (
        np.linalg.eigvalsh(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))).min()
        >= -1e-12
    )
    assert rls.estimate["slope"] == pytest.approx(2.0, abs=5 * rls.estimate.sd[1])


def test_estimate_shows_and_stores_itself():
    fit = identify.Estimate(
        ("a", "b"), [1.0, 2.0], [[4.0, 1.0], [1.0, 1.0]], units=("mm", "1"), message="of 5 points"
    )
    assert repr(fit) == "Estimate(a = 1 ± 2 mm, b = 2 ± 1; of 5 points)"
    np.testing.assert_allclose(fit.correlation, [[1.0, 0.5], [0.5, 1.0]])
    twin = stored.decode(stored.encode(fit))
    np.testing.assert_array_equal(twin.covariance, fit.covariance)
    assert (twin.names, twin.status, twin.units) == (fit.names, identify.Status.OK, ("mm", "1"))
    with pytest.raises(ValueError, match="read-only"):
        fit.value[0] = 3.0


MATRIX, TARGET = line_data(5)
MESSAGES = [
    (lambda: identify.least_squares(MATRIX[:2], TARGET[:2]), "target must be at least 3 points; got 2"),
    (lambda: identify.least_squares(MATRIX, TARGET * np.nan), r"target\[0\] must be finite; got nan"),
    (
        lambda: identify.least_squares(MATRIX, TARGET[:3]),
        r"matrix and target must be of shape \(n, p\) and \(n,\)",
    ),
    (lambda: identify.least_squares(MATRIX, TARGET, weights=[1, 1, 0, 1, 1]), "weights must be > 0; got 0.0"),
    (
        lambda: identify.total_least_squares([1, 2], [1, 2], noise_ratio=1.0),
        "x must be at least 3 points; got 2",
    ),
    (
        lambda: identify.total_least_squares([1, 2, 3], [1, 2, 3], noise_ratio=0.0),
        "noise_ratio must be > 0; got 0.0",
    ),
    (
        lambda: identify.total_least_squares([1, 2, 3], [1, 2], noise_ratio=1.0),
        "y must be one-dimensional with 3",
    ),
    (
        lambda: identify.RecursiveLeastSquares(("a",), forgetting=0.0),
        r"forgetting must be in \(0, 1\] \(1\); got 0.0",
    ),
    (
        lambda: identify.RecursiveLeastSquares(("a",)).update([1.0, 2.0], 1.0),
        r"row must be of shape \(1,\); got",
    ),
    (lambda: identify.RecursiveLeastSquares(("a",)).update([1.0], np.inf), "target must be finite; got inf"),
    (
        lambda: identify.Estimate(("a",), [1.0, 2.0], [[1.0]]),
        r"value and covariance must be of shape \(1,\)",
    ),
    (lambda: identify.Estimate(("a",), [1.0], [[1.0]])["b"], "name must be one of a; got 'b'"),
    (
        lambda: identify.Estimate(("a",), [1.0], [[1.0]]).interval(95),
        r"confidence must be in \(0, 1\) \(1\); got 95",
    ),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
