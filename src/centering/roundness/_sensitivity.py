"""Effect of noise on a roundness: exchanges on profiles with added noise.

A linear law of the contacts fails: noise changes the contacts, and moves the circle of an oval along its
flat.
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

PAIRS = 64  # chosen: draws of noise, each added and subtracted to cancel linear bias; more cost time
SEED = 12181  # chosen: any number; a fixed one makes the result repeatable
ADDED = np.sqrt(2.0)
"""Added noise over that of the profile; chosen: 1 overestimates the sd with little form, 2 underestimates it
for rough profiles."""
RISEN = 1 / (np.sqrt(1 + ADDED**2) - 1)
"""Increase of a value by its noise over the increase by the added noise; derived for increases proportional
to the sd."""
_FINE = 16  # chosen: places of drawn noise for each of its fastest undulations


class NoiseEffect(NamedTuple):
    """Standard deviation and bias of a value by noise, mm."""

    sd: float
    bias: float


def noise_effect(kind: str, from_center: Floats, noise_sd: Floats, noise_upr: Floats) -> NoiseEffect:
    """Effect of noise (sd mm, of all points or each) on RONt of points (n, 2) about a centre, mm."""
    x, y = np.ascontiguousarray(from_center.T)
    tolerance = rounding(x, y)
    distance = np.hypot(x, y)
    added = (
        sign * ADDED * noise_sd * noise / distance
        for noise in draws(np.arctan2(y, x), noise_upr)
        for sign in (1.0, -1.0)
    )
    values = np.array([value_about(kind, x + change * x, y + change * y, tolerance) for change in added])
    held = values[np.isfinite(values)]
    if held.size < PAIRS:
        return NoiseEffect(np.inf, np.inf)
    risen = np.mean(held) - value_about(kind, x, y, tolerance)
    return NoiseEffect(float(np.std(held) / ADDED), float(RISEN * risen))


def draws(angle: Floats, upr: Floats, pairs: int = PAIRS) -> Iterator[Floats]:
    """Unit noise, independent at each point, or of undulations with these relative amplitudes."""
    if not np.any(upr[2:]):
        yield from _normals(angle.size, pairs)
        return
    size = _FINE * upr.size
    passed = np.where(np.arange(upr.size) < 2, 0.0, upr)  # the circle takes the first two
    share = passed / np.sqrt(np.sum(upr[2:] ** 2))
    place = np.mod(angle / (2 * np.pi), 1.0) * size
    low = np.minimum(place.astype(int), size - 1)
    for cosine, sine in (np.split(normals, 2) for normals in _normals(2 * upr.size, pairs)):
        noise = np.fft.irfft(share * (cosine - 1j * sine) * (size / 2), size)
        yield noise[low] + (place - low) * (noise[(low + 1) % size] - noise[low])


def _normals(size: int, pairs: int) -> Iterator[Floats]:
    """Normal numbers, scaled to a mean square of 1 at each place, which reduces the scatter of the result."""
    square = np.zeros(size)
    rng = np.random.default_rng(SEED)
    for _ in range(pairs):
        square += rng.standard_normal(size) ** 2
    rng = np.random.default_rng(SEED)
    scale = np.sqrt(pairs / square)
    yield from (scale * rng.standard_normal(size) for _ in range(pairs))


def value_about(kind: str, x: Floats, y: Floats, tolerance: float) -> float:
    """RONt about the circle found from the origin; NaN where no inscribed circle is held."""
    basis = np.zeros(4, dtype=np.int64)
    if kind == "LSC":
        center = least_squares_circle(x, y, 0.0, 0.0)[:2]
    elif kind == "MCC":
        center = smallest_circle(x, y, tolerance, basis)[:2]
    elif kind == "MZC":
        center = zone(x, y, 0.0, 0.0, tolerance, basis)[:2]
    else:  # with two lobes the best circle may lie at either end of the trough
        starts = ((0.0, 0.0), (float(x.mean()), float(y.mean())))
        found = max((empty_circle(x, y, *start, tolerance, basis) for start in starts), key=itemgetter(2))
        center = found[:2] if found[3] else (np.nan, np.nan)
    _, most, _, least = extremes(x, y, *center)
    return float(most - least) if np.isfinite(center[0]) else np.nan
