"""Plan: all optima of a problem over the whole range of its hidden states."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress, ProgressOption, reporting
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.locus import Locus
from sdpgrind.locus._curve.nowhere import nearest
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System, system_of
from sdpgrind.locus._trace.cheapest import cheapest, is_degenerate
from sdpgrind.locus._trace.grid import trace_grid
from sdpgrind.locus._trace.pieces import counts, pieces, tabulate
from sdpgrind.locus._trace.trace import ROUNDING, Branch, Tracer

POINTS = 200  # chosen: fewer leave a coarse table, more cost time
TRACED = 0.2, 0.7  # chosen: shares of progress at which tracing begins and the table
SIGN = 1e-9  # chosen: slope by the hidden state, relative to the largest; less is rounding and has no sign


@reporting
def plan(problem: Problem, *, points: int = POINTS, progress: ProgressOption = None) -> Any:
    """Find all optima over the range of the hidden states, Koren (11)-(13).

    Searches start at several hidden states from all minima of a lattice. Pseudo-arclength continuation with
    exact derivatives follows each optimum through changes of the active set to a fold or the end of
    feasibility. The cheapest of overlapping branches is global; a change between branches is a jump.

    Parameters
    ----------
    problem : Problem
        The problem, in the user's units.
    points : int
        Approximate number of points of the table.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Locus or Area
        Curve for one hidden state, area for several; its `error`, a scaled residual, is at most 1e-10.

    Raises
    ------
    ValueError
        When hidden states outnumber constraints, a slope by a state changes sign, or all is infeasible.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> problem = locus.Problem(
    ...     controls={"u": (0.0, 5.0), "v": (0.0, 10.0)},
    ...     hidden={"x": (0.2, 20.0)},
    ...     cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
    ...     constraints=[
    ...         locus.Varying(
    ...             response=lambda s, c: s.x * c.v + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v
    ...         )
    ...     ],
    ... )
    >>> curve = locus.plan(problem)
    >>> for piece in curve.pieces:
    ...     print(piece)
    Piece(interior: nothing active; 0.2 to 0.5; range to response active)
    Piece(locus: response; 0.5 to 20; response active to range)
    >>> point = curve.at(x=1.0)
    >>> {name: round(value, 9) for name, value in point.controls.items()}, round(point.response, 9)
    ({'u': 2.0, 'v': 3.0}, 7.0)
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, Problem, " (see locus.preset)")
    checks.count("points", points, 2)
    _check_counts(problem)
    progress(0.0, "the system and its derivatives")
    system = system_of(problem)
    _check_signs(problem, system)
    progress(TRACED[0], "tracing the optima")
    found = _area(problem) if system.h > 1 else _curve(problem, system, points, progress)
    progress(1.0, "planned")
    return found


def _curve(problem: Problem, system: System, points: int, tell: Progress) -> Locus:
    """Trace and tabulate a curve over one hidden state."""
    tracer = Tracer(system, np.zeros(1))
    branches, degenerate = tracer.branches(), False
    if is_degenerate(tracer, branches):
        system = system_of(problem, tie=True)
        tracer = Tracer(system, np.zeros(1))
        branches, degenerate = tracer.branches(), True
    if not branches:
        raise ValueError(_alike(problem) if degenerate else _nowhere(problem, system))
    tell(TRACED[1], "the table of the optima")
    runs = list(marked(tracer, branches))
    sizes = counts([run for run, _ in runs], points)
    table = tabulate(tracer, [run for run, _ in runs], sizes)
    return Locus(problem, table, pieces(problem, runs, table, sizes), degenerate)


def _area(problem: Problem) -> Area:
    system = system_of(problem)
    grid, flat = trace_grid(system)
    if flat:
        system = system_of(problem, tie=True)
        grid, _ = trace_grid(system)
    if not np.any(np.isfinite(grid.residual)):
        raise ValueError(_nowhere(problem, system))
    return Area(problem, grid, degenerate=flat)


def marked(tracer: Tracer, branches: list[Branch]) -> Any:
    """Yield all runs, cut where the cheapest branch changes, and whether each is the cheapest."""
    parts = cheapest(tracer, branches)
    for b, branch in enumerate(branches):
        own = [(low, high) for low, high, best in parts if best == b]
        ends = sorted({end for part in own for end in part})
        for run in branch:
            for piece in tracer.cut(
                run, [end for end in ends if run.low + ROUNDING < end < run.high - ROUNDING]
            ):
                middle = 0.5 * (piece.low + piece.high)
                yield piece, any(low <= middle <= high for low, high in own)


def _check_counts(problem: Problem) -> None:
    h, m = len(problem.hidden), len(problem.varying)
    if h > m:
        raise ValueError(
            f"hidden must be no more states than there are measured constraints, {m}: no measurement tells"
            f" more apart; got {h}: {', '.join(problem.hidden)}"
        )


def _check_signs(problem: Problem, system: System) -> None:
    """Refuse slopes of a constraint by a hidden state that change sign or vanish everywhere."""
    slopes = system.slopes_by_hidden
    for k, hidden in enumerate(problem.hidden_names):
        for j, name in enumerate(system.responses):
            _check_sign(name, hidden, slopes[:, j, k])
        if not np.any(np.abs(slopes[:, :, k]) > 0):
            raise ValueError(
                f"hidden states must be seen in what is measured; nothing of it depends on {hidden}"
            )


def _check_sign(name: str, hidden: str, slopes: Floats) -> None:
    known = slopes[np.isfinite(slopes)]
    small = SIGN * np.max(np.abs(known), initial=0.0)
    if np.any(known > small) and np.any(known < -small):
        raise ValueError(
            "hidden states must move a constraint one way all over the ranges;"
            f" response - limit of {name} rises with {hidden} at some controls and falls at others:"
            " narrow the ranges, or split the problem"
        )


def _alike(problem: Problem) -> str:
    """Message: cost and slack of several points are equal."""
    names = ", ".join(problem.names)
    return f"cost must single out a point: over {names} many cost the same, and leave the same slack"


def _nowhere(problem: Problem, system: System) -> str:
    """Message: no feasible point, and how far off the nearest is."""
    given = ", ".join(f"{name} = {low:g} to {high:g}" for name, (low, high) in problem.hidden.items())
    told = f"constraints must leave a feasible point at some hidden state; none was found over {given}"
    return f"{told}{nearest(problem, system)}"
