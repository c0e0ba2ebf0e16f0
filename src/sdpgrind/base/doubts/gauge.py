"""A gauge by its readings: noise, its correlation, step, clipped readings, bent residuals."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.words import amount

_COMMON = 0.02  # chosen: share of a step by which multiples may be off; rounding of files is far less
_EXACT = 1e-4  # chosen: share of a step by which multiples are off at least, so that two or three prove none
_PARTS = 20  # chosen: finest part of the least difference that is tried as the step
_CHANCE = 1e-6  # chosen: probability that readings without a step look like multiples of one
_PILED = 3  # chosen: least number of readings at the greatest value that shows clipping
_BLOCK = 16  # chosen: readings of a mean; its noise is a quarter of theirs
_RARELY = 1e-3  # chosen: probability that noise alone counts as a bend


class Bend(NamedTuple):
    """Block of residuals farthest off: its index range and its mean, in the unit of the readings."""

    first: int
    last: int
    mean: float


def step_of(readings: Floats) -> float:
    """Greatest common step of the differences of readings; 0: there is none beyond chance."""
    levels = np.unique(readings[np.isfinite(readings)])
    apart = np.diff(levels)
    apart = apart[apart > 1e-9 * max(float(np.abs(levels).max(initial=0.0)), 1e-300)]
    if apart.size < 2:
        return 0.0
    repeated = levels.size < np.isfinite(readings).sum()
    for part in range(1, _PARTS + 1):
        step = float(apart.min()) / part
        multiples = apart / step
        counts = apart if repeated else np.unique(np.rint(multiples))  # an even ramp has one difference
        off = float(np.max(np.abs(multiples - np.rint(multiples))))
        by_chance = (2 * max(off, _EXACT)) ** (counts.size - 1) * part  # that so many are as close as these
        if off < _COMMON and by_chance < _CHANCE:
            return float(np.median(apart / np.rint(multiples)))
    return 0.0


def clipped(readings: Floats) -> int:
    """Number of readings piled up at the greatest value, more than twice those at the next; else 0."""
    levels, counts = np.unique(readings[np.isfinite(readings)], return_counts=True)
    if levels.size < 3 or counts[-1] < _PILED or counts[-1] <= 2 * counts[-2]:
        return 0
    return int(counts[-1])


def bend(residual: Floats, time: Floats, rho: float) -> Bend | None:
    """Where block means of the residuals are farther off than independent noise explains; None: nowhere."""
    from scipy.special import chdtri

    white = serial.filtered(residual, rho, serial.gaps(time, time.size))
    count = residual.size // _BLOCK
    if count < 2:
        return None
    means = white[: count * _BLOCK].reshape(count, _BLOCK).mean(axis=1)
    apart = np.diff(white)
    variance = float(apart @ apart) / (2 * apart.size) / _BLOCK
    if not means @ means > variance * chdtri(count, _RARELY):
        return None
    raw = residual[: count * _BLOCK].reshape(count, _BLOCK).mean(axis=1)
    worst = int(np.argmax(np.abs(raw)))
    return Bend(worst * _BLOCK, (worst + 1) * _BLOCK - 1, float(raw[worst]))


def noise_sentence(name: str, unit: str, sd: float, rho: float, readings: Floats) -> str:
    """Sentence on noise, its correlation and step of a column."""
    alike = "independent from reading to reading"
    if rho > 2 / np.sqrt(readings.size):
        count = f"{readings.size} readings count as {serial.effective(readings.size, 0, rho):.0f}"
        alike = f"correlation {rho:.2f} from reading to reading, as after a filter: {count}"
    return f"Noise of {name}: sd {amount(sd, unit)}, {alike}; {step_words(readings, sd, unit)}."


def step_words(readings: Floats, sd: float, unit: str) -> str:
    """Words on the step of a gauge, and whether it is coarser than the noise."""
    step = step_of(readings)
    if step == 0:
        return "no step of the gauge shows"
    coarse = ", coarser than the noise" if step > 2 * sd else ""
    return f"the gauge shows steps of {amount(step, unit)}{coarse}"


def clipped_sentence(name: str, unit: str, readings: Floats) -> str:
    """Sentence on clipped readings; empty: there are none."""
    count = clipped(readings)
    if not count:
        return ""
    top = amount(float(np.nanmax(readings)), unit)
    return f"{count} readings of {name} pile up at {top}, its greatest value: clipped, and not used."
