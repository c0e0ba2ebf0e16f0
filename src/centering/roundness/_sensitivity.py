"""What noise of the readings does to a roundness: profiles with as much noise once more are given their circles by the exchanges.

A linear law of the contacts does not do: noise makes other points contacts, and slides the circle of an oval along its flat.
"""

from collections.abc import Iterator
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from centering.roundness._distance_kernels import extremes
from centering.roundness._exchange import rounding
from centering.roundness._lsc_kernels import least_squares_circle
from centering.roundness._mcc_kernels import smallest_circle
from centering.roundness._mic_kernels import empty_circle
from centering.roundness._mzc_kernels import zone
from sdpgrind.base.checks import Floats

PAIRS = 64
"""Noises that are drawn; each is added and taken off, so that what is linear in it leaves no bias."""
SEED = 12181
ADDED = np.sqrt(2.0)
"""Noise that is added, in sd of that which a profile holds already: with as much it would be told too large where there is little
form, as what is there has chosen the highest point; with twice as much too small for rough profiles, whose contacts it swaps."""
RISEN = 1 / (np.sqrt(1 + ADDED**2) - 1)
"""By how much noise has lifted a value over what that added lifts it further, where it is in proportion to the sd of both."""
_FINE = 16
"""Places of drawn noise for each undulation of its fastest."""


class NoiseEffect(NamedTuple):
    """Standard deviation of a value, and by how much noise has lifted it, mm."""

    sd: float
    bias: float


def noise_effect(kind: str, from_center: Floats, noise_sd: Floats, noise_upr: Floats) -> NoiseEffect:
    """Effect of noise (sd mm, of all points or each) on RONt of points (n, 2) about the centre of their circle, mm."""
    x, y = np.ascontiguousarray(from_center.T)
    tolerance = rounding(x, y)
    distance = np.hypot(x, y)
    added = (
        sign * ADDED * noise_sd * noise / distance
        for noise in _draws(np.arctan2(y, x), noise_upr)
        for sign in (1.0, -1.0)
    )
    values = np.array([_value(kind, x + change * x, y + change * y, tolerance) for change in added])
    held = values[np.isfinite(values)]
    if held.size < PAIRS:
        return NoiseEffect(np.inf, np.inf)
    risen = np.mean(held) - _value(kind, x, y, tolerance)
    return NoiseEffect(float(np.std(held) / ADDED), float(RISEN * risen))


def _draws(angle: Floats, upr: Floats) -> Iterator[Floats]:
    """Noises of sd 1: of each point by itself, or of undulations with such amplitudes (to scale)."""
    if not np.any(upr[2:]):
        yield from _normals(angle.size)
        return
    size = _FINE * upr.size
    share = np.where(np.arange(upr.size) < 2, 0.0, upr) / np.sqrt(
        np.sum(upr[2:] ** 2)
    )  # the circle takes the first two
    place = np.mod(angle / (2 * np.pi), 1.0) * size
    low = np.minimum(place.astype(int), size - 1)
    for cosine, sine in (np.split(normals, 2) for normals in _normals(2 * upr.size)):
        noise = np.fft.irfft(share * (cosine - 1j * sine) * (size / 2), size)
        yield noise[low] + (place - low) * (noise[(low + 1) % size] - noise[low])


def _normals(size: int) -> Iterator[Floats]:
    """Normal numbers, scaled so that those of each place have a mean square of 1: what one point does is then no chance."""
    square = np.zeros(size)
    rng = np.random.default_rng(SEED)
    for _ in range(PAIRS):
        square += rng.standard_normal(size) ** 2
    rng = np.random.default_rng(SEED)
    scale = np.sqrt(PAIRS / square)
    yield from (scale * rng.standard_normal(size) for _ in range(PAIRS))


def _value(kind: str, x: Floats, y: Floats, tolerance: float) -> float:
    """RONt about the circle that is found from the origin on; NaN where nothing holds an inscribed one."""
    basis = np.zeros(4, dtype=np.int64)
    if kind == "LSC":
        center = least_squares_circle(x, y, 0.0, 0.0)[:2]
    elif kind == "MCC":
        center = smallest_circle(x, y, tolerance, basis)[:2]
    elif kind == "MZC":
        center = zone(x, y, 0.0, 0.0, tolerance, basis)[:2]
    else:  # of two lobes the best one may lie at either end of the trough
        starts = ((0.0, 0.0), (float(x.mean()), float(y.mean())))
        found = max((empty_circle(x, y, *start, tolerance, basis) for start in starts), key=itemgetter(2))
        center = found[:2] if found[3] else (np.nan, np.nan)
    _, most, _, least = extremes(x, y, *center)
    return float(most - least) if np.isfinite(center[0]) else np.nan
