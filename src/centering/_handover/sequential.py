"""Statistics that watch a row of standardised values, and how long they run until they alarm.

Run lengths and probabilities are those of the Markov chain of the statistic: its density is carried from value to value by Gauss
and Legendre's quadrature, which is exact to all digits that matter here, as the densities are smooth.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import log, pi, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from sdpgrind.base.checks import Floats

NODES = 48
"""Of the quadrature: twice as many change no run length below 1e6 by 1e-9."""


class Cusum:
    """Two-sided cumulative sum of standardised values: each side adds what exceeds `allowance`, and forgets at 0.

    ``up <- max(0, up + z - allowance)``, and the same of ``-z`` for `down`; more than `limit` is an alarm (Page 1954).
    """

    def __init__(self, allowance: float, limit: float) -> None:
        self.allowance, self.limit = allowance, limit
        self.reset()

    def reset(self) -> None:
        """Start at 0, where an alarm takes longest."""
        self.up = self.down = 0.0

    def update(self, value: float) -> int:
        """Take in one value; 1 or -1 is an alarm, and says which way, 0 is none."""
        self.up = max(0.0, self.up + value - self.allowance)
        self.down = max(0.0, self.down - value - self.allowance)
        if max(self.up, self.down) <= self.limit:
            return 0
        return 1 if self.up >= self.down else -1


def cusum_run_length(allowance: float, limit: float) -> float:
    """Mean number of values until a two-sided sum alarms by mistake: both sides are alike, and their rates add (Kemp 1961)."""
    stay = _cusum_step(allowance, limit, 0.0)
    return float(_run_length(stay)[0]) / 2


@lru_cache(maxsize=64)
def cusum_limit(allowance: float, run_length: float) -> float:
    """Limit of a two-sided sum that alarms by mistake once in `run_length` values on average."""
    siegmund = log(4 * allowance**2 * run_length) / (2 * allowance) - 1.166  # near it, where the run is long
    found = brentq(lambda limit: log(cusum_run_length(allowance, limit) / run_length), 0.0, max(siegmund, 0.0) + 1.0, xtol=1e-10)
    return float(found)


def cusum_detection(allowance: float, limit: float, means: Sequence[float]) -> float:
    """Probability that a sum that stands at 0 alarms while values of these means come in, on the side where they are.

    A sum that stands higher when the change comes alarms sooner: this is the least probability.
    """
    density = np.zeros(NODES + 1)
    density[0] = 1.0
    for mean in means:
        density = density @ _cusum_step(allowance, limit, mean)
    return float(1 - density.sum())


def _cusum_step(allowance: float, limit: float, mean: float) -> Floats:
    """Probabilities that one side goes from node to node without alarm; the first node is 0 itself, where it may stay."""
    nodes, weights = _nodes(0.0, limit)
    start = np.concatenate([[0.0], nodes])[:, None]
    back = ndtr(allowance - mean - start)
    return np.hstack([back, weights * _density(nodes - start + allowance - mean)])


def ewma_run_length(weight: float, limit: float) -> float:
    """Mean number of values until an average ``e <- (1 - weight) e + weight z`` leaves +-`limit` by mistake (Crowder 1987)."""
    nodes, weights = _nodes(-limit, limit)
    start = np.concatenate([[0.0], nodes])[:, None]
    stay = weights * _density((nodes - (1 - weight) * start) / weight) / weight
    return float(_run_length(np.hstack([np.zeros_like(start), stay]))[0])


def ewma_sd(weight: float) -> float:
    """Standard deviation that the average of independent standardised values settles to."""
    return sqrt(weight / (2 - weight))


def _run_length(stay: Floats) -> Floats:
    """Mean steps until a chain is left, from each of its states."""
    return np.asarray(np.linalg.solve(np.eye(len(stay)) - stay, np.ones(len(stay))))


def _nodes(low: float, high: float) -> tuple[Floats, Floats]:
    """Nodes and weights of the quadrature over an interval."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * (high - low)
    return low + half * (nodes + 1), half * weights


def _density(value: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * value**2) / sqrt(2 * pi))
