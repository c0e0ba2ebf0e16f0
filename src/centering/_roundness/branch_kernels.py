"""Search of all centres within reach, by halving squares, where the contacts alone do not prove the optimum."""

from typing import Any

import numpy as np
from numba import njit

from centering._roundness.direction_kernels import gaps
from centering._roundness.mic_kernels import empty_circle
from centering._roundness.mzc_kernels import zone as zone_exchange
from centering._roundness.proof_kernels import ball, cell_bound, height, steepness

_OPTIONS: Any = {"cache": True, "nogil": True}
_LEVELS = 44
_ROOT_2 = np.sqrt(2.0)
_BALLS = 64


@njit(**_OPTIONS)
def search(x, y, zone, start, reach, tolerance, slack, cells, basis):
    """Best centre within reach (mm) of a start (x, y, height, held): those of the best, a bound below, the least height not held.

    Squares are given up when no centre in them is better by more than `slack` (mm), or when they lie within the balls of optima;
    points that can be neither farthest nor nearest in a square are left out in its quarters, of which the best goes first.
    """
    found = np.array([start[0], start[1], start[2], start[2], np.inf, start[3]])
    balls, known = np.zeros((_BALLS, 3)), 0
    lists, sizes = np.empty((_LEVELS + 1, x.size), dtype=np.int32), np.zeros(_LEVELS + 1, dtype=np.int64)
    lists[0], sizes[0] = np.arange(x.size), x.size
    stack, depth, done = np.zeros((4 * _LEVELS + 4, 5)), 1, 0
    stack[0] = start[0], start[1], reach, 0.0, -np.inf
    while depth > 0:
        depth -= 1
        cx, cy, half, level, below = stack[depth, 0], stack[depth, 1], stack[depth, 2], int(stack[depth, 3]), stack[depth, 4]
        around = half * _ROOT_2
        if np.hypot(cx - start[0], cy - start[1]) - around > reach or _covered(cx, cy, around, balls, min(known, _BALLS)):
            continue
        if below >= found[2] - slack or done == cells or level == _LEVELS:
            found[3] = min(found[3], below)
            continue
        if not zone and _off_hull(x, y, cx, cy, around):
            continue
        done += 1
        here = lists[level, : sizes[level]]
        xs, ys = x[here], y[here]
        if level % 2 == 0:
            known = _climb(x, y, xs, ys, here, zone, cx, cy, tolerance, slack, found, basis, balls, known)
        sizes[level + 1] = _keep(xs, ys, here, cx, cy, around, zone, lists[level + 1])
        depth = _quarter(x, y, lists[level + 1, : sizes[level + 1]], zone, stack, depth, slack, found, basis)
    return found


@njit(**_OPTIONS)
def _quarter(x, y, here, zone, stack, depth, slack, found, basis):
    """Put the quarters of the square that was on top of the stack in its place, the best on top; note what is better."""
    cx, cy, half, level = stack[depth, 0], stack[depth, 1], 0.5 * stack[depth, 2], stack[depth, 3] + 1.0
    xs, ys, px, py = x[here], y[here], x[basis], y[basis]
    values, belows = np.empty(4), np.empty(4)
    for k in range(4):
        kx, ky = cx + half * (2 * (k % 2) - 1), cy + half * (2 * (k // 2) - 1)
        values[k], belows[k] = cell_bound(xs, ys, kx, ky, half * _ROOT_2, zone, px, py)
        if values[k] < found[2]:
            _note(x, y, kx, ky, zone, slack, found)
    for k in np.argsort(-values):
        stack[depth] = cx + half * (2 * (k % 2) - 1), cy + half * (2 * (k // 2) - 1), half, level, belows[k]
        depth += 1
    return depth


@njit(**_OPTIONS)
def _note(x, y, cx, cy, zone, slack, found):
    """Note a centre, no optimum, that beats the best: of a zone as the best, of an empty circle as one that nothing holds."""
    value = height(x, y, cx, cy, zone)
    if value >= found[2]:
        return
    if zone:
        found[0], found[1], found[2], found[5] = cx, cy, value, 0.0
        found[3] = min(found[3], value)
    elif gaps(x, y, cx, cy)[0] <= np.pi:
        found[4] = min(found[4], value)


@njit(**_OPTIONS)
def _climb(x, y, xs, ys, here, zone, cx, cy, tolerance, slack, found, basis, balls, known):
    """Exchange from a centre on the points that matter near it; note a better optimum, and the ball of one that is not better."""
    trial = np.zeros(4, dtype=np.int64)
    if zone:
        cx, cy, value, held = zone_exchange(xs, ys, cx, cy, tolerance, trial)
    else:
        cx, cy, radius, held = empty_circle(xs, ys, cx, cy, tolerance, trial)
        value = -radius
    if not held:
        return known
    whole = height(x, y, cx, cy, zone)
    for k in range(4):
        trial[k] = here[trial[k]]
    if whole < found[2]:
        found[0], found[1], found[2], found[5] = cx, cy, whole, 1.0
        found[3] = min(found[3], whole)
        basis[:] = trial[: basis.size]
    if value >= found[2] - slack:
        inner = np.hypot(x[trial[2]] - cx, y[trial[2]] - cy)
        balls[known % _BALLS] = cx, cy, ball(steepness(x, y, cx, cy, trial, zone), inner)
        found[3] = min(found[3], value)
        return known + 1
    return known


@njit(**_OPTIONS)
def _covered(cx, cy, around, balls, known):
    """Whether a circle about a centre lies within one of the balls."""
    inside = False
    for k in range(known):
        inside |= np.hypot(cx - balls[k, 0], cy - balls[k, 1]) + around <= balls[k, 2]
    return inside


@njit(**_OPTIONS)
def _off_hull(x, y, cx, cy, around):
    """Whether a circle about a centre lies outside the hull of the points, as seen from the middle of the largest gap."""
    gap, _, middle = gaps(x, y, cx, cy)
    if gap <= np.pi:
        return False
    ex, ey = np.cos(middle), np.sin(middle)
    most = -np.inf
    for k in range(x.size):
        most = max(most, (x[k] - cx) * ex + (y[k] - cy) * ey)
    return most < -around


@njit(**_OPTIONS)
def _keep(xs, ys, here, cx, cy, around, zone, kept):
    """Put into `kept` the points that can be nearest, or for a zone farthest, within a distance of a centre; how many."""
    away = np.sqrt((xs - cx) ** 2 + (ys - cy) ** 2)
    least, most = np.min(away) + 2.0 * around, np.max(away) - 2.0 * around
    size = 0
    for k in range(away.size):
        if away[k] <= least or (zone and away[k] >= most):
            kept[size] = here[k]
            size += 1
    return size
