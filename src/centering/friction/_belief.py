"""What is believed of a part's friction: a grid over its scale, which every push scatters about, and over its ratio."""

from math import ceil, log, log1p, sqrt

import numpy as np

from centering._problem.model import PushModel
from sdpgrind.base.checks import Floats

SCALES, RATIOS = 161, 25
_REACH = 5.0
"""Standard deviations to which the grid goes."""
_LEAST = 0.05
"""Least friction over the expected one that is thought of."""


class FrictionBelief:
    """Probabilities of (scale, ratio): mu_static = e^(scale + ratio/2) times the expected one, mu_kinetic e^(scale - ratio/2).

    Both are logarithms, 0 where the part is as expected; scatter of a push adds to the scale.
    """

    def __init__(self, model: PushModel, part_sd: float, push_sd: float, ratio_sd: float) -> None:
        self.scale = np.linspace(log(max(1.0 - _REACH * part_sd, _LEAST)), log1p(_REACH * part_sd), SCALES)
        self.ratio = _ratios(log(model.mu_static / model.mu_kinetic), ratio_sd)
        self.scatter = _scatter(push_sd, self.scale[1] - self.scale[0])
        beyond = (self.scatter.size - 1) // 2
        step = self.scale[1] - self.scale[0]
        self.pushed = self.scale[0] + step * np.arange(-beyond, SCALES + beyond)
        """Scales that a push may meet, `self.scale` and what lies beyond."""
        self.smear = _banded(self.scatter, SCALES)
        slant = self.ratio / (ratio_sd if ratio_sd > 0 else 1.0)
        self.prior = np.outer(_density(self.scale, part_sd), np.exp(-0.5 * slant**2))
        self.prior /= self.prior.sum()
        self.weight = self.prior
        self.mu_static = model.mu_static * np.exp(self.scale[:, None] + 0.5 * self.ratio)
        self.mu_kinetic = model.mu_kinetic * np.exp(self.scale[:, None] - 0.5 * self.ratio)

    def take(self, likelihood: Floats) -> None:
        """Learn from the likelihood of a push over (scale met, ratio): the part's own scale is what it scattered about."""
        weight = self.weight * (self.smear @ likelihood)
        self.weight = weight / weight.sum()

    def expected(self) -> Floats:
        """Probability of what the next push meets, over (scale met, ratio)."""
        return np.asarray(self.smear.T @ self.weight)

    def moments(self, weight: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance of (mu_static, mu_kinetic)."""
        values = np.stack([self.mu_static.ravel(), self.mu_kinetic.ravel()])
        share = weight.ravel()
        mean = values @ share
        away = values - mean[:, None]
        return mean, (away * share) @ away.T


def span(axis: Floats, weight: Floats, reach: float, count: int) -> Floats:
    """Places for a coarser grid where the probability is, from end to end of `axis` at most."""
    mean = float(axis @ weight)
    sd = sqrt(max(float((axis - mean) ** 2 @ weight), 0.0))
    low, high = max(mean - reach * sd, axis[0]), min(mean + reach * sd, axis[-1])
    return np.linspace(low, high, count) if axis.size > 1 else axis


def _density(scale: Floats, sd: float) -> Floats:
    """Density of the logarithm of what has mean 1 and a standard deviation."""
    factor = np.exp(scale)
    return np.asarray(factor * np.exp(-0.5 * ((factor - 1.0) / sd) ** 2))


def _ratios(most: float, sd: float) -> Floats:
    """Logarithms of mu_static/mu_kinetic over the expected one; it may not fall below 1."""
    return np.linspace(max(-_REACH * sd, -most), _REACH * sd, RATIOS) if sd > 0 else np.zeros(1)


def _scatter(sd: float, step: float) -> Floats:
    """Probabilities of the scatter of a push at multiples of a step of the scale."""
    if sd == 0:
        return np.ones(1)
    half = ceil(_REACH * sd / step)
    kernel = _density(np.arange(-half, half + 1, dtype=float) * step, sd)
    return np.asarray(kernel / kernel.sum())


def _banded(kernel: Floats, rows: int) -> Floats:
    """Matrix with the kernel in each row, one place further from row to row."""
    matrix = np.zeros((rows, rows + kernel.size - 1))
    for k in range(rows):
        matrix[k, k : k + kernel.size] = kernel
    return matrix
