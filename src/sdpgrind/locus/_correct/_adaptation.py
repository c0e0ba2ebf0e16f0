"""What modifier adaptation has learned, and the signs by which it moves controls to learn it."""

from math import nan

import numpy as np

from sdpgrind.base.checks import Floats


def pattern(n: int) -> Floats:
    """Signs (2^(n+1), n) for n directions: columns are orthogonal to each other, to their products and to a trend.

    Column i is the product of the signs of binary digits i to n + 1 of the row; the first is the sequence of Thue and Morse.
    """
    rows = np.arange(2 ** (n + 1))
    digits = np.array([1.0 - 2.0 * (rows >> (n - j) & 1) for j in range(n + 1)])
    return np.array([np.prod(digits[i:], axis=0) for i in range(n)]).T


class Adaptation:
    """What changes from sample to sample."""

    def __init__(self, n: int, hidden: float, center: Floats):
        self.hidden, self.bias, self.center = hidden, 0.0, center
        self.constraint, self.cost, self.reference = np.zeros(n), np.zeros(n), np.zeros(n)
        self.units, self.directions, self.signs, self.row = np.eye(n), np.empty((n, 0)), np.empty((0, 0)), 0
        self.rows: list[tuple[float, ...]] = []
        self.slack, self.failures, self.command, self.believed = nan, 0, center, hidden

    def modifiers(self) -> Floats:
        """As `Modified` takes them."""
        return np.concatenate([[self.hidden, self.bias - self.constraint @ self.reference], self.constraint, self.cost])
