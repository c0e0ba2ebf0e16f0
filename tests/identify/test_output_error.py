"""Output error of any model against a solver of another kind; readings over time as they come apart into
parts.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import curve_fit

from sdpgrind import identify
from sdpgrind.base import serial

T = np.linspace(0.0, 5.0, 60)


def decay(t, start, lag):
    return start * np.exp(-t / lag)


def readings(seed=0, noise=0.02):
    return decay(T, 3.0, 1.4) + np.random.default_rng(seed).normal(0.0, noise, T.size)


def fitted(read, **options):
    return identify.output_error(
        lambda v: read - decay(T, *v), [1.0, 1.0], scale=[1.0, 1.0], names=("start", "lag"), **options
    )


def test_value_and_covariance_against_curve_fit():
    read = readings()
    fit = fitted(read, units=("mm", "s"), noise="white")
    value, covariance = curve_fit(decay, T, read, p0=[1.0, 1.0], method="lm", xtol=1e-12, ftol=1e-12)
    np.testing.assert_allclose(fit.value, value, rtol=1e-7)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-4)
    assert fit.freedom == 58 and fit.units == ("mm", "s") and fit.ok


def test_a_value_fitted_inside_costs_a_reading():
    """A mean that the residual takes off: as if it were a third value."""
    read = readings() + 0.5

    def off(values):
        rest = read - decay(T, *values)
        return rest - rest.mean()

    inside = identify.output_error(off, [1.0, 1.0], scale=[1.0, 1.0], nuisance=1, noise="white")
    outside = identify.output_error(
        lambda v: read - decay(T, *v[:2]) - v[2], [1.0, 1.0, 0.0], scale=[1.0, 1.0, 1.0], noise="white"
    )
    np.testing.assert_allclose(inside.value, outside.value[:2], rtol=1e-7)
    np.testing.assert_allclose(inside.covariance, outside.covariance[:2, :2], rtol=1e-5)


def test_units_do_not_matter():
    read = readings()
    plain = fitted(read)
    small = identify.output_error(lambda v: read - decay(T, v[0], 1e-6 * v[1]), [1.0, 1e6], scale=[1.0, 1e6])
    np.testing.assert_allclose(small.value * [1.0, 1e-6], plain.value, rtol=1e-7)
    np.testing.assert_allclose(small.sd * [1.0, 1e-6], plain.sd, rtol=1e-5)


@pytest.mark.parametrize("noise", ["white", "first order"])
def test_given_slopes_are_those_of_differences(noise):
    read = readings()

    def slopes(values):
        start, lag = values
        course = np.exp(-T / lag)
        return -np.stack([course, start * T / lag**2 * course], axis=1)

    plain, given = (fitted(read, noise=noise, jacobian=jacobian) for jacobian in (None, slopes))
    np.testing.assert_allclose(given.value, plain.value, rtol=1e-7)
    np.testing.assert_allclose(given.covariance, plain.covariance, rtol=1e-5)


def test_bounds_hold():
    assert fitted(readings(), low=[0.0, 1.6], high=[10.0, 3.0])["lag"] == pytest.approx(1.6, rel=1e-6)


def test_what_is_not_determined():
    read = readings()
    same = {"residual": lambda v: read - decay(T, v[0] + v[1], 1.4), "start": [1.0, 1.0], "scale": [1.0, 1.0]}
    fit = identify.output_error(**same, throw=False)
    assert fit.status is identify.Status.UNDETERMINED and np.all(np.isinf(fit.sd))
    assert repr(fit).startswith(f"Estimate({fit.names[0]} not determined, {fit.names[1]} not determined; ")
    assert fit._repr_html_().count("not determined") == 2 + fit.message.count("not determined")
    with pytest.raises(ValueError, match="the data do not determine all values"):
        identify.output_error(**same)
    with pytest.raises(ValueError, match="residual must be at least 5 readings for first order noise; got 2"):
        identify.output_error(lambda v: v, [1.0, 1.0], scale=[1.0, 1.0])
    with pytest.raises(ValueError, match="noise must be one of first order, white; got 'pink'"):
        fitted(readings(), noise="pink")
    with pytest.raises(
        ValueError, match=r"time must be of shape \(60,\), one for each residual \(s\); got \(3,\)"
    ):
        fitted(readings(), time=[0.0, 1.0, 2.0])


def alike(rng, correlation, apart):
    """First-order noise of variance 1; `apart`: steps before each reading, inf for the first of a series."""
    carried = correlation**apart
    noise = np.sqrt(1 - carried**2) * rng.standard_normal(apart.shape)
    for k in range(1, apart.size):
        noise[k] += carried[k] * noise[k - 1]
    return noise


def test_the_filter_is_the_root_of_the_inverse_covariance():
    """Sum of squares and determinant against the covariance matrix rho^|t_j - t_k| / (1 - rho^2)."""
    time = np.array([0.0, 1.0, 2.0, 5.0, 6.0, 6.5, 0.0, 1.0])  # a gap, half a step, a second series
    apart, rho = serial.gaps(time, time.size), 0.7
    series = np.repeat([0, 1], [6, 2])
    lags = np.abs(np.subtract.outer(time, time))
    covariance = np.where(np.equal.outer(series, series), rho**lags, 0.0) / (1 - rho**2)
    whitener = np.stack([serial.filtered(row, rho, apart) for row in np.eye(8)], axis=1)
    np.testing.assert_allclose(whitener @ covariance @ whitener.T, np.eye(8), atol=1e-12)


def test_generalised_least_squares_with_the_correlation_found():
    """Value, covariance and noise by the normal equations with the full covariance matrix."""
    rng = np.random.default_rng(3)
    matrix = np.stack([np.ones(80), np.linspace(-1, 1, 80)], axis=1)
    read = matrix @ [1.0, 2.0] + 0.1 * alike(rng, 0.7, serial.gaps(None, 80))
    fit = identify.output_error(lambda v: read - matrix @ v, [0.0, 0.0], scale=[1.0, 1.0])
    rho = fit.noise_correlation
    inverse = np.linalg.inv(rho ** np.abs(np.subtract.outer(np.arange(80), np.arange(80))))
    bread = np.linalg.inv(matrix.T @ inverse @ matrix)
    value = bread @ matrix.T @ inverse @ read
    left = read - matrix @ value
    variance = left @ inverse @ left / 78
    np.testing.assert_allclose(fit.value, value, rtol=1e-6)
    np.testing.assert_allclose(fit.covariance, variance * bread, rtol=1e-5, atol=1e-12)
    assert fit.noise_sd == pytest.approx(np.sqrt(variance), rel=1e-6) and 0.4 < rho < 0.9
    assert fit.freedom == pytest.approx(80 * (1 - rho) / (1 + rho) - 2)


@pytest.mark.parametrize("size", [1, 2, 4])
@pytest.mark.parametrize("true", [0.3, 0.8])
def test_the_correlation_has_no_bias(true, size):
    """Mean of 1000 files of 100 readings about polynomials; 0.8 would be 0.71 with four values uncorrected."""
    rng = np.random.default_rng(size)
    carried = np.sqrt(1 - true**2)
    noise = rng.standard_normal((100, 1000))
    for k in range(1, 100):
        noise[k] = true * noise[k - 1] + carried * noise[k]
    basis = np.linalg.qr(np.vander(np.linspace(-1, 1, 100), size))[0]
    left = noise - basis @ (basis.T @ noise)
    apart = serial.gaps(None, 100)
    found = [serial.correlation(column, size, apart) for column in left.T]
    assert np.mean(found) == pytest.approx(true, abs=0.02)


@pytest.mark.parametrize(
    ("correlation", "noise", "least"),
    [(0.0, "first order", 0.9), (0.8, "first order", 0.9), (0.8, "white", 0.3)],
)
def test_intervals_hold(correlation, noise, least):
    """Coverage of 100 files of 110 readings: 95 % within two standard deviations; as if white half of it."""
    rng, apart = np.random.default_rng(5), serial.gaps(None, 110)
    matrix, hit = np.stack([np.ones(110), np.linspace(-1, 1, 110) ** 2], axis=1), 0
    for _ in range(100):
        read = matrix @ [1.0, 2.0] + alike(rng, correlation, apart)
        fit = identify.output_error(lambda v, read=read: read - matrix @ v, [0, 0], scale=[1, 1], noise=noise)
        low, high = fit.interval()[1]
        hit += low <= 2.0 <= high
    assert least <= hit / 100 <= least + 0.1 * (1 + 2 * (noise == "white"))


def test_a_drift_keeps_the_plain_values():
    """Residuals that no noise explains: values as of white noise, a far wider interval."""
    read = decay(T, 3.0, 1.4) + 0.1 * np.sin(T)
    plain, wide = fitted(read, noise="white"), fitted(read)
    np.testing.assert_allclose(wide.value, plain.value, rtol=1e-9)
    assert wide.noise_correlation == serial.MOST and wide.freedom == 1.0
    assert np.all(np.ptp(wide.interval(), axis=1) > 5 * np.ptp(plain.interval(), axis=1))


UNITS = {"rate": "mm/s", "size": "mm"}
NAN = float("nan")


def table(**more):
    rows = {"rate_command": [1.0, NAN, 2.0, NAN], "size": [0.0, NAN, 0.0, np.inf]}
    data = {name: ("row", np.array(values)) for name, values in rows.items()}
    coords = {"part": ("row", [4, 4, 5, 5]), "time": ("row", [0.0, 1.0, 0.0, 1.0])}
    return xr.Dataset(data, coords | {name: ("row", values) for name, values in more.items()})


def test_parts_of_a_log():
    first, second = identify.series({"loop": table()}, UNITS, tier="loop", commands=("rate",))
    assert (first.label, second.label) == ("part 4", "part 5")
    # the last command holds
    assert first["rate"].tolist() == [1.0, 1.0] and second["rate"].tolist() == [2.0, 2.0]
    np.testing.assert_array_equal(first["size"], [0.0, NAN])  # a missing reading keeps its place
    np.testing.assert_array_equal(second["size"], [0.0, NAN])
    (only,) = identify.series({"loop": table()}, UNITS, tier="loop", commands=("rate",), part=5)
    assert only.label == "part 5" and only.time.tolist() == [0.0, 1.0]


def test_parts_of_several_controllers():
    log = {"loop": table(controller=["a", "a", "b", "b"], part=[0, 0, 0, 0])}
    each = identify.series(log, UNITS, tier="loop", commands=("rate",))
    assert [one.label for one in each] == ["part 0 of a", "part 0 of b"]


def test_arrays_by_name():
    data = {"time": [0.0, 1.0, 2.0], "rate": [NAN, 1.0, NAN]}
    (one,) = identify.series(data, UNITS, tier="loop", commands=("rate",), optional=("size",))
    assert one.label == "" and "size" not in one and one["rate"].tolist() == [0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("data", "options", "message"),
    [
        ({"time": [0.0], "rate": [1.0]}, {}, r"data must hold size \(mm\); it holds time, rate"),
        (
            {"time": [0.0], "rate": [1.0], "size": [1.0, 2.0]},
            {},
            "size must have as many entries as time, 1; got 2",
        ),
        (
            {"time": [0.0, NAN], "rate": [1.0, 1.0], "size": [1.0, 2.0]},
            {},
            r"time\[1\] must be finite \(s\); got nan",
        ),
        (
            {"time": [0.0, 0.0], "rate": [1.0, 1.0], "size": [1.0, 2.0]},
            {},
            r"time must be rising \(s\); got 0 and then 0",
        ),
        (
            {"loop": table(time=[1.0, 0.0, 0.0, 1.0])},
            {},
            r"time must be rising in part 4 \(s\); got 1 and then 0",
        ),
        ({"loop": table()}, {"part": [4, 6]}, "part must be one of 4, 5; got 6"),
    ],
)
def test_messages(data, options, message):
    with pytest.raises(ValueError, match=message):
        identify.series(data, UNITS, tier="loop", commands=("rate",), **options)
