"""An interval for RONt that holds the truth, from the noise of a profile and its form.

RONt is a norm of the form: V(h + e) >= V(h) on average over noise e, and V(h + e) <= V(h) + V(e). How far
noise lifts it depends on how many places tie for the highest and the lowest. The guaranteed interval assumes
nothing of the form. The calibrated one draws noise about the part of the form that stands out of it; its
factors were found by simulation.
"""

from collections.abc import Iterator, Sequence
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from centering.roundness._ends_kernels import zone_widths
from centering.roundness._exchange import rounding
from centering.roundness._sensitivity import SEED, draws, value_about
from sdpgrind.base.checks import Complex, Floats

PAIRS = 100  # chosen: draws of noise, each added and subtracted
_PIECE = 250  # chosen: pairs drawn at once, a limit on memory
_FADED = 0.013  # chosen: sd of a harmonic over the largest, below which it does not count; 2.5 cut-offs
_FINE = 8  # measured: points for each undulation that counts; 4 leave the value of chatter 0.2 widths high
_CALIBRATED = 0.95  # chosen: confidence for which the factors below were found
_WIDER, _DEEPER = 1.15, 1.3  # measured: 13 forms; of the spread of the lift, upper and lower end, 95 %
_CLIPPED = sqrt(2) * ndtri(0.95)  # derived: sd of a deviation; the difference of two exceeds it once in 20
_NOISY = 24.0  # measured: the same; RONt over the sd of a deviation; below, form is hardly told from noise


def pairs_for(confidence: float) -> int:
    """Pairs of draws for a confidence: at each end 20 lie beyond, at 95 % as many as the factors took."""
    return PAIRS if confidence <= _CALIBRATED else ceil(20 / (1 - confidence))


class PointNoise(NamedTuple):
    """Noise of all points or of each (sd mm), relative amplitudes by upr if filtered, pairs of draws."""

    sd: Floats
    upr: Floats
    pairs: int


class DrawnNoise:
    """Noise of a filtered profile on a coarse even turn, from the sd of its amplitudes from 0 upr on, mm.

    It is normal; of harmonics that a separation has lost (`lost`, upr) it is rectangular.
    """

    def __init__(self, sd: Floats, pairs: int = PAIRS, lost: Sequence[int] = ()) -> None:
        counted = np.flatnonzero(sd > _FADED * sd[2:].max())
        self.most = int(counted.max())
        self.sd = sd[2 : self.most + 1]
        self._lost = [upr - 2 for upr in lost if upr <= self.most]
        self.pairs = pairs
        self.size = 1 << int(np.ceil(np.log2(_FINE * self.most)))

    def draws(self) -> Iterator[Floats]:
        """Pieces of the draws (b, size), mm, each draw with its negative; the same at each call."""
        rng = np.random.default_rng(SEED)
        for first in range(0, self.pairs, _PIECE):
            parts = rng.standard_normal((min(_PIECE, self.pairs - first), self.sd.size, 2))
            parts[:, self._lost] = sqrt(12) * (ndtr(parts[:, self._lost]) - 0.5)
            drawn = self.values(self.sd * (parts[..., 0] - 1j * parts[..., 1]))
            yield np.concatenate([drawn, -drawn])

    def widths(self, kind: str, forms: Floats, radius: float) -> Floats:
        """RONt of each form (m, size) with each draw of noise, (m, b), mm; they share the draws."""
        found = [[widths(kind, form + drawn, radius) for form in forms] for drawn in self.draws()]
        return np.concatenate(found, axis=1)

    def values(self, amplitude: Floats | Complex) -> Floats:
        """Forms on the turn of complex amplitudes of 2 upr on, mm."""
        coef = np.zeros((*amplitude.shape[:-1], self.size // 2 + 1), dtype=complex)
        coef[..., 2 : self.most + 1] = amplitude * (self.size / 2)
        return np.asarray(np.fft.irfft(coef, self.size))

    @property
    def deviation_sd(self) -> float:
        """Standard deviation of one deviation, mm."""
        return sqrt(float(self.sd @ self.sd))

    @property
    def least_correlation(self) -> float:
        """Least correlation of two deviations."""
        return float(self.values((self.sd**2).astype(complex)).min() / (self.sd @ self.sd))


def widths(kind: str, forms: Floats, radius: float) -> Floats:
    """RONt of forms on an even turn (b, n), mm, about the least squares circle or in the minimum zone."""
    if kind == "LSC":
        return np.asarray(np.ptp(forms, axis=-1))
    return np.asarray(zone_widths(np.atleast_2d(forms), radius))


def guaranteed(kind: str, value: float, noise: DrawnNoise, radius: float, tail: float) -> tuple[float, float]:
    """Ends that hold for every form with the chance 1 - 2 tail or more, mm."""
    lifted = float(np.quantile(noise.widths(kind, np.zeros((1, 1)), radius), 1 - tail))
    spread = noise.deviation_sd * sqrt(2 * (1 - noise.least_correlation))
    return max(value - lifted, 0.0), value - float(ndtri(tail)) * spread


def calibrated(
    kind: str, value: float, amplitude: Complex, noise: DrawnNoise, radius: float, tail: float
) -> tuple[float, float, float]:
    """Both ends and the value without the lift of the noise, mm; `amplitude` of 2 upr on, filtered."""
    form, unsure = seen(amplitude, noise), value < _NOISY * noise.deviation_sd
    forms = [form, _without_ripple(form, noise)]
    forms += [noise.values(amplitude[: noise.sd.size])] if unsure else []
    lift = lifts(kind, np.array(forms), noise, radius)
    low, middle, high = np.quantile(lift[0], (tail, 0.5, 1 - tail))
    best = value - middle
    lower = min(best - _DEEPER * (high - middle), value - float(np.quantile(lift[1], 1 - tail)))
    upper = best + _WIDER * (middle - low)
    if unsure:
        upper = max(upper, value - float(np.quantile(lift[2], tail)))
    return max(float(lower), 0.0), float(upper), max(float(best), 0.0)


def seen(amplitude: Complex, noise: DrawnNoise) -> Floats:
    """The form of the amplitudes from 2 upr on, mm, that stand out of the noise, on its turn."""
    measured = amplitude[: noise.sd.size]
    out = np.abs(measured) ** 2 > 2 * noise.sd**2 * np.log(noise.most - 1)
    return noise.values(np.where(out, measured, 0.0))


def lifts(kind: str, forms: Floats, noise: DrawnNoise, radius: float) -> Floats:
    """Increase of RONt of each form (m, size) by each draw of noise, (m, b), mm."""
    return noise.widths(kind, forms, radius) - widths(kind, forms, radius)[:, np.newaxis]


def _without_ripple(form: Floats, noise: DrawnNoise) -> Floats:
    """The form with plateaus where its heights nearly tie, without 0 and 1 upr."""
    near = _CLIPPED * noise.deviation_sd
    low, high = form.min() + near, form.max() - near
    coef = np.fft.rfft(np.clip(form, min(low, high), max(low, high)))
    coef[:2] = 0.0
    return np.asarray(np.fft.irfft(coef, form.size))


def guaranteed_at(
    kind: str, value: float, angle: Floats, noise: PointNoise, radius: float, tail: float
) -> tuple[float, float]:
    """Guaranteed ends of points anyhow on the turn, mm."""
    lifted = widths_at(kind, angle, radius, noise)
    spread = sqrt(2) * float(noise.sd.max())
    return max(value - float(np.quantile(lifted, 1 - tail)), 0.0), value - float(ndtri(tail)) * spread


def widths_at(kind: str, angle: Floats, distance: Floats | float, noise: PointNoise) -> Floats:
    """RONt, mm, of points at a distance (mm) from the centre with each draw of noise, and its negative."""
    cosine, sine = np.cos(angle), np.sin(angle)
    found = []
    for unit in draws(angle, noise.upr, noise.pairs):
        for sign in (1.0, -1.0):
            x, y = ((distance + sign * noise.sd * unit) * each for each in (cosine, sine))
            found.append(value_about(kind, x, y, rounding(x, y)))
    return np.array(found)
