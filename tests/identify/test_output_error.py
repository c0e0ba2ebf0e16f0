"""Output error of any model against a solver of another kind; readings over time as they come apart into
parts.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import curve_fit

from sdpgrind import identify

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
    fit = fitted(read, units=("mm", "s"))
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

    inside = identify.output_error(off, [1.0, 1.0], scale=[1.0, 1.0], nuisance=1)
    outside = identify.output_error(
        lambda v: read - decay(T, *v[:2]) - v[2], [1.0, 1.0, 0.0], scale=[1.0, 1.0, 1.0]
    )
    np.testing.assert_allclose(inside.value, outside.value[:2], rtol=1e-7)
    np.testing.assert_allclose(inside.covariance, outside.covariance[:2, :2], rtol=1e-5)


def test_units_do_not_matter():
    read = readings()
    plain = fitted(read)
    small = identify.output_error(lambda v: read - decay(T, v[0], 1e-6 * v[1]), [1.0, 1e6], scale=[1.0, 1e6])
    np.testing.assert_allclose(small.value * [1.0, 1e-6], plain.value, rtol=1e-7)
    np.testing.assert_allclose(small.sd * [1.0, 1e-6], plain.sd, rtol=1e-5)


def test_bounds_hold():
    assert fitted(readings(), low=[0.0, 1.6], high=[10.0, 3.0])["lag"] == pytest.approx(1.6, rel=1e-6)


def test_what_is_not_determined():
    read = readings()
    same = {"residual": lambda v: read - decay(T, v[0] + v[1], 1.4), "start": [1.0, 1.0], "scale": [1.0, 1.0]}
    fit = identify.output_error(**same, throw=False)
    assert fit.status is identify.Status.UNDETERMINED and np.all(np.isinf(fit.sd))
    with pytest.raises(ValueError, match="the data do not determine all values"):
        identify.output_error(**same)
    with pytest.raises(ValueError, match="residual must be at least 3 readings; got 2"):
        identify.output_error(lambda v: v, [1.0, 1.0], scale=[1.0, 1.0])


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
