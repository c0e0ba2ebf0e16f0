"""Signal-to-noise ratios: large where the response is good."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


class Ratio(NamedTuple):
    """Kind of ratio: function of readings (..., n), factor of the reference in dB, inverse or None."""

    of: Callable[[Floats], Floats]
    referred: int
    back: Callable[[Floats], Floats] | None
    unit: str


def _size(y: Floats) -> Floats:
    """Power of 2 at or below each size (0.5 for 0): division by it is exact and keeps squares in range."""
    return np.asarray(np.ldexp(1.0, np.frexp(np.abs(y))[1] - 1))


def _over_largest(y: Floats) -> Floats:
    return np.asarray(y / _size(np.max(np.abs(y), axis=-1, keepdims=True)))


def _smaller(y: Floats) -> Floats:
    size = _size(np.max(y, axis=-1))
    return np.asarray(-10 * np.log10(np.mean((y / size[..., None]) ** 2, axis=-1)) - 20 * np.log10(size))


def _larger(y: Floats) -> Floats:
    size = _size(np.min(y, axis=-1))
    return np.asarray(-10 * np.log10(np.mean((size[..., None] / y) ** 2, axis=-1)) + 20 * np.log10(size))


def _nominal(y: Floats) -> Floats:
    y = _over_largest(y)
    return np.asarray(10 * np.log10(np.mean(y, axis=-1) ** 2 / np.var(y, axis=-1, ddof=1)))


def _nominal_taguchi(y: Floats) -> Floats:
    """Ratio with the mean squared less the variance of the mean."""
    y = _over_largest(y)
    n, square, variance = y.shape[-1], np.mean(y, axis=-1) ** 2, np.var(y, axis=-1, ddof=1)
    return np.asarray(10 * np.log10((n * square - variance) / (n * variance)))


def _itself(y: Floats) -> Floats:
    return np.asarray(np.mean(_over_largest(y), axis=-1) * _size(np.max(np.abs(y), axis=-1)))


# by name; "none" is the mean reading
RATIOS = {
    "smaller": Ratio(_smaller, 1, lambda eta: np.asarray(10.0 ** (-np.asarray(eta) / 20)), "dB"),
    "larger": Ratio(_larger, -1, lambda eta: np.asarray(10.0 ** (np.asarray(eta) / 20)), "dB"),
    "nominal": Ratio(_nominal, 0, None, "dB"),
    "nominal_taguchi": Ratio(_nominal_taguchi, 0, None, "dB"),
    "none": Ratio(_itself, 0, lambda mean: np.asarray(mean), ""),
}
REFERRED = ("smaller", "larger")  # ratios that depend on the reference


def sn_ratio(response: npt.ArrayLike, ratio: str = "smaller", *, reference: float = 1.0) -> Floats:
    """Return the signal-to-noise ratio of readings.

    For n readings y with mean m and variance s^2 (divisor n - 1):

    ================== =============================== =====================================================
    `ratio`            eta, dB                         refuses
    ================== =============================== =====================================================
    "smaller"          -10 log10 mean((y/ref)^2)       negative readings, a run of zeros only
    "larger"           -10 log10 mean((ref/y)^2)       readings <= 0
    "nominal"          10 log10(m^2/s^2)               one reading, s = 0, m = 0
    "nominal_taguchi"  10 log10((n m^2 - s^2)/(n s^2)) one reading, s = 0, n m^2 <= s^2
    "none"             m itself, in its own unit
    ================== =============================== =====================================================

    Wang and Jan (2001), section 6, print eta = -20 log10(R_a) of R_a in µm, -13.98 dB for 5 µm; their Table 2
    has 6.021 dB, and all its ratios refer to 10 µm. Sums of squares do not depend on the reference.

    Parameters
    ----------
    response : array_like, shape (..., n)
        Readings, replicates on the last axis, in any unit.
    ratio : str
        Kind of ratio, from the table.
    reference : float
        Response of 0 dB with "smaller" and "larger", > 0, in the unit of the response.

    Returns
    -------
    array, shape (...)
        Ratio, dB; with "none" in the unit of the response.

    Raises
    ------
    ValueError
        Readings are refused by the ratio, see the table.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> float(fin.study.sn_ratio([5e-3], reference=1e-2).round(3))
    6.021
    """
    kind = RATIOS[checks.one_of("ratio", ratio, RATIOS)]
    readings = checks.finite_array("response", response)
    if readings.ndim == 0:
        raise ValueError("response must have an axis of replicates; got a single number")
    if readings.shape[-1] == 0:
        raise ValueError(f"response must have a reading or more in each run; got the shape {readings.shape}")
    zero = checks.positive("reference", reference)
    _check(ratio, readings)
    return np.asarray(kind.of(readings) + kind.referred * 20 * np.log10(zero))


def back(ratio: str, mean: float, reference: float) -> float | None:
    """Response of a ratio (dB), in the unit of the reference; None: the ratio has no inverse."""
    way = RATIOS[ratio].back
    return None if way is None else float((reference if ratio in REFERRED else 1.0) * way(np.asarray(mean)))


def _check(ratio: str, y: Floats) -> None:
    if ratio == "smaller":
        _refuse(
            np.any(y < 0, axis=-1),
            y,
            "response must be >= 0 where smaller is better (of signed errors give the size)",
        )
        _refuse(
            np.all(y == 0, axis=-1), y, "response must not be all zeros in a run: its ratio would be infinite"
        )
    if ratio == "larger":
        _refuse(np.any(y <= 0, axis=-1), y, "response must be > 0 where larger is better")
    if ratio.startswith("nominal"):
        _check_nominal(ratio, y)


def _check_nominal(ratio: str, y: Floats) -> None:
    n = y.shape[-1]
    if n < 2:
        raise ValueError(
            "response must have two replicates or more where a nominal value is best;"
            f" got {n}: no scatter to see"
        )
    over = _over_largest(y)
    square, variance = np.mean(over, axis=-1) ** 2, np.var(over, axis=-1, ddof=1)
    tiny = np.finfo(float).eps ** 2 * np.max(over**2, axis=-1)
    _refuse(variance <= tiny, y, "response must scatter in each run (s > 0): its ratio would be infinite")
    low = square <= tiny if ratio == "nominal" else n * square <= variance
    rule = "!= 0" if ratio == "nominal" else "further from 0 than its standard error, n m^2 > s^2"
    _refuse(low, y, f"response must have a mean {rule}")


def _refuse(bad: npt.NDArray[np.bool_] | np.bool_, shown: Floats, rule: str) -> None:
    """Refuse the first run that is bad."""
    if np.any(bad):
        k = int(np.argmax(bad))
        readings = shown.reshape(-1, shown.shape[-1])[k]
        raise ValueError(f"{rule}; got {readings.tolist()} in run {k + 1}")
