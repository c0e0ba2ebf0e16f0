"""Error of look-ups between nodes.

At points inside cells, the exact cost of one step of the policy's action, followed by the policy, is compared
with the value looked up. The error at the nodes comes on top.
"""

from itertools import product
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._plan.jumps import away
from sdpgrind.sdp._policy import look_up_kernels as _lookup
from sdpgrind.sdp._policy.locate import Place
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.stops import charge_of, stop_state
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.shift import Shift

PARTS = tuple(k / 8 for k in range(1, 8))  # chosen: tested positions in a cell; fewer miss its largest error
NARROW = 0.1  # chosen: largest sd of a move treated as deterministic, cells; wider ones average the chord
POINTS = 1400  # chosen: tested points, in the most curved cells; fewer miss the largest error, more cost time
# chosen: points tested at once; more take more memory than the solve, some 80 bytes a node each
TOGETHER = 256


def between_nodes(policy: Solution, *, off_jumps: bool = False) -> float:
    """Return the largest error found, $; `off_jumps`: more than a cell from where a charge jumps."""
    row, mode, index = _points(policy, off_jumps)
    some = [slice(k, k + TOGETHER) for k in range(0, row.size, TOGETHER)]
    return max((_largest(policy, row[part], mode[part], index[:, part]) for part in some), default=0.0)


def _largest(policy: Solution, row: Ints, mode: Ints, index: Floats) -> float:
    """Largest error at some points, $."""
    points = tuple(policy.grid.coordinate(k, i) for k, i in enumerate(index))
    place = Place(row, np.zeros(row.size), mode, index, points, row.shape, np.zeros(row.size))
    cost = _cost(policy, place)
    return float(
        np.max(np.abs(policy.interpolated(row, mode, index) - cost), initial=0.0, where=np.isfinite(cost))
    )


def _points(policy: Solution, off_jumps: bool) -> tuple[Ints, Ints, Floats]:
    """Slices (row, mode) and positions [axis, point] inside the most curved cells."""
    shape = policy.grid.shape
    bend = _bends(policy.table.value.reshape(*policy.table.value.shape[:2], *shape))
    if off_jumps:
        middle: Floats = np.indices(bend.shape[2:]).astype(float) + 0.5
        bend *= away(policy.need_problem("the error between nodes"), policy.grid, middle, cells=0.5)
    wanted = min(bend.size, POINTS // len(PARTS) ** len(shape)) if shape else 0
    worst = (
        np.argpartition(bend.ravel(), bend.size - wanted)[bend.size - wanted :]
        if wanted
        else np.zeros(0, int)
    )
    row, mode, *cell = np.unravel_index(np.sort(worst), bend.shape)
    part = np.array(list(product(PARTS, repeat=len(shape)))).T.reshape(len(shape), 1, -1)
    index = (np.array(cell).reshape(len(shape), -1, 1) + part).reshape(len(shape), -1)
    row, mode = np.repeat(row, part.shape[-1]), np.repeat(mode, part.shape[-1])
    if off_jumps:
        far = away(policy.need_problem("the error between nodes"), policy.grid, index)
        row, mode, index = row[far], mode[far], index[:, far]
    return row, mode, index


def _bends(value: Floats) -> Floats:
    """Second differences [row, mode, cells] at both ends of each cell, summed over the axes."""
    out = np.zeros((*value.shape[:2], *(n - 1 for n in value.shape[2:])))
    for axis in range(2, value.ndim):
        bend = np.abs(np.diff(value, 2, axis=axis))
        width = [(1, 1) if k == axis else (0, 0) for k in range(value.ndim)]
        bend = np.pad(bend, width, mode="edge")
        for k in range(2, value.ndim):
            low, high = (np.take(bend, range(a, bend.shape[k] - 1 + a), axis=k) for a in (0, 1))
            bend = low + high if k == axis else np.maximum(low, high)
        out += bend
    return out


def _cost(policy: Solution, place: Place) -> Floats:
    """Cost of the action at each place, followed by the policy, $."""
    problem = policy.need_problem("the error between nodes")
    best, entry, control, _ = policy.act(place)
    cost = np.empty(best.size)
    for k in np.unique(best):
        here = best == k
        row, mode = place.row[here], place.mode[here]
        points = tuple(x[here] for x in place.points)
        if k >= 0:
            chosen = (int(k), row, mode, points, entry[here], control[here])
            cost[here] = policy.steps.cost(*chosen) + _beyond_chords(policy, *chosen)
        else:
            count = policy.countdown
            late = np.where(count.in_base(row), 0.0, count.late(count.time(row)))
            cost[here] = (
                charge_of(
                    problem, problem.stops[-1 - k], stop_state(problem, points, mode, row + count.first)
                )
                + late
            )
    return cost


def _beyond_chords(
    policy: Solution, k: int, row: Ints, mode: Ints, points: tuple[Floats, ...], entry: Any, control: Floats
) -> Any:
    """Value-to-go minus its chord where a move of small variance ends between two nodes, $."""
    menu, count = Menu(policy.need_problem("the error between nodes"), policy.grid, k), policy.countdown
    if not isinstance(menu.move.to, Shift) or len(points) > 1:
        return 0.0
    told = mode if len(menu.problem.modes) > 1 else None
    s = menu.state(points, told, count.time(row), without=menu.move.to.axis)
    law = menu.move.to.law(s, menu.controls(entry.astype(np.int64), control))
    # Writable, as all that is looked up: else the kernel would be compiled once more.
    index = np.empty(row.shape)
    index[:] = policy.grid.index(0, points[0] - law.mean)
    narrow = (law.sd < NARROW * policy.grid.spacing[0]) & (index >= 0) & (index <= policy.grid.shape[0] - 1)
    end = np.zeros_like(row)
    for one in np.unique(row):
        arrival = count.arrival(int(one), menu.move.duration)
        end[row == one] = 0 if arrival is None else arrival.row
    after = mode if menu.into is None else menu.into[entry]
    table, chord = policy.table.value, np.empty(row.size)
    _lookup.interpolate(table, end, after, policy.shape, index[None], chord)
    return np.where(narrow, policy.interpolated(end, after, index[None]) - chord, 0.0)
