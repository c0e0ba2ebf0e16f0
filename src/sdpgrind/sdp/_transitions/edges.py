"""Mass that leaves the grid of a falling coordinate: probability and exact charge."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.coordinates import Axis
from sdpgrind.sdp._problem.one_sided import Constant, Linear, OneSided, Quadratic
from sdpgrind.sdp._problem.problem import Problem

LEAK = 1e-12  # chosen: probability of a refused exit that counts as rounding; larger hides real exits


def passed(axis: Axis, x: Any) -> Iterator[tuple[Any, Any, float]]:
    """Yield for both ends of an axis: mask of coordinates beyond it, its edge, and its place.

    An edge that is a number holds from the end itself on (the compiled step does the same).
    """
    for outward, edge, end in ((-1, axis.below, axis.low), (1, axis.above, axis.high)):
        gone = outward * (x - end) > 0
        yield (gone if isinstance(edge, str) else gone | (x == end)), edge, end


def beyond(charge: OneSided, start: float) -> list[OneSided]:
    """Return charges of ``z - start`` with the sum ``charge(z)`` for z > start >= 0, and 0 before."""
    if charge.tolerance >= start:
        return [_moved(charge, charge.tolerance - start)]
    jump: list[OneSided] = [Constant(float(charge(start)))]
    if isinstance(charge, Linear):
        return [*jump, Linear(charge.rate)]
    if isinstance(charge, Quadratic):
        return [*jump, Linear(2 * charge.factor * (start - charge.tolerance)), Quadratic(charge.factor)]
    return jump


def _moved(charge: OneSided, tolerance: float) -> OneSided:
    assert isinstance(charge, Constant | Linear | Quadratic)  # all one-sided charges
    return charge.replace(tolerance=tolerance)


@dataclass(frozen=True)
class Exit:
    """One end of an axis, for mass beyond it.

    `sign` is +1 for the low end (the amount is too large) and -1 for the high end (too small).
    """

    edge: Any
    place: float
    sign: int
    parts: tuple[OneSided, ...] = ()

    @classmethod
    def low(cls, problem: Problem, axis: Axis) -> "Exit":
        """Return the low end."""
        return cls(axis.below, axis.low, 1, _parts(problem, axis.below, -axis.low, "over"))

    @classmethod
    def high(cls, problem: Problem, axis: Axis) -> "Exit":
        """Return the high end."""
        return cls(axis.above, axis.high, -1, _parts(problem, axis.above, axis.high, "under"))

    def probability(self, law: Law, x: Any) -> Floats:
        """P(x - D lies beyond this end)."""
        y = np.subtract(x, self.place)
        return law.over(y, 0) if self.sign > 0 else law.under(np.nextafter(y, -np.inf), 0)

    def charge(self, law: Law, x: Any, probability: Floats | float = 0.0) -> Floats | float:
        """Expected charge of the mass beyond, $: the stop's, or the given value-to-go by `probability`."""
        if self.edge == "stop":
            y = np.subtract(x, self.place)
            return sum(
                (p.expected_over(law, y) if self.sign > 0 else p.expected_under(law, y) for p in self.parts),
                0.0,
            )
        return 0.0 if isinstance(self.edge, str) else self.edge * probability

    def full_hat(self, law: Law, x: Any, h: float, probability: Floats) -> Floats:
        """Part of the end node's hat function beyond the end: E (1 - distance/h)+ there."""
        y = np.subtract(x, self.place)
        if self.sign > 0:
            return probability - (law.over(y) - law.over(y + h)) / h
        return probability - (law.under(y) - law.under(y - h)) / h


def _parts(problem: Problem, edge: Any, start: float, side: str) -> tuple[OneSided, ...]:
    if edge != "stop":
        return ()
    charge = problem.stops[0].charge
    assert isinstance(charge, Charge)  # checked by Problem
    one = getattr(charge, side)
    if start < 0 or not isinstance(one, OneSided):
        raise ValueError(
            f"the edge 'stop' needs a Charge with a Constant, Linear or Quadratic {side} side "
            f"and its target on the axis; got {charge!r}"
        )
    return tuple(part for part in beyond(one, start) if not part.zero)
