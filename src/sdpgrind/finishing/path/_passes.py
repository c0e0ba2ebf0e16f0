"""One pass over the unit square: c as a function of s, with nodes along it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from sdpgrind.base.checks import Floats


@dataclass(frozen=True)
class PathPass:
    """A pass through nodes (s, c) with rising s; straight where `curve` is None."""

    s: Floats
    c: Floats
    curve: CubicSpline | None = None

    @classmethod
    def straight(cls, s: Floats, c: float) -> Self:
        """Return a pass at a constant c."""
        return cls(s, np.full(s.size, c))

    @classmethod
    def curved(cls, s: Floats, curve: CubicSpline) -> Self:
        """Return a pass on a curve."""
        return cls(s, np.asarray(curve(s)), curve)

    def at(self, s: Floats) -> Floats:
        """Return the place across."""
        return np.full(np.shape(s), self.c[0]) if self.curve is None else np.asarray(self.curve(s))

    def slope(self, s: float) -> float:
        """Return the derivative dc/ds."""
        return 0.0 if self.curve is None else float(self.curve(s, 1))
