"""Noise of the deviations from a circle, as draws, and the interval of RONt that follows from it."""

import numpy as np

from centering.roundness._circle_protocol import Circle
from centering.roundness._harmonic_fit import even_harmonics
from centering.roundness._interval import (
    DrawnNoise,
    PointNoise,
    calibrated,
    guaranteed,
    guaranteed_at,
    pairs_for,
)
from centering.roundness._roundness_interval import CALIBRATED, GUARANTEED, RoundnessInterval
from sdpgrind.base.checks import Complex, Floats

NORMS = ("LSC", "MZC")
"""Circles about which RONt is a norm of the form."""
_MOST = 0.5  # chosen: share of RONt that is lift by noise, above which the correction is more than the form
_ALIKE = 2.0  # chosen: largest sd of a deviation over the median, as where a step mentions a gap
_UNEVEN = 0.2  # chosen: of a step; the centre of the circle moves angles about it by far less


def is_even_noise(circle: Circle) -> bool:
    """Whether filtered noise is as large everywhere on an even turn in order: no gap was bridged."""
    alike = float(circle.noise_sd.max()) <= _ALIKE * float(np.median(circle.noise_sd))
    if not (alike and np.any(circle.noise_upr[2:])):
        return False
    step = np.diff(np.unwrap(circle.angle, period=2 * np.pi)) * len(circle.points) / (2 * np.pi)
    return bool(np.all(np.abs(step - 1) < _UNEVEN))


def methods_of(circle: Circle) -> tuple[str, ...]:
    """Methods of an interval, the default first: calibrated where its coverage was measured."""
    if not is_even_noise(circle):
        return (GUARANTEED,)
    band = circle.origin.low > 1
    measured = not band or (circle.filter.startswith("Gaussian") and circle.origin.high < np.inf)
    return (CALIBRATED, GUARANTEED) if measured else (GUARANTEED, CALIBRATED)


def is_mostly_noise(circle: Circle, ends: RoundnessInterval) -> bool:
    """Whether the usual interval is guaranteed because noise lifts RONt by more than the form has."""
    return ends.method == GUARANTEED != methods_of(circle)[0]


def amplitude_sd(circle: Circle) -> Floats:
    """Standard deviation of the amplitudes from 0 upr on, mm, of even noise."""
    upr = circle.noise_upr
    return np.asarray(upr * np.sqrt(np.mean(circle.noise_sd**2) / np.sum(upr[2:] ** 2)))


def even_noise(circle: Circle, pairs: int) -> DrawnNoise:
    """Draws of even noise."""
    return DrawnNoise(amplitude_sd(circle), pairs, circle.origin.lost)


def point_noise(circle: Circle, pairs: int) -> PointNoise:
    """Draws of noise that is not even."""
    return PointNoise(circle.noise_sd, circle.noise_upr, pairs)


def waves_of(circle: Circle) -> Complex:
    """Complex amplitudes of an even turn from 2 upr on, mm."""
    return np.asarray(2 * even_harmonics(circle.deviation)[2:])


def interval_of(circle: Circle, confidence: float, method: str) -> RoundnessInterval:
    """Interval of RONt by a method, mm; guaranteed where noise lifts it by more than the form has."""
    kind, value, radius = circle.kind, circle.ron_t, circle.radius
    tail, pairs, best = 0.5 * (1 - confidence), pairs_for(confidence), value
    if not np.any(circle.noise_sd):
        low = high = value
    elif not is_even_noise(circle):
        low, high = guaranteed_at(kind, value, circle.angle, point_noise(circle, pairs), radius, tail)
    elif method == GUARANTEED:
        low, high = guaranteed(kind, value, even_noise(circle, pairs), radius, tail)
    else:
        noise = even_noise(circle, pairs)
        low, high, best = calibrated(kind, value, waves_of(circle), noise, radius, tail)
        # the form is no part of what was measured, or the less: the factors were not measured for that
        if high < best or not low or value - best > _MOST * value:
            (low, high), best, method = guaranteed(kind, value, noise, radius, tail), value, GUARANTEED
    return RoundnessInterval(low, high, best, confidence, method)
