"""Charge of a stop that is bent within cells, as numbers for an export."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.sdp._policy.bent_kernels import BentStop, Side
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.one_sided import Constant, Linear, Quadratic


def bent_stop(solution: Solution) -> BentStop | None:
    """Return the stop of a policy; None: its charge is straight in all cells in which it may stop.

    Raises
    ------
    ValueError
        When the charge ($) is a function in Python.
    """
    if not solution.bent.any():
        return None
    layout, count, charge = solution.layout, solution.countdown, solution.layout.edge_charge
    (axis,) = layout.axes  # linear: the target 0 lies on it
    late = [
        0.0 if count.in_base(row) else float(count.late(count.time(row))) for row in range(len(solution.bent))
    ]
    return BentStop(
        solution.bent.astype(np.int8),
        float(axis.low),
        float(solution.grid.spacing[0]),
        _side("under", charge),
        _side("over", charge),
        np.array(layout.edge_extra, dtype=float),
        np.array(late),
    )


def _side(name: str, charge: Any) -> Side:
    """Factor, tolerance and power of one side."""
    side = getattr(charge, name)
    if side is None:
        return Side(0.0, 0.0, 0)
    if type(side) is Constant:  # exactly: a class made from it may charge otherwise
        return Side(side.amount, side.tolerance, 0)
    if type(side) in (Linear, Quadratic):
        return Side(side._factor, side.tolerance, side._power)
    rule = "a policy with a stop that is charged by sdp.Constant, sdp.Linear or sdp.Quadratic"
    raise checks.refuse("thing", rule, f"{name} {type(side).__name__}")
