"""Sources of the uncertainty of RONt: laws, half widths, sensitivities, contributions by GUM's linear law."""

from collections.abc import Iterator
from math import cos, pi, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from centering.roundness._circle_noise import amplitude_sd, is_even_noise
from centering.roundness._circle_protocol import Circle
from centering.roundness._filters import PRACTICE
from centering.roundness._instrument import Instrument
from sdpgrind.base.checks import Floats

NORMAL, RECTANGULAR, UPWARD = "normal", "rectangular", "rectangular, upward only"
AT_BOTH_ENDS = "rectangular, at peak and at valley"
DRAWN, SHARED = "normal, drawn about the form", "as noise; of lost harmonics rectangular"
NOT_ENTERED = "does not enter one section"
_HALF = 1.959964  # derived: standard deviations of a normal law on each side of 95 %
_EXPANSION = 11.5e-6  # 1/K; source: ISO 3650, steel


class BudgetRow(NamedTuple):
    """A source of uncertainty of RONt.

    Attributes
    ----------
    source, law : str
        Name, and law of its error.
    half_width : float
        Half width of the law, of a normal one that of 95 %, in `unit`.
    unit : str
        Unit of `half_width`; "1": relative.
    sensitivity : float
        Change of RONt with the error, mm per `unit`.
    contribution : float
        Standard uncertainty of RONt by it, mm.
    """

    source: str
    law: str
    half_width: float
    unit: str
    sensitivity: float
    contribution: float


def rows_of(circle: Circle, instrument: Instrument, height: float) -> tuple[BudgetRow, ...]:
    """All sources, those that are 0 included."""
    return (*_of_readings(circle), *_of_instrument(circle, instrument, height), *_of_points(circle))


def spindle_bound(circle: Circle, instrument: Instrument, height: float) -> float:
    """Error of the spindle from valley to peak, mm, the most that it changes RONt by; 0 if taken off."""
    if is_separated(circle):
        return 0.0
    return instrument.spindle_error + instrument.spindle_error_per_height * height


def is_separated(circle: Circle) -> bool:
    """Whether the spindle's error was taken off the profile."""
    return bool(circle.origin.separated or circle.origin.spindle_sd)


def _of_readings(circle: Circle) -> Iterator[BudgetRow]:
    """Noise, and what a separation leaves, by the places that fix RONt."""
    places, weights = _fixing(circle)
    separated = np.array(circle.origin.separated or circle.origin.spindle_sd)
    shared = _linear_sd(separated, circle.angle[places], weights)
    whole = _noise_sd(circle, places, weights)
    noise, level = sqrt(max(whole**2 - shared**2, 0.0)), _level(circle, separated)
    yield BudgetRow("noise", DRAWN, _HALF * level, "mm", noise / level if level else 0.0, noise)
    if is_separated(circle):
        level = sqrt(float(separated @ separated))
        yield BudgetRow("separation", SHARED, _HALF * level, "mm", shared / level if level else 0.0, shared)


def _level(circle: Circle, separated: Floats) -> float:
    """Standard deviation of one deviation by noise alone, mm."""
    return sqrt(max(float(np.mean(circle.noise_sd**2)) - float(separated @ separated), 0.0))


def _fixing(circle: Circle) -> tuple[npt.NDArray[np.int64], Floats]:
    """Indices of the points that fix RONt, and their weights: RONt is the sum of weight times deviation.

    Of LSC the highest and the lowest; of MZC the contacts, whose weights balance in every direction.
    """
    if circle.kind == "LSC":
        ends = [int(np.argmax(circle.deviation)), int(np.argmin(circle.deviation))]
        return np.array(ends), np.array([1.0, -1.0])
    angle, outer = circle.contact_angles, circle.outer
    balance = np.array([outer, ~outer, np.cos(angle), np.sin(angle)], dtype=float)
    weights = np.linalg.lstsq(balance, np.array([1.0, -1.0, 0.0, 0.0]), rcond=None)[0]
    return circle.contacts, weights


def _noise_sd(circle: Circle, places: npt.NDArray[np.int64], weights: Floats) -> float:
    """Standard deviation of RONt by all noise, linear, mm."""
    if not is_even_noise(circle):
        sd = np.broadcast_to(circle.noise_sd, circle.deviation.shape)[places]
        return float(np.linalg.norm(weights * sd))
    return _linear_sd(amplitude_sd(circle), circle.angle[places], weights)


def _linear_sd(sd: Floats, angle: Floats, weights: Floats) -> float:
    """Standard deviation of a weighted sum of deviations at some angles, from that of amplitudes, mm."""
    waves = np.exp(1j * np.outer(np.arange(2, max(sd.size, 2)), angle)) @ weights
    return float(np.linalg.norm(sd[2:] * np.abs(waves)))


def _of_instrument(circle: Circle, instrument: Instrument, height: float) -> Iterator[BudgetRow]:
    """Errors of the tester."""
    value, half = circle.ron_t, spindle_bound(circle, instrument, height) / 2
    if not is_separated(circle):
        yield _row("spindle error", AT_BOTH_ENDS, half, "mm", sqrt(2.0))
    yield _row("gain", NORMAL, _HALF * instrument.gain_sd, "1", value)
    yield _row("probe linearity", RECTANGULAR, instrument.probe_linearity, "1", value)
    drift = _EXPANSION * circle.radius  # a drift in a turn changes RONt by no more than itself
    yield _row("temperature", NORMAL, _HALF * instrument.temperature_sd, "K", drift)
    yield _row("column straightness", NOT_ENTERED, instrument.column_straightness, "mm", 0.0)


def _of_points(circle: Circle) -> Iterator[BudgetRow]:
    """Peaks between the points, where these are few for each undulation at the cut-off."""
    points, cut_off = len(circle.points), circle.origin.high
    if 2 * cut_off < points < PRACTICE * cut_off:
        missed = 1 / cos(pi * cut_off / points) - 1  # bound of a wave's crest over its highest point
        yield _row("peaks between the points", UPWARD, missed / 2, "1", circle.ron_t)


def _row(source: str, law: str, half_width: float, unit: str, sensitivity: float) -> BudgetRow:
    divisor = _HALF if law == NORMAL else sqrt(3)
    return BudgetRow(source, law, half_width, unit, sensitivity, half_width / divisor * sensitivity)
