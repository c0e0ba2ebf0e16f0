"""Gauss's rule, kept: its nodes are the eigenvalues of a matrix, dearer than most sums that use them."""

from functools import lru_cache

import numpy as np

from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats


@lru_cache
def leggauss(points: int) -> tuple[Floats, Floats]:
    """Nodes in (-1, 1) and weights of the Gauss-Legendre rule, read-only."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return lasting(nodes), lasting(weights)
