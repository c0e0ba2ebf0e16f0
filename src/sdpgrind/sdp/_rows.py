"""Exact one-step distributions from arbitrary points: what a move with given controls leads to."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._edges import Exit
from sdpgrind.sdp._grid import Ints
from sdpgrind.sdp._law import Law


@dataclass(frozen=True)
class Tail:
    """Where mass left the grid into a stop: enough to get the exact distribution of its charge."""

    end: Exit
    law: Law
    x: Floats

    def excess(self, level: Floats) -> Floats:
        """E (charge - level)+ over what left, for P points, `level` ($) being one number for each (it may be negative)."""
        y = self.x - self.end.place
        gone = self.end.probability(self.law, self.x)
        total = self.end.charge(self.law, self.x, gone) - np.minimum(level, 0.0) * gone
        for k in np.flatnonzero(level > 0):
            total[k] = self._excess_above(k, y, float(level[k]))
        return np.asarray(total)

    def _excess_above(self, k: int, y: Floats, level: float) -> float:
        """Charges are convex sums here, so search the distance at which they pass the level, then add the moments beyond."""
        from scipy.optimize import brentq

        def over(z: float) -> float:
            return float(sum(part(z) for part in self.end.parts)) - level

        reach = 1.0
        while over(reach) < 0 and reach < 1e12:
            reach *= 2
        if reach >= 1e12:
            return 0.0
        start = 0.0 if over(1e-300) >= 0 else brentq(over, 0.0, reach, xtol=1e-15)
        from sdpgrind.sdp._edges import beyond

        place = y[k] + self.end.sign * start
        pieces = [piece for part in self.end.parts for piece in beyond(part, start)]
        moment = "expected_over" if self.end.sign > 0 else "expected_under"
        beyond_level = sum(getattr(piece, moment)(self.law, place) for piece in pieces)
        probability = self.law.over(place, 0) if self.end.sign > 0 else self.law.under(place, 0)
        return float(np.broadcast_to(beyond_level - level * probability, self.x.shape)[k])


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
        Expected in-path charge and charge beyond the edges, $.
    stopped : array (P,)
        Probability of ending beyond a stopping edge.
    tails : tuple of Tail
        The exits of a falling coordinate.
    """

    matrix: Any
    mode: Ints
    charge: Floats
    stopped: Floats
    tails: tuple[Tail, ...] = ()

    def expect(self, value: Floats, level: Floats) -> Floats:
        """Return E value(next) + charges, (P,), for value[mode, node] and the stops' further charge level[mode]."""
        inner = np.empty(self.mode.shape)
        for mode in np.unique(self.mode):
            chosen = self.mode == mode
            inner[chosen] = self.matrix[chosen] @ value[mode]
        return inner + self.charge + self.stopped * level[self.mode]

    def spread(self, probability: Floats, modes: int) -> Floats:
        """Return the distribution [mode, node] after the step, from probabilities (P,) of the points."""
        after = np.zeros((modes, self.matrix.shape[1]))
        for mode in np.unique(self.mode):
            chosen = self.mode == mode
            after[mode] = probability[chosen] @ self.matrix[chosen]
        return after
