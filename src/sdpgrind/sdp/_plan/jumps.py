"""Places where the charge of a stop jumps, next to which an error need not fall with the cells."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.one_sided import Constant
from sdpgrind.sdp._problem.problem import Problem

ROUNDING = 1e-9  # cells; chosen: above the rounding of positions, below any tested place in a cell


def jumps(problem: Problem) -> tuple[float, ...]:
    """Return where on the axis of a `Charge` (in its unit) it jumps."""
    if not problem.axes:
        return ()
    axis = problem.axes[problem.stop_axis]
    return tuple(place for place in sorted(set(_places(problem))) if axis.low <= place <= axis.high)


def spreads(problem: Problem) -> bool:
    """Whether a charge jumps where the table interpolates: it is then felt from wherever a move ends there.

    What is charged below 0 is integrated exactly.
    """
    sides = (stop.charge.under for stop in problem.stops if isinstance(stop.charge, Charge))
    return any(isinstance(side, Constant) and not side.zero for side in sides)


def _places(problem: Problem) -> Iterator[float]:
    for stop in problem.stops:
        if isinstance(charge := stop.charge, Charge):
            for side, sign in ((charge.under, 1.0), (charge.over, -1.0)):
                if isinstance(side, Constant) and not side.zero:
                    yield sign * side.tolerance


def away(problem: Problem, grid: Grid, index: Floats, cells: float = 1.0) -> npt.NDArray[np.bool_]:
    """Return whether positions `index` (cells), [axis, place], are more than some cells off all jumps."""
    axis, far = problem.stop_axis, np.ones(index.shape[1:], bool)
    for place in jumps(problem):
        far &= np.abs(index[axis] - grid.index(axis, place)) > cells + ROUNDING
    return far
