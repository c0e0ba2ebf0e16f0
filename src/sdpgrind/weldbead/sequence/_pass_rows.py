"""Expected costs of single passes, a row for each duration and force, on the nodes of a plan."""

from typing import Any, NamedTuple, Self

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp import Law
from sdpgrind.sdp.kernels import quick
from sdpgrind.weldbead.sequence._problem import SequenceProblem


class PassRows(NamedTuple):
    """Passes of given durations and forces: weights of cuts by whole cells, and charges at the nodes."""

    steps: Floats  # (rows,) stages
    duration: Floats  # (rows,) s
    force: Floats  # (rows,) N
    weight: Floats  # (rows, nodes)
    charge: Floats  # (rows, nodes), $

    @classmethod
    def of(cls, problem: SequenceProblem, duration: Floats, force: Floats, nodes: int) -> Self:
        """Return rows, s and N, of a problem whose deadline holds and whose last feed is not charged."""
        feed = np.array([problem.feed_rate(t) for t in duration.tolist()])
        law = problem.depths.cut(problem.model, force[:, None], feed[:, None])
        weight, charge = tables(problem, law, problem.height_max, nodes)
        return cls(np.rint(duration / problem.stage), duration, force, weight, charge)

    def expected(self, value: Floats) -> Floats:
        """Return the expected cost, $, of each row at the nodes, [row, node], with the values after it, $."""
        n = value.size
        padded = np.concatenate([np.zeros(n), value])
        padded[n] = 0.0  # at the target nothing is left to pay
        toeplitz = np.lib.stride_tricks.as_strided(padded[n:], (n, n), (-padded.itemsize, padded.itemsize))
        found: Floats = self.charge + self.weight @ toeplitz
        return found

    def some(self, which: Any) -> Self:
        """Return rows by a mask or numbers."""
        return type(self)(*(each[which] for each in self))


def tables(problem: SequenceProblem, law: Law, height: float, nodes: int) -> tuple[Floats, Floats]:
    """Weights and charges ($) of laws (..., 1) on nodes from the target to a height (mm), a row for each law.

    Weights are second differences of E (y - D)+ : values after the pass are straight between nodes.
    """
    cell = height / (nodes - 1)
    law = quick(law)
    under = law.under(cell * np.arange(-1, nodes + 1)).reshape(-1, nodes + 2)
    over = problem.height_charge.over
    assert over is not None  # required of a problem
    charge = over.expected_over(law, np.linspace(0.0, height, nodes)).reshape(-1, nodes)
    return np.diff(under, 2) / cell, problem.pass_charge + charge
