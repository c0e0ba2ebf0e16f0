"""Results of moves: the best of each at grid nodes, and exact one-step distributions from any points."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._transitions.edges import Exit, beyond


@dataclass(frozen=True)
class RowsFound:
    """Best of each move: expectation ($), control and entry of the lists, each [move, mode or 0, node]."""

    q: Floats
    control: Floats
    entry: npt.NDArray[np.int32]


@dataclass(frozen=True)
class Tail:
    """Mass that left the grid into a stop, for the exact distribution of its charge."""

    end: Exit
    law: Law
    x: Floats

    def excess(self, level: float) -> Floats:
        """Return E (charge - level)+ over the mass that left, for each point, $; `level` may be < 0."""
        y = np.subtract(self.x, self.end.place)
        if level <= 0:
            gone = self.end.probability(self.law, self.x)
            return np.asarray(self.end.charge(self.law, self.x, gone) - level * gone)
        start = self._distance(level)
        if not np.isfinite(start):
            return np.zeros(self.x.shape)
        place = y + self.end.sign * start
        moment = "expected_over" if self.end.sign > 0 else "expected_under"
        pieces = [piece for part in self.end.parts for piece in beyond(part, start)]
        passed = self.law.over(place, 0) if self.end.sign > 0 else self.law.under(place, 0)
        return np.asarray(sum(getattr(piece, moment)(self.law, place) for piece in pieces) - level * passed)

    def _distance(self, level: float) -> float:
        """Distance beyond the end at which the charge reaches `level`; inf: never."""

        def over(z: float) -> float:
            return float(sum(part(z) for part in self.end.parts)) - level

        if over(1e-300) >= 0:
            return 0.0
        reach = 1.0
        while over(reach) < 0:
            reach *= 2
            if reach > 1e9:
                return float("inf")
        return float(brentq(over, 0.0, reach, xtol=1e-15))


@dataclass(frozen=True)
class Rows:
    """One-step distribution from P points.

    Attributes
    ----------
    matrix : array or sparse array (P, nodes)
        Probability weights on the nodes.
    mode : int array (P,)
        Mode on arrival.
    charge : array (P,)
        Expected charge in the path and beyond the edges, $.
    stopped : array (P,)
        Probability of ending beyond a stopping edge.
    tails : tuple of Tail
        Exits of a falling coordinate.
    """

    matrix: Any
    mode: Ints
    charge: Floats
    stopped: Floats
    tails: tuple[Tail, ...] = ()

    def select(self, kept: Any) -> "Rows":
        """Return weights (1) and charges ($) of the points in the mask `kept`, without tails."""
        return Rows(self.matrix[kept], self.mode[kept], self.charge[kept], self.stopped[kept])

    def expect(self, value: Floats, level: Floats) -> Floats:
        """Return E value(next) + charges, (P,), $; `value` [mode, node], `level` [mode] of stops."""
        inner = np.empty(self.mode.shape)
        for mode in np.unique(self.mode):
            chosen = self.mode == mode
            inner[chosen] = self.matrix[chosen] @ value[mode]
        return np.asarray(inner + self.charge + self.stopped * level[self.mode])

    def spread(self, probability: Floats, modes: int) -> Floats:
        """Return the distribution [mode, node] in `modes` modes after the step, by `probability` (1)."""
        after = np.zeros((modes, self.matrix.shape[1]))
        for mode in np.unique(self.mode):
            chosen = self.mode == mode
            after[mode] = probability[chosen] @ self.matrix[chosen]
        return after
