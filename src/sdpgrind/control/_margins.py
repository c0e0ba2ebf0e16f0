"""Performance and robustness of a sampled loop: margins, peaks of sensitivity, bandwidths."""

import dataclasses
from collections.abc import Callable
from math import inf, nan, pi

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base.checks import Complex, Floats
from sdpgrind.control._sampled import Sampled

HALF_POWER = 0.5**0.5  # derived: gain of half the power
_POINTS = 3000  # chosen: fewer frequencies miss narrow peaks, more cost time


@dataclasses.dataclass(frozen=True)
class Margins:
    """Margins of a sampled feedback loop; frequencies in rad/s, gains dimensionless.

    Attributes
    ----------
    gain_margin : float
        Factor by which the loop gain may grow before instability, dimensionless. inf: any factor.
    phase_margin : float
        Additional phase lag before instability, rad.
    sensitivity_peak, complementary_peak : float
        Ms = max abs(S) and Mt = max abs(T), dimensionless.
    bandwidth : float
        f_b by the slope-limited measure: the largest f with abs(S(v)) <= 0.7071 v/f for all v <= f, rad/s.
    sensitivity_bandwidth, tracking_bandwidth : float
        Where abs(S) first rises above and abs(T) first falls below 0.7071, rad/s.
    runout_response : float
        Largest response to disk runout over a given band, force per force, dimensionless. NaN: no band given.
    stable : bool
        Whether all poles of the closed loop are inside the unit circle.
    """

    gain_margin: float
    phase_margin: float
    sensitivity_peak: float
    complementary_peak: float
    bandwidth: float
    sensitivity_bandwidth: float
    tracking_bandwidth: float
    runout_response: float = nan
    stable: bool = True

    @property
    def gain_margin_db(self) -> float:
        """Gain margin in decibels, dimensionless."""
        return float(20 * np.log10(self.gain_margin))

    def __str__(self) -> str:
        hertz, state = 2 * pi, "stable" if self.stable else "UNSTABLE"
        return (
            f"{state}: GM {self.gain_margin_db:.2f} dB, PM {np.degrees(self.phase_margin):.1f} deg, "
            f"Ms {self.sensitivity_peak:.2f}, Mt {self.complementary_peak:.2f}, "
            f"f_b {self.bandwidth / hertz:.2f} Hz, "
            f"-3 dB of T {self.tracking_bandwidth / hertz:.2f} Hz, "
            f"of S {self.sensitivity_bandwidth / hertz:.2f} Hz, "
            f"runout {self.runout_response:.3f}"
        )


def loop_margins(loop: Sampled) -> Margins:
    """Return the margins of a sampled open loop under unit negative feedback.

    Parameters
    ----------
    loop : Sampled
        Law and plant in series with every delay, dimensionless.

    Examples
    --------
    >>> margin = loop_margins(Sampled([[1.0]], [0.5], [1.0], 0.0, 0.1))  # L = 0.5/(z - 1)
    >>> round(margin.gain_margin, 6), margin.stable
    (4.0, True)
    """
    frequency = grid(loop.sample_time)
    values = loop.response(frequency)
    sensitivity, tracking = np.abs(1 / (1 + values)), np.abs(values / (1 + values))
    crossings = _crossings(loop.response, frequency, values)
    return Margins(
        gain_margin=_gain_margin(loop.response, crossings[0], values[-1]),
        phase_margin=_phase_margin(loop.response, crossings[1]),
        sensitivity_peak=float(sensitivity.max()),
        complementary_peak=float(tracking.max()),
        bandwidth=slope_bandwidth(frequency, sensitivity),
        sensitivity_bandwidth=_first(frequency, sensitivity - HALF_POWER),
        tracking_bandwidth=_first(frequency, HALF_POWER - tracking),
        stable=loop.closed().stable,
    )


def grid(sample_time: float, points: int = _POINTS) -> Floats:
    """Angular frequencies up to half the sampling rate, rad/s: logarithmic below, uniform above."""
    top = pi / sample_time
    low = np.geomspace(1e-5 * top, 0.1 * top, points // 2, endpoint=False)
    return np.concatenate([low, np.linspace(0.1 * top, top, points - points // 2)])


def slope_bandwidth(frequency: Floats, sensitivity: Floats) -> float:
    """Return the slope-limited bandwidth: the largest f with abs(S(v)) <= 0.7071 v/f for all v <= f, rad/s.

    Parameters
    ----------
    frequency : array
        Angular frequencies, increasing, rad/s. The last one bounds the result.
    sensitivity : array
        abs(S) there, dimensionless.

    Examples
    --------
    >>> round(slope_bandwidth(np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.5, 1.0])), 4)  # between 2 and 3
    2.4853
    """
    reach = np.minimum.accumulate(HALF_POWER * frequency / np.maximum(sensitivity, 1e-300))
    return _first(frequency, frequency - reach) if reach[-1] < frequency[-1] else float(frequency[-1])


def _first(frequency: Floats, above: Floats) -> float:
    """First frequency where `above` turns positive, by linear interpolation; inf: never."""
    found = np.flatnonzero(above > 0)
    if not found.size:
        return inf
    k = int(found[0])
    if k == 0:
        return float(frequency[0])
    share = above[k - 1] / (above[k - 1] - above[k])
    return float(frequency[k - 1] + share * (frequency[k] - frequency[k - 1]))


def _crossings(
    response: Callable[[Floats], Complex], frequency: Floats, values: Complex
) -> tuple[list[float], list[float]]:
    """Frequencies where the loop is real and negative, and where its gain is 1."""
    real = [
        w
        for w in _roots(lambda w: float(np.imag(response(w))), frequency, values.imag)
        if np.real(response(np.asarray(w))) < 0
    ]
    unit = _roots(lambda w: float(np.abs(response(w)) - 1), frequency, np.abs(values) - 1)
    return real, unit


def _roots(function: Callable[..., float], frequency: Floats, values: Floats) -> list[float]:
    """Every sign change between grid points (not the last one, where the loop is real), refined."""
    changes = np.flatnonzero(np.sign(values[:-2]) * np.sign(values[1:-1]) < 0)
    return [float(brentq(function, frequency[k], frequency[k + 1])) for k in changes]


def _gain_margin(response: Callable[[Floats], Complex], real: list[float], last: complex) -> float:
    gains = [float(np.abs(response(np.asarray(w)))) for w in real] + ([abs(last)] if last.real < 0 else [])
    above = [1 / gain for gain in gains if gain < 1]
    return float(min(above, default=inf))


def _phase_margin(response: Callable[[Floats], Complex], unit: list[float]) -> float:
    """Smallest |phase + pi| where the gain is 1."""
    return min((float(abs(np.angle(-response(np.asarray(w))))) for w in unit), default=inf)
