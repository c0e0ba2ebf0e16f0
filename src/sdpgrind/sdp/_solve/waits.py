"""Lines of moves that only wait, through the kinks of the stage at which they end.

A move that leaves the state as it is costs what the value-to-go after it does. Where the action changes
there, inside the cell, a straight line from node to node lies below it, by a quarter of the cell times the
change of slope: first order. Such a line is replaced by those of the stage after the wait.
"""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._solve.kernels import TIE_ABS
from sdpgrind.sdp._solve.kinks import Lines
from sdpgrind.sdp._solve.steps import Steps
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.shift import Shift


class _Line(NamedTuple):
    """One line of cost: its action, and cost ($) and control at both ends of the cell."""

    act: int
    entry: Ints
    control: Floats
    cost: Floats


STILL = 1e-9  # chosen: mean and sd of a wait, cells; larger ones are cuts
Cell = tuple[int, int, int]


def through_waits(lines: Lines, steps: Steps) -> Lines:
    """Return the lines with those of waits replaced, where the cell has kinks after the wait, too."""
    waits = _waits(lines, steps)
    if not waits.any():
        return lines
    known: dict[Cell, list[_Line]] = {}
    for k in np.argsort(lines.row, kind="stable").tolist():
        cell = int(lines.row[k]), int(lines.mode[k]), int(lines.cell[k])
        line = _Line(int(lines.act[k]), lines.entry[k], lines.control[k], lines.cost[k])
        onward = _onward(cell, line, known, steps) if waits[k] else [line]
        known.setdefault(cell, []).extend(onward)
    return _joined(known)


def _waits(lines: Lines, steps: Steps) -> Any:
    """Mask of lines of shifts by nothing: with one control, and one cost beyond that after it."""
    out = np.zeros(lines.act.size, bool)
    for k, move in enumerate(steps.problem.moves):
        here = np.flatnonzero((lines.act == k) & (lines.control[:, 0] == lines.control[:, 1]))
        if isinstance(move.to, Shift) and here.size:
            here = here[_parallel(lines.select(here), k, steps)]
            out[here] = _still(lines.select(here), k, move.to, steps)
    return out


def _parallel(lines: Lines, k: int, steps: Steps) -> Any:
    """Mask of lines of the move `k` that cost as much more than the value-to-go after it at both ends."""
    menu, extra = Menu(steps.problem, steps.grid, k), np.full(lines.cost.shape, np.nan)
    after = lines.mode if menu.into is None else menu.into[lines.entry[:, 0]]
    for row in np.unique(lines.row):
        end = steps.countdown.arrival(int(row), menu.move.duration)
        if end is not None:
            here = lines.row == row
            node = lines.cell[here, None] + np.arange(2)
            extra[here] = lines.cost[here] - steps.value[end.row, after[here, None], node]
    return np.abs(np.diff(extra)[:, 0]) <= TIE_ABS


def _still(lines: Lines, k: int, shift: Shift, steps: Steps) -> Any:
    """Mask of lines of the move `k` that leave both ends of the cell as they are."""
    menu, out = Menu(steps.problem, steps.grid, k), np.ones(lines.act.size, bool)
    mode = lines.mode if len(steps.problem.modes) > 1 else None
    for end in (0, 1):
        x = steps.grid.coordinate(0, lines.cell + float(end))
        s = menu.state((x,), mode, steps.countdown.time(lines.row), without=shift.axis)
        law = shift.law(s, menu.controls(lines.entry[:, end].astype(np.int64), lines.control[:, end]))
        out &= np.maximum(np.abs(law.mean), law.sd) <= STILL * steps.grid.spacing[0]
    return out


def _onward(cell: Cell, line: _Line, known: dict[Cell, list[_Line]], steps: Steps) -> list[_Line]:
    """Lines of the cell after a wait, at the cost of the wait at both nodes."""
    row, mode, at = cell
    menu = Menu(steps.problem, steps.grid, line.act)
    end = steps.countdown.arrival(row, menu.move.duration)
    after = mode if menu.into is None else int(menu.into[line.entry[0]])
    found = [] if end is None or end.row == row else known.get((end.row, after, at), [])
    if end is None or not found:
        return [line]
    extra = line.cost - steps.value[end.row, after, at : at + 2]
    stops = [one for one in known.get(cell, []) if one.act < 0]
    return [
        line._replace(cost=one.cost + extra)
        for one in found
        if not any(one.act == stop.act and np.all(stop.cost <= one.cost + extra + TIE_ABS) for stop in stops)
    ]


def _joined(known: dict[Cell, list[_Line]]) -> Lines:
    """Lines of all cells as one record, after their splitting."""
    place = np.array([cell for cell, lines in known.items() for _ in lines], dtype=np.int64)
    every = [line for lines in known.values() for line in lines]
    act = np.array([line.act for line in every])
    entry, control, cost = (np.array([getattr(line, name) for line in every]) for name in _Line._fields[1:])
    row, mode, cell = place.T
    return Lines(row, mode, cell, act, entry, control, cost, np.zeros(act.size, bool), control)
