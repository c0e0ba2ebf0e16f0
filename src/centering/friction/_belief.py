"""Belief about a part's friction: probabilities on a grid of scale and ratio."""

from math import ceil, log, log1p, sqrt

import numpy as np

from centering._problem.model import PushModel
from sdpgrind.base.checks import Floats

SCALES, RATIOS = 161, 25  # chosen: size of the grid; wider cells add to the variance of predictions
_REACH = 5.0  # chosen: reach of the grid in standard deviations
_LEAST = 0.05  # chosen: least friction of the grid over the expected one; keeps it above 0


class FrictionBelief:
    """Probabilities of (scale, ratio): mu_static, mu_kinetic = e^(scale +- ratio/2) times expected.

    Both logarithms are 0 for the expected part; the scatter of a push adds to the scale.
    """

    def __init__(self, model: PushModel, part_sd: float, push_sd: float, ratio_sd: float) -> None:
        self.scale = np.linspace(log(max(1.0 - _REACH * part_sd, _LEAST)), log1p(_REACH * part_sd), SCALES)
        self.ratio = _ratios(log(model.mu_static / model.mu_kinetic), ratio_sd)
        self.scatter = _scatter(push_sd, self.scale[1] - self.scale[0])
        beyond = (self.scatter.size - 1) // 2
        step = self.scale[1] - self.scale[0]
        self.pushed = self.scale[0] + step * np.arange(-beyond, SCALES + beyond)
        """Scales of single pushes: `self.scale` and the scatter beyond it."""
        self.smear = _banded(self.scatter, SCALES)
        slant = self.ratio / (ratio_sd if ratio_sd > 0 else 1.0)
        self.prior = np.outer(_density(self.scale, part_sd), np.exp(-0.5 * slant**2))
        self.prior /= self.prior.sum()
        self.weight = self.prior
        self.mu_static = model.mu_static * np.exp(self.scale[:, None] + 0.5 * self.ratio)
        self.mu_kinetic = model.mu_kinetic * np.exp(self.scale[:, None] - 0.5 * self.ratio)

    def take(self, likelihood: Floats) -> None:
        """Update by the likelihood of a push over (its scale, ratio)."""
        weight = self.weight * (self.smear @ likelihood)
        self.weight = weight / weight.sum()

    def expected(self) -> Floats:
        """Probability of the next push over (its scale, ratio)."""
        return np.asarray(self.smear.T @ self.weight)

    def moments(self, weight: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance of (mu_static, mu_kinetic)."""
        values = np.stack([self.mu_static.ravel(), self.mu_kinetic.ravel()])
        share = weight.ravel()
        mean = values @ share
        away = values - mean[:, None]
        return mean, (away * share) @ away.T


def span(axis: Floats, weight: Floats, reach: float, count: int) -> Floats:
    """Nodes of a coarser grid about the mean, within the ends of `axis`."""
    mean = float(axis @ weight)
    sd = sqrt(max(float((axis - mean) ** 2 @ weight), 0.0))
    low, high = max(mean - reach * sd, axis[0]), min(mean + reach * sd, axis[-1])
    return np.linspace(low, high, count) if axis.size > 1 else axis


def _density(scale: Floats, sd: float) -> Floats:
    """Density of the logarithm of a variable of mean 1 and standard deviation `sd`."""
    factor = np.exp(scale)
    return np.asarray(factor * np.exp(-0.5 * ((factor - 1.0) / sd) ** 2))


def _ratios(most: float, sd: float) -> Floats:
    """Logarithms of mu_static/mu_kinetic over the expected ratio; the ratio itself stays >= 1."""
    return np.linspace(max(-_REACH * sd, -most), _REACH * sd, RATIOS) if sd > 0 else np.zeros(1)


def _scatter(sd: float, step: float) -> Floats:
    """Probabilities of the scatter of a push at multiples of a step of the scale."""
    if sd == 0:
        return np.ones(1)
    half = ceil(_REACH * sd / step)
    kernel = _density(np.arange(-half, half + 1, dtype=float) * step, sd)
    return np.asarray(kernel / kernel.sum())


def _banded(kernel: Floats, rows: int) -> Floats:
    """Matrix with the kernel in each row, shifted by one place from row to row."""
    matrix = np.zeros((rows, rows + kernel.size - 1))
    for k in range(rows):
        matrix[k, k : k + kernel.size] = kernel
    return matrix
