"""Results of moves: the best of each at grid nodes, and exact one-step distributions from any points."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.one_sided import OneSided
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
        start = _distance(self.end.parts, level)
        if not np.isfinite(start):
            return np.zeros(self.x.shape)
        place = y + self.end.sign * start
        moment = "expected_over" if self.end.sign > 0 else "expected_under"
        pieces = [piece for part in self.end.parts for piece in beyond(part, start)]
        over = sum(getattr(piece, moment)(self.law, place) for piece in pieces)
        return np.asarray(over - level * self._passed(start))

    def exceeds(self, level: float) -> Floats:
        """Return P(charge > level) of the mass that left, for each point; `level` in $ may be < 0."""
        if level < 0:
            return self.end.probability(self.law, self.x)
        start = _distance(self.end.parts, level)
        return self._passed(start) if np.isfinite(start) else np.zeros(self.x.shape)

    def _passed(self, distance: float) -> Floats:
        """Probability of passing the end by more than a distance, for each point."""
        place = np.subtract(self.x, self.end.place) + self.end.sign * distance
        return self.law.over(place, 0) if self.end.sign > 0 else self.law.under(place, 0)


@lru_cache(maxsize=256)  # moves that leave by one end share it
def _distance(parts: tuple[OneSided, ...], level: float) -> float:
    """Distance beyond an end from which the sum of its charges is above `level`, $ >= 0; inf: nowhere."""

    def above(z: float) -> float:
        return float(sum(part(z) for part in parts)) - level or -5e-324  # equal is not above

    if above(1e-300) > 0:
        return 0.0
    reach = 1.0
    while above(reach) < 0:
        reach *= 2
        if reach > 1e9:
            return float("inf")
    return float(brentq(above, 0.0, reach, xtol=1e-15))


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
