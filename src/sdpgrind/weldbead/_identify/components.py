"""Components of variance of log readings: between passes and between beads.

Balanced data with one mean: analysis of variance, the interval between passes by chi-square, that between
beads by Williams (1962) and Tukey (1951). Any other: restricted likelihood (REML), intervals by its profile.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

from sdpgrind.base.checks import Floats

_LEAST, _MOST = 1e-4, 2.0  # log sd; chosen: less is exact, more is no scatter of a process
_USUAL = 0.15**2  # variance of a logarithm, for scale and start; chosen: the usual scatter of coefficients
_FINE = 1e-5  # chosen: log sd, a hundredth of the least standard error
CONFIDENCE = 0.95  # chosen: of every interval of the estimates
Ends = tuple[float, float]


class BeadReadings(NamedTuple):
    """Readings of one bead of n passes: y = fixed @ means + loads @ bead + own scatter + noise."""

    y: Floats  # (n,)
    fixed: Floats  # (n, p)
    loads: Floats  # (n, q): of the q independent deviations of a bead
    own: Floats  # (n, q): variance of a pass over those of its q deviations
    noise: Floats  # (n,): variance of the gauges


class Components(NamedTuple):
    """Standard deviations of q logarithms and their 95 % intervals; means."""

    passes: tuple[float, ...]
    beads: tuple[float, ...]
    passes_interval: tuple[Ends, ...]
    beads_interval: tuple[Ends, ...]
    means: Floats


class Tied(NamedTuple):
    """Whether all q deviations have one variance: those of a pass, those of a bead."""

    passes: bool = True
    beads: bool = True


ALIKE = Tied()


def components(
    beads: Sequence[BeadReadings],
    tied: Tied = ALIKE,
    widening: Callable[["Reml"], Floats] | None = None,
) -> Components:
    """Estimate both standard deviations from readings of several beads; of one, those between passes.

    `widening` gives for each variance the factor on the quantile of chi-square of an interval by likelihood.
    """
    sizes = {bead.y.size for bead in beads}
    one_mean = beads[0].fixed.shape[1] == 1 and all(np.all(bead.loads == 1.0) for bead in beads)
    quiet = not any(np.any(bead.noise) for bead in beads)
    if len(beads) > 1 and len(sizes) == 1 and sizes != {1} and one_mean and quiet:
        return _anova(np.array([bead.y * bead.fixed[:, 0] for bead in beads]))
    reml = Reml(beads, tied, told=len(beads) > 1)
    return reml.components(None if widening is None else widening(reml))


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
        (float(np.sqrt(msw)),),
        (float(np.sqrt(max(0.0, (msb - msw) / each))),),
        ((float(np.sqrt(ends[0])), float(np.sqrt(ends[1]))),),
        ((float(np.sqrt(max(of_beads[0], 0.0))), float(np.sqrt(max(of_beads[1], 0.0)))),),
        np.array([float(y.mean())]),
    )


class Reml:
    """Restricted likelihood of beads of any sizes, those of one size at a time.

    Its variances are those of a pass, then those of a bead: of each level one where it is tied, else one for
    each deviation. Of a single bead (`told` is False) they are those of a pass alone.
    """

    def __init__(self, beads: Sequence[BeadReadings], tie: Tied = ALIKE, *, told: bool = True) -> None:
        self._beads, sizes = tuple(beads), sorted({bead.y.size for bead in beads})
        groups = [[bead for bead in beads if bead.y.size == size] for size in sizes]
        self._groups = [
            BeadReadings(*(np.array(each) for each in zip(*group, strict=True))) for group in groups
        ]
        columns = np.arange(beads[0].loads.shape[1])
        self._of_passes = 0 * columns if tie.passes else columns
        self._of_beads = (0 * columns if tie.beads else columns) + 1 + self._of_passes[-1]
        self._told = told
        self._count = 1 + int(self._of_beads[-1] if told else self._of_passes[-1])
        self._least = np.where(np.arange(self._count) <= self._of_passes[-1], _LEAST**2, 0.0)

    def _covariance(self, variances: Floats, loads: Floats, own: Floats, noise: Floats) -> Floats:
        """Covariance of the readings of a bead, or of several of one size."""
        diagonal = own @ variances[self._of_passes] + noise
        covariance: Floats = diagonal[..., None, :] * np.eye(noise.shape[-1])
        if self._told:
            covariance += (loads * variances[self._of_beads]) @ loads.swapaxes(-1, -2)
        return covariance

    def _weighed(self, variances: Floats) -> tuple[float, list[Floats], Floats, Floats]:
        """Log det of the covariance, its inverse by group, X'V^-1 X and X'V^-1 y over all beads."""
        width = self._groups[0].fixed.shape[-1]
        logs, inverses = 0.0, list[Floats]()
        normal: Floats = np.zeros((width, width))
        right: Floats = np.zeros(width)
        for y, fixed, loads, own, noise in self._groups:
            covariance = self._covariance(variances, loads, own, noise)
            logs += float(np.sum(np.linalg.slogdet(covariance)[1]))
            inverses.append(np.asarray(np.linalg.inv(covariance), dtype=float))
            solved = inverses[-1] @ fixed
            normal += np.einsum("bnp,bnq->pq", fixed, solved)
            right += np.einsum("bnp,bn->p", solved, y)
        return logs, inverses, normal, right

    def deviance(self, variances: Floats) -> tuple[float, Floats]:
        """Minus twice the restricted log-likelihood, but for a constant, and its gradient.

        With P = V^-1 - V^-1 X (X'V^-1 X)^-1 X'V^-1 the derivative is tr(P dV) - y'P dV P y.
        """
        logs, inverses, normal, right = self._weighed(variances)
        means, spread = np.linalg.solve(normal, right), np.linalg.inv(normal)
        square, gradient = 0.0, np.zeros(self._count)
        for (y, fixed, loads, own, _), inverse in zip(self._groups, inverses, strict=True):
            left = y - fixed @ means
            pulled = np.einsum("bnm,bm->bn", inverse, left)  # P y
            square += float(np.sum(left * pulled))
            solved = inverse @ fixed
            projected = inverse - solved @ spread @ solved.swapaxes(1, 2)  # blocks of P
            each = np.diagonal(projected, axis1=1, axis2=2) - pulled**2
            np.add.at(gradient, self._of_passes, np.einsum("bnq,bn->q", own, each))
            if self._told:
                slopes = np.einsum("bnq,bnm,bmq->q", loads, projected, loads)
                slopes -= np.sum(np.einsum("bnq,bn->bq", loads, pulled) ** 2, axis=0)
                np.add.at(gradient, self._of_beads, slopes)
        return logs + float(np.linalg.slogdet(normal)[1]) + square, gradient

    @cached_property
    def best(self) -> tuple[Floats, float]:
        """Variances of greatest likelihood, and their deviance."""
        return self._least_deviance(np.full(self._count, _USUAL), np.ones(self._count, dtype=bool))

    def _least_deviance(self, start: Floats, free: npt.NDArray[np.bool_]) -> tuple[Floats, float]:
        """Variances of least deviance, of which only those that are free differ from the start."""
        variances = start.copy()

        def scaled(x: Floats) -> tuple[float, Floats]:
            variances[free] = x * _USUAL
            value, gradient = self.deviance(variances)
            return value, gradient[free] * _USUAL

        if not np.any(free):
            return variances, self.deviance(variances)[0]
        bounds = [(least / _USUAL, _MOST**2 / _USUAL) for least in self._least[free]]
        found = optimize.minimize(scaled, start[free] / _USUAL, jac=True, bounds=bounds)
        variances[free] = found.x * _USUAL
        return variances, float(found.fun)

    def components(self, factors: Floats | None = None) -> Components:
        """Standard deviations of greatest likelihood with the intervals of their profiles."""
        sds = np.sqrt(self.best[0])
        levels = float(stats.chi2.ppf(CONFIDENCE, 1)) * (np.ones(self._count) if factors is None else factors)
        ends = [self._ends(number, float(level)) for number, level in enumerate(levels)]
        passes, beads = self._of_passes.tolist(), self._of_beads.tolist()
        return Components(
            tuple(float(sds[k]) for k in passes),
            tuple(float(sds[k]) if self._told else 0.0 for k in beads),
            tuple(ends[k] for k in passes),
            tuple(ends[k] if self._told else (0.0, np.inf) for k in beads),
            self.means,
        )

    def squares(self, samples: Sequence[Floats]) -> Floats:
        """Forms y'P dV P y of the likeliest variances, (m, variances), of m samples (m, n) of each bead."""
        variances = self.best[0]
        inverses = [
            np.linalg.inv(self._covariance(variances, each.loads, each.own, each.noise))
            for each in self._beads
        ]
        normal = self._weighed(variances)[2]
        right = [y @ (inv @ each.fixed) for y, inv, each in zip(samples, inverses, self._beads, strict=True)]
        means = np.sum(right, axis=0) @ np.linalg.inv(normal)
        found = np.zeros((means.shape[0], self._count))
        for y, inverse, each in zip(samples, inverses, self._beads, strict=True):
            pulled = (y - means @ each.fixed.T) @ inverse
            np.add.at(found.T, self._of_passes, (pulled**2 @ each.own).T)
            if self._told:
                np.add.at(found.T, self._of_beads, ((pulled @ each.loads) ** 2).T)
        return found

    @property
    def spread(self) -> tuple[Floats, Floats]:
        """Standard deviations of the q deviations of a pass, and of a bead."""
        sds = np.sqrt(self.best[0])
        beads = sds[self._of_beads] if self._told else np.zeros(self._of_beads.size)
        return sds[self._of_passes], beads

    @property
    def means(self) -> Floats:
        """Fixed effects of greatest likelihood."""
        _, _, normal, right = self._weighed(self.best[0])
        return np.asarray(np.linalg.solve(normal, right), dtype=float)

    def _ends(self, number: int, rise: float) -> Ends:
        """Where the profile of the deviance is above its least value by `rise`."""
        variances, value = self.best
        level = value + rise
        free = np.arange(self._count) != number

        def above(sd: float) -> float:
            start = np.where(free, variances, sd**2)
            return self._least_deviance(start, free)[1] - level

        at, least = float(np.sqrt(variances[number])), float(np.sqrt(self._least[number]))
        low = least if at <= least or above(least) <= 0 else optimize.brentq(above, least, at, xtol=_FINE)
        high = _MOST if above(_MOST) <= 0 else optimize.brentq(above, max(at, least), _MOST, xtol=_FINE)
        return float(low), float(high)
