"""Whether turns show their noise: readings that a tester has filtered hide it, and no interval holds then."""

from math import sqrt

import numpy as np

from centering.roundness._profile_protocol import Measured
from centering.roundness._sampling import turns_of
from sdpgrind.base.checks import Floats

_LEAST = 256  # chosen: readings of a turn; an octave of 32 harmonics tells its power to 25 %
_FALL = 6.0  # chosen: power of an octave over that of the next; of a square wave 4, of white noise 1
_DIGITS = 1.2  # chosen: noise over that of the rounding; real noise of one digit has 3.5
_SILENT = 1e-6  # chosen: noise over the height of the readings; no tester is so quiet
_WHITE = 3.0  # chosen: given noise over that of the highest octave
_EVEN = 0.01  # chosen: of a step
_SAME = 1e-10  # mm; chosen: a tenth of the last digit of any tester


def hidden_noise(profile: Measured) -> str:
    """Reason why the noise of even turns cannot be known from their readings; "": it can."""
    readings, points = profile.deviation, _points_of_turn(profile.angle)
    if points < _LEAST:
        return ""
    variance = _variance(readings, points)
    top = variance.size // 2
    highest, below = float(np.median(variance[top:-1])), float(np.median(variance[top // 2 : top]))
    noise = sqrt(highest)
    if below > _FALL * highest:
        return "the noise falls off towards the highest undulations: the readings were filtered before"
    if noise <= max(_DIGITS * _step(profile.reading) / sqrt(12), _SILENT * float(np.ptp(readings))):
        return "the readings show no noise beyond their last digit: they were filtered before, or rounded"
    if profile._origin.noise_given and profile.noise_sd > _WHITE * noise:
        return (
            f"the given noise of {1e3 * profile.noise_sd:.3g} µm is not in the highest undulations,"
            f" which have {1e3 * noise:.3g} µm: the readings were filtered before"
        )
    return ""


def _points_of_turn(angle: Floats) -> int:
    """Readings of one of the turns that angles with even steps are, also of a part of a last one; else 0."""
    step = np.diff(angle)
    even = np.all(np.abs(step - np.median(step)) <= _EVEN * abs(float(np.median(step))))
    turns = turns_of(angle)
    return round(angle.size / turns) if even and turns > 1 - _EVEN else 0


def _variance(readings: Floats, points: int) -> Floats:
    """Variance of white noise that has the power of each harmonic of a turn, mm^2; of noise their median.

    Several turns are taken without their mean, the form. Each is weighed by a squared sine, whose ends fit:
    neither a filter of each turn nor one of all readings leaves a step there, which would look like noise.
    """
    count = max(readings.size // points, 1)
    turns = readings[: count * points].reshape(count, points)
    free = max(count - 1, 1)
    weight = np.sin(np.pi * np.arange(points) / points) ** 2
    left = turns - turns.mean(axis=0) if count > 1 else turns
    power = np.sum(np.abs(np.fft.rfft(left * weight)) ** 2, axis=0) / (free * np.sum(weight**2))
    return np.asarray(power / (1 - 1 / (9 * free)) ** 3)  # median over mean of chi^2, Wilson and Hilferty


def _step(reading: Floats) -> float:
    """Smallest difference of two readings, mm: that of their last digit, if they are rounded."""
    step = np.diff(np.unique(reading))
    return float(np.min(step[step > _SAME], initial=np.inf)) if step.size else 0.0
