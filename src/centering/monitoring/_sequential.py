"""Cumulative sum and weighted average of standardised values, and their run lengths.

Run lengths and probabilities are those of the statistic's Markov chain: Gauss-Legendre quadrature carries its
density from value to value, to all relevant digits, as the densities are smooth.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import isnan, log, pi, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaln, ndtr, roots_genlaguerre, stdtrit

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss

NODES = 48  # measured: nodes of the quadrature; twice as many change no run length below 1e6 by 1e-9
_VARIANCES = 12  # measured: nodes over the learned variance; twice as many change the rate of alarms by 1e-4


def is_missing(value: object) -> bool:
    """Whether a value is NaN of any kind of float: no reading."""
    return isinstance(value, float | np.floating) and isnan(value)


class Cusum:
    """Two-sided cumulative sum (Page 1954) of standardised values.

    ``up <- max(0, up + z - reference)``, and with ``-z`` for `down`; above `limit` is an alarm.
    """

    def __init__(self, reference: float, limit: float) -> None:
        self.reference, self.limit = reference, limit
        self.reset()

    def reset(self) -> None:
        """Start at 0."""
        self.up = self.down = 0.0

    def update(self, value: float) -> int:
        """Add one value; 1 or -1: alarm and its direction, 0: none."""
        self.up = max(0.0, self.up + value - self.reference)
        self.down = max(0.0, self.down - value - self.reference)
        if max(self.up, self.down) <= self.limit:
            return 0
        return 1 if self.up >= self.down else -1


def cusum_run_length(reference: float, limit: float) -> float:
    """Mean run length of a two-sided sum until a false alarm: the rates of both sides add (Kemp 1961)."""
    stay = _cusum_step(reference, limit, 0.0)
    return float(_run_length(stay)[0]) / 2


@lru_cache(maxsize=64)
def cusum_limit(reference: float, run_length: float) -> float:
    """Limit of a two-sided sum with one false alarm in `run_length` values on average."""
    siegmund = log(4 * reference**2 * run_length) / (2 * reference) - 1.166  # approximation for long runs
    found = brentq(
        lambda limit: log(cusum_run_length(reference, limit) / run_length),
        0.0,
        max(siegmund, 0.0) + 1.0,
        xtol=1e-10,
    )
    return float(found)


@lru_cache(maxsize=64)
def learned_widening(reference: float, run_length: float, freedom: int) -> float:
    """Rise of the limit needed with a learned noise, times the number of values that the noise is based on.

    A standard deviation learned too small makes all scores of a sum too large together, although Student's
    distribution is right for each: the rate of alarms is its mean over the learned values. The rise is
    inversely proportional to the number of values, to a few per cent from 20 on; `freedom`, the least number,
    gives the largest product.
    """
    known = cusum_limit(reference, run_length)

    def excess(more: float) -> float:
        return log(_learned_rate(reference, known + more / freedom, freedom) * run_length)

    most = 1.0
    while excess(most) > 0:
        most *= 2
    return float(brentq(excess, 0.0, most, xtol=1e-3))


def _learned_rate(reference: float, limit: float, freedom: int) -> float:
    """Rate of alarms of a two-sided sum of Student scores, mean over the learned noise."""
    half_square, weights = roots_genlaguerre(_VARIANCES, freedom / 2 - 1)
    nodes, lengths = _nodes(0.0, limit)
    score = np.concatenate([[0.0], nodes]) - np.concatenate([[0.0], nodes])[:, None] + reference
    value = -np.sign(score) * stdtrit(freedom, np.maximum(ndtr(-np.abs(score)), 1e-300))
    slope = _density(score) / _student_density(value, freedom)
    rates = []
    for found in np.sqrt(2 * half_square / freedom):  # learned over true standard deviation
        stay = np.hstack(
            [ndtr(found * value[:, :1]), lengths * found * (slope * _density(found * value))[:, 1:]]
        )
        rates.append(2 / _run_length(stay)[0])
    return float(np.array(rates) @ weights / weights.sum())


def _student_density(value: Floats, freedom: int) -> Floats:
    constant = gammaln((freedom + 1) / 2) - gammaln(freedom / 2) - log(freedom * pi) / 2
    return np.asarray(np.exp(constant - (freedom + 1) / 2 * np.log1p(value**2 / freedom)))


def cusum_detection(reference: float, limit: float, means: Sequence[float]) -> float:
    """Probability that one side of a sum at 0 alarms during values of the given means.

    A lower bound: a higher sum alarms sooner.
    """
    density = np.zeros(NODES + 1)
    density[0] = 1.0
    for mean in means:
        density = density @ _cusum_step(reference, limit, mean)
    return float(1 - density.sum())


def _cusum_step(reference: float, limit: float, mean: float) -> Floats:
    """Transition probabilities of one side between nodes without alarm; the first node is 0, an atom."""
    nodes, weights = _nodes(0.0, limit)
    start = np.concatenate([[0.0], nodes])[:, None]
    back = ndtr(reference - mean - start)
    return np.hstack([back, weights * _density(nodes - start + reference - mean)])


def ewma_run_length(weight: float, limit: float) -> float:
    """Mean run length of ``e <- (1 - weight) e + weight z`` until it leaves +-`limit` (Crowder 1987)."""
    nodes, weights = _nodes(-limit, limit)
    start = np.concatenate([[0.0], nodes])[:, None]
    stay = weights * _density((nodes - (1 - weight) * start) / weight) / weight
    return float(_run_length(np.hstack([np.zeros_like(start), stay]))[0])


def ewma_sd(weight: float) -> float:
    """Stationary standard deviation of the average of independent standardised values."""
    return sqrt(weight / (2 - weight))


def _run_length(stay: Floats) -> Floats:
    """Mean number of steps until a chain is left, from each of its states."""
    return np.asarray(np.linalg.solve(np.eye(len(stay)) - stay, np.ones(len(stay))))


def _nodes(low: float, high: float) -> tuple[Floats, Floats]:
    """Nodes and weights of the quadrature over an interval."""
    nodes, weights = leggauss(NODES)
    half = 0.5 * (high - low)
    return low + half * (nodes + 1), half * weights


def _density(value: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * value**2) / sqrt(2 * pi))
