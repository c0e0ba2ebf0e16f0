"""What makes the covariance of a fit: the noise that its residuals show, correlated or not, and what is known of it."""

from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from centering.circle._fit import fit_noise_kernels as told_at
from centering.circle._fit.fit_kernels import swept
from sdpgrind.base.checks import Floats

SHARED = 0.5
"""Different values, over readings, up to which these are taken for those of a probe that counts in steps."""
ON_STEPS = 1e-3
TURN = 2 * pi


class Travel(NamedTuple):
    """Places of the readings along the travel in order, angle covered (rad), turns covered (0: less than one)."""

    order: np.ndarray[tuple[int], np.dtype[np.intp]]
    swept: float
    turns: float


class Seen(NamedTuple):
    """Sd that scales the covariance and of a reading (mm), factor of correlation, freedom, what form does to the centre (mm)."""

    scale: float
    noise_sd: float
    inflation: float
    freedom: float
    form_bound: float


def travel_of(angle: Floats) -> Travel:
    """How the spindle went."""
    place = told_at.travelled(angle)
    order = np.argsort(place, kind="stable")
    line = place[order]
    covered = float(swept(line))
    turns = (covered + (line[-1] - line[0]) / max(line.size - 1, 1)) / TURN
    return Travel(
        order, covered, turns if turns >= 1 - 1e-6 and covered > 0.99 * (line[-1] - line[0]) else 0.0
    )


def seen_noise(
    travel: Travel,
    data: tuple[Floats, Floats],
    circle: Floats,
    left: Floats,
    shown: tuple[float, float, float],
    known: float,
    step: float,
) -> Seen:
    """Noise from the residuals, none less than is known or than steps of the probe make.

    `data` are angle and reading, `shown` the sd that the residuals show for the covariance and for a reading, and its freedom.
    """
    told = np.empty(4)
    told_at.noise(*data, circle, left, travel.order, travel.turns, told)
    ratio, inflation, freedom, shift = told.tolist()
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
    """Sd that the steps of a probe make, mm, where many readings share few values on a grid; else 0."""
    steps = np.diff(np.sort(reading))
    steps = steps[steps > 1e-12 * abs(reading).max()]
    if not steps.size or steps.size >= SHARED * reading.size:
        return 0.0
    least = float(steps.min())
    count = steps / least
    return least / sqrt(12) if np.abs(count - np.rint(count)).max() <= ON_STEPS * count.max() else 0.0
