"""Components of variance of log readings: between passes and between beads.

Balanced data with one mean: analysis of variance, the interval between passes by chi-square, that between
beads by Williams (1962) and Tukey (1951). Any other: restricted likelihood (REML), intervals by its profile.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import optimize, stats

from sdpgrind.base.checks import Floats

_LEAST, _MOST = 1e-4, 2.0  # log sd; chosen: less is exact, more is no scatter of a process
_FINE = {"xatol": 1e-5}  # chosen: log sd, a hundredth of the least standard error
CONFIDENCE = 0.95  # chosen: of every interval of the estimates
Ends = tuple[float, float]


class BeadReadings(NamedTuple):
    """Readings of one bead of n passes: y = fixed @ means + loads @ bead + own scatter + noise."""

    y: Floats  # (n,)
    fixed: Floats  # (n, p)
    loads: Floats  # (n, q): of the bead's independent deviations
    own: Floats  # (n,): variance of a pass over that of the scatter
    noise: Floats  # (n,): variance of the gauges


class Components(NamedTuple):
    """Standard deviations of the logarithms and their 95 % intervals; means."""

    passes: float
    beads: float
    passes_interval: Ends
    beads_interval: Ends
    means: Floats


def components(beads: Sequence[BeadReadings]) -> Components:
    """Estimate both standard deviations from readings of several beads; of one, that between passes."""
    if len(beads) == 1:
        return Reml(beads).alone
    sizes = {bead.y.size for bead in beads}
    one_mean = beads[0].fixed.shape[1] == 1 and all(np.all(bead.loads == 1.0) for bead in beads)
    quiet = not any(np.any(bead.noise) for bead in beads)
    if len(sizes) == 1 and sizes != {1} and one_mean and quiet:
        return _anova(np.array([bead.y * bead.fixed[:, 0] for bead in beads]))
    return Reml(beads).components


def _anova(y: Floats) -> Components:
    """Balanced one-way random effects of y (beads, passes)."""
    count, each = y.shape
    tail = 0.5 * (1 - CONFIDENCE)
    within = float(np.sum((y - y.mean(axis=1, keepdims=True)) ** 2))
    between = each * float(np.sum((y.mean(axis=1) - y.mean()) ** 2))
    free, groups = count * (each - 1), count - 1
    msw, msb = within / free, between / groups
    ends = [within / stats.chi2.ppf(q, free) for q in (1 - tail, tail)]
    of_beads = [
        (between - groups * msw * stats.f.ppf(q, groups, free)) / (each * stats.chi2.ppf(q, groups))
        for q in (1 - tail, tail)
    ]
    return Components(
        float(np.sqrt(msw)),
        float(np.sqrt(max(0.0, (msb - msw) / each))),
        (float(np.sqrt(ends[0])), float(np.sqrt(ends[1]))),
        (float(np.sqrt(max(of_beads[0], 0.0))), float(np.sqrt(max(of_beads[1], 0.0)))),
        np.array([float(y.mean())]),
    )


class Reml:
    """Restricted likelihood of beads of any sizes, those of one size at a time."""

    def __init__(self, beads: Sequence[BeadReadings]) -> None:
        sizes = sorted({bead.y.size for bead in beads})
        groups = [[bead for bead in beads if bead.y.size == size] for size in sizes]
        self._groups = [
            BeadReadings(*(np.array(each) for each in zip(*group, strict=True))) for group in groups
        ]

    def _sums(self, passes: float, beads: float) -> tuple[float, Floats, Floats, float]:
        """Log det of the covariance, X'V^-1 X, X'V^-1 y and y'V^-1 y over all beads."""
        width = self._groups[0].fixed.shape[-1]
        logs, square = 0.0, 0.0
        normal, right = np.zeros((width, width)), np.zeros(width)
        for y, fixed, loads, own, noise in self._groups:
            covariance = beads**2 * loads @ loads.swapaxes(1, 2)
            covariance += (passes**2 * own + noise)[:, None, :] * np.eye(y.shape[1])
            logs += float(np.sum(np.linalg.slogdet(covariance)[1]))
            solved = np.linalg.solve(covariance, np.concatenate([fixed, y[:, :, None]], axis=2))
            normal += np.einsum("bnp,bnq->pq", fixed, solved[:, :, :width])
            right += np.einsum("bnp,bn->p", fixed, solved[:, :, width])
            square += float(np.einsum("bn,bn->", y, solved[:, :, width]))
        return logs, normal, right, square

    def deviance(self, passes: float, beads: float) -> float:
        """Minus twice the restricted log-likelihood, but for a constant."""
        logs, normal, right, square = self._sums(passes, beads)
        fit = right @ np.linalg.solve(normal, right)
        return float(logs + np.linalg.slogdet(normal)[1] + square - fit)

    @cached_property
    def best(self) -> tuple[float, float, float]:
        """Standard deviations between passes and beads of greatest likelihood, and its deviance."""
        start = 0.15  # chosen: the usual scatter of coefficients
        found = optimize.minimize(
            lambda x: self.deviance(*x), (start, start), bounds=((_LEAST, _MOST), (0.0, _MOST))
        )
        return float(found.x[0]), float(found.x[1]), float(found.fun)

    @property
    def components(self) -> Components:
        passes, beads, _ = self.best

        def at_passes(sd: float) -> float:
            return _least(lambda other: self.deviance(sd, other), 0.0)

        def at_beads(sd: float) -> float:
            return _least(lambda other: self.deviance(other, sd), _LEAST)

        return Components(
            passes,
            beads,
            _ends(at_passes, passes, _LEAST),
            _ends(at_beads, beads, 0.0),
            self.means(passes, beads),
        )

    def means(self, passes: float, beads: float) -> Floats:
        """Fixed effects of greatest likelihood at two standard deviations."""
        _, normal, right, _ = self._sums(passes, beads)
        return np.asarray(np.linalg.solve(normal, right), dtype=float)

    @property
    def alone(self) -> Components:
        """Components of one bead, whose deviation is none: the scatter between beads is not told."""
        found = optimize.minimize_scalar(
            lambda sd: self.deviance(sd, 0.0), bounds=(_LEAST, _MOST), method="bounded", options=_FINE
        )
        passes = float(found.x)
        ends = _ends(lambda sd: self.deviance(sd, 0.0), passes, _LEAST)
        return Components(passes, 0.0, ends, (0.0, np.inf), self.means(passes, 0.0))


def _ends(profile: Callable[[float], float], at: float, least: float) -> Ends:
    """Where the profile of the deviance is above its least value, at `at`, by the quantile of chi-square."""
    level = profile(at) + float(stats.chi2.ppf(CONFIDENCE, 1))

    def above(sd: float) -> float:
        return profile(sd) - level

    low = least if at <= least or above(least) <= 0 else optimize.brentq(above, least, at, xtol=1e-5)
    high = _MOST if above(_MOST) <= 0 else optimize.brentq(above, max(at, least), _MOST, xtol=1e-5)
    return float(low), float(high)


def _least(deviance: Callable[[float], float], least: float) -> float:
    """Least deviance over the other standard deviation."""
    found = optimize.minimize_scalar(deviance, bounds=(least, _MOST), method="bounded", options=_FINE)
    return float(min(found.fun, deviance(least)))
