"""Noise that scales the covariance of a fit, from residuals (correlated or not) and prior knowledge."""

from math import inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from centering.circle._fit import fit_noise_kernels as kernels
from centering.circle._fit.fit_kernels import swept
from sdpgrind.base.checks import Floats

SHARED = 0.5  # chosen: largest share of different values among readings of a probe with steps
ON_STEPS = 1e-3  # chosen: relative deviation from whole steps up to which readings lie on a grid
TURN = 2 * pi
ROUNDING = 1e-6  # chosen: rad, and share of a turn; rounding of the angles


class Travel(NamedTuple):
    """Order of the readings along the travel, angle covered (rad), turns covered (0: less than one)."""

    order: np.ndarray[tuple[int], np.dtype[np.intp]]
    swept: float
    turns: float


class Seen(NamedTuple):
    """Standard deviations (mm) of the covariance and of a reading, inflation, freedom, shift by form (mm)."""

    scale: float
    noise_sd: float
    inflation: float
    freedom: float
    form_bound: float


def travel_of(angle: Floats) -> Travel:
    """Order of travel and coverage of spindle angles (rad)."""
    place = kernels.travelled(angle)
    order = np.argsort(place, kind="stable")
    line = place[order]
    covered = float(swept(line))
    turns = (covered + (line[-1] - line[0]) / max(line.size - 1, 1)) / TURN
    return Travel(
        order, covered, turns if turns >= 1 - 1e-6 and covered > 0.99 * (line[-1] - line[0]) else 0.0
    )


def turn_and_place(angle: Floats) -> tuple[Any, Floats]:
    """Number of the turn of each reading, along the travel, and its place in that turn, rad.

    An arc of less than half a turn that begins again, as of the next part, counts as a turn, too.
    """
    way = kernels.travelled(angle)
    way = way if way[-1] >= way[0] else -way
    way -= way.min()
    turn = np.floor(way / TURN + ROUNDING).astype(int)
    again = np.concatenate([[0], np.cumsum(np.diff(way) < -0.5 * way.max())])
    return turn + again, way - TURN * turn


def seen_noise(
    travel: Travel,
    data: tuple[Floats, Floats],
    circle: Floats,
    left: Floats,
    shown: tuple[float, float, float],
    known: float,
    step: float,
) -> Seen:
    """Noise of a fit, at least the known noise (mm) and that of the probe's steps (mm).

    `data` are angle and reading; `shown` are the sd of the covariance, the sd of a reading, and its freedom.
    """
    result = np.empty(4)
    kernels.noise(*data, circle, left, travel.order, travel.turns, result)
    ratio, inflation, freedom, shift = result.tolist()
    scale, noise_sd = max(shown[0] * ratio, step), max(shown[1] * ratio, step)
    if scale * inflation <= known:
        return Seen(known, noise_sd, 1.0, inf, shift)
    if inflation == ratio == 1.0:
        return Seen(scale, noise_sd, 1.0, shown[2], shift)
    count = np.count_nonzero(np.isfinite(left))
    return Seen(
        scale * inflation, noise_sd, inflation, max(freedom * min((shown[2] + 3) / count, 1.0), 1.0), shift
    )


def step_noise(reading: Floats) -> float:
    """Noise (sd) of a probe with steps, mm, where many readings share few values on a grid; else 0."""
    steps = np.diff(np.sort(reading))
    steps = steps[steps > 1e-12 * abs(reading).max()]
    if not steps.size or steps.size >= SHARED * reading.size:
        return 0.0
    least = float(steps.min())
    count = steps / least
    return least / sqrt(12) if np.abs(count - np.rint(count)).max() <= ON_STEPS * count.max() else 0.0
