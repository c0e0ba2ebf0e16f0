"""Whether a turn shows its noise: readings that a tester has filtered hide it, and no interval holds then."""

from math import log, sqrt

import numpy as np

from centering.roundness._profile_protocol import Measured
from centering.roundness._sampling import turns_of
from sdpgrind.base.checks import Floats

_LEAST = 256  # chosen: readings; an octave of 32 harmonics tells its power to 25 %
_FALL = 6.0  # chosen: power of an octave over that of the next; of a square wave 4, of white noise 1
_DIGITS = 1.2  # chosen: noise over that of the rounding; real noise of one digit has 3.5
_SILENT = 1e-6  # chosen: noise over the height of the readings; no tester is so quiet
_WHITE = 3.0  # chosen: given noise over that of the highest octave
_EVEN = 0.01  # chosen: of a step
_SAME = 1e-10  # mm; chosen: a tenth of the last digit of any tester


def hidden_noise(profile: Measured) -> str:
    """Reason why the noise of a single even turn cannot be known from its readings; "": it can."""
    readings = profile.deviation
    if readings.size < _LEAST or not _is_turn(profile.angle):
        return ""
    power = np.abs(np.fft.rfft(readings)) ** 2
    top = power.size // 2
    highest, below = float(np.median(power[top:-1])), float(np.median(power[top // 2 : top]))
    noise = sqrt(highest / (log(2) * readings.size))  # of an exponential distribution the median is ln 2
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


def _is_turn(angle: Floats) -> bool:
    """Whether angles are one turn with even steps."""
    step = np.diff(angle)
    even = np.all(np.abs(step - np.median(step)) <= _EVEN * abs(float(np.median(step))))
    return bool(even and abs(turns_of(angle) - 1) <= _EVEN)


def _step(reading: Floats) -> float:
    """Smallest difference of two readings, mm: that of their last digit, if they are rounded."""
    step = np.diff(np.unique(reading))
    return float(np.min(step[step > _SAME], initial=np.inf)) if step.size else 0.0
