"""Branch and bound over all centres within reach, where the contacts alone do not prove the optimum."""

import numpy as np

from centering.roundness._direction_kernels import _ranked
from centering.roundness._distance_kernels import _distance, extremes
from centering.roundness._mic_kernels import empty_circle
from centering.roundness._mzc_kernels import zone as zone_exchange
from centering.roundness._proof_kernels import _cell_bound, _height, ball, steepness
from sdpgrind.base.compiling.compiled import compiled

_LEVELS = 44  # derived: halvings of a square from the radius to its rounding
_ROOT_2 = np.sqrt(2.0)
_BALLS = 64  # chosen: proved neighbourhoods kept; more cost time at every square
_FREE = 30  # chosen: halvings after which an empty circle without three contacts counts as free
_LOOSE = 1e-6  # chosen: relative margin of a held circle over a free one, above rounding
ALIKE = 1e-7  # chosen: relative difference of equally good optima, 3 nm of 30 mm
_CELL = 20  # chosen: fixed cost of a square, in points


@compiled
def search(x, y, zone, start, reach, tolerance, slack, work, basis, hull):
    """Best centre within `reach` (mm) of a start (x, y, height, held, size of the circle).

    Returns x, y and height of the best, a lower bound, the least height of a free circle, whether the best is
    held, and the box (least and largest x, least and largest y) of all optima equal to `ALIKE`.

    A square is dropped when its bound is not better by `slack` (mm) or it lies within the neighbourhood of an
    optimum; its quarters omit points that are neither farthest nor nearest in it. The search ends after
    `work` evaluated points. With a slack above `ALIKE` no optima are located. Centres outside the `hull` (m,
    3), of normals and offsets (mm), are left out.
    """
    found = np.array(
        [start[0], start[1], start[2], start[2], np.inf, start[3], start[0], start[0], start[1], start[1]]
    )
    alike = ALIKE * start[4]
    balls, known = np.zeros((_BALLS, 3)), np.int64(0)  # a literal would compile `_climb` twice
    lists, sizes = np.empty((_LEVELS + 1, x.size), dtype=np.int32), np.zeros(_LEVELS + 1, dtype=np.int64)
    for k in range(x.size):
        lists[0, k] = k
    sizes[0] = x.size
    stack, depth, done = np.zeros((4 * _LEVELS + 4, 5)), 1, 0
    _push(stack, 0, start[0], start[1], reach, 0, -np.inf)
    while depth > 0:
        depth -= 1
        cx, cy, half = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        level, below, around = int(stack[depth, 3]), stack[depth, 4], half * _ROOT_2
        beyond = np.hypot(cx - start[0], cy - start[1]) - around > reach
        if beyond or _covered(cx, cy, around, balls, min(known, _BALLS)):
            continue
        if below >= _wanted(found, slack, start[4]) or done >= work or level == _LEVELS:
            found[3] = min(found[3], below)
            continue
        if _off_hull(hull, cx, cy) > around:
            continue
        if not zone and level == _FREE:  # no exchange has come to hold a circle here
            found[3], found[4] = min(found[3], below), min(found[4], _height(x, y, cx, cy, zone))
            continue
        here = lists[level, : sizes[level]]
        done += here.size + _CELL
        if level % 3 == 0 and slack < alike:
            known = _climb(x, y, here, zone, cx, cy, tolerance, slack, alike, found, basis, balls, known)
        sizes[level + 1] = _keep(x, y, here, cx, cy, around, zone, lists[level + 1])
        depth = _quarter(x, y, lists[level + 1, : sizes[level + 1]], zone, stack, depth, found, basis)
    return found


@compiled
def _wanted(found, slack, size):
    """Height below which a centre is better than the best, held or free."""
    return found[2] - slack if found[2] <= found[4] else found[4] - _LOOSE * size


@compiled
def _push(stack, depth, cx, cy, half, level, below):
    """Push a square: centre, half side (mm), number of halvings, lower bound of the height (mm)."""
    stack[depth, 0], stack[depth, 1], stack[depth, 2] = cx, cy, half
    stack[depth, 3], stack[depth, 4] = level, below


@compiled
def _part(values, here):
    """Values of the listed points."""
    part = np.empty(here.size)
    for k in range(here.size):
        part[k] = values[here[k]]
    return part


@compiled
def _quarter(x, y, here, zone, stack, depth, found, basis):
    """Replace the square on top of the stack by its quarters, the best on top; record a better zone."""
    cx, cy, half, level = stack[depth, 0], stack[depth, 1], 0.5 * stack[depth, 2], stack[depth, 3] + 1.0
    xs, ys, px, py = _part(x, here), _part(y, here), _part(x, basis), _part(y, basis)
    values, belows = np.empty(4), np.empty(4)
    for k in range(4):
        kx, ky = cx + half * (2 * (k % 2) - 1), cy + half * (2 * (k // 2) - 1)
        value, belows[k] = _cell_bound(xs, ys, kx, ky, half * _ROOT_2, zone, px, py)
        values[k] = -value
        if zone and value < found[2]:
            _note(x, y, kx, ky, found)
    for k in _ranked(values):
        kx, ky = cx + half * (2 * (k % 2) - 1), cy + half * (2 * (k // 2) - 1)
        _push(stack, depth, kx, ky, half, level, belows[k])
        depth += 1
    return depth


@compiled
def _note(x, y, cx, cy, found):
    """Record a centre of a zone that is better than the best, though no optimum."""
    value = _height(x, y, cx, cy, True)
    if value < found[2]:
        found[0], found[1], found[2], found[5] = cx, cy, value, 0.0
        found[3] = min(found[3], value)


@compiled
def _climb(x, y, here, zone, cx, cy, tolerance, slack, alike, found, basis, balls, known):
    """Exchange from a centre on the listed points; record a better optimum, or the ball proved by another."""
    trial, xs, ys = np.zeros(4, dtype=np.int64), _part(x, here), _part(y, here)
    if zone:
        cx, cy, value, held = zone_exchange(xs, ys, cx, cy, tolerance, trial)
    else:
        cx, cy, radius, held = empty_circle(xs, ys, cx, cy, tolerance, trial)
        value = -radius
    if not held:
        return known
    for k in range(4):
        trial[k] = here[trial[k]]
    whole = _height(x, y, cx, cy, zone)
    _box(cx, cy, whole, alike, found)
    if whole < found[2]:
        found[0], found[1], found[2], found[5] = cx, cy, whole, 1.0
        found[3] = min(found[3], whole)
        for k in range(4):
            basis[k] = trial[k]
    if value < found[2] - slack:
        return known
    last = known % _BALLS
    balls[last, 0], balls[last, 1] = cx, cy
    balls[last, 2] = ball(steepness(x, y, cx, cy, trial, zone), np.hypot(x[trial[2]] - cx, y[trial[2]] - cy))
    found[3] = min(found[3], value)
    return known + 1


@compiled
def _box(cx, cy, value, alike, found):
    """Extend the box of equally good optima by one, or restart it from a better one."""
    if value < found[2] - alike:
        found[6], found[7], found[8], found[9] = cx, cx, cy, cy
    elif value <= found[2] + alike:
        found[6], found[7] = min(found[6], cx), max(found[7], cx)
        found[8], found[9] = min(found[8], cy), max(found[9], cy)


@compiled
def _covered(cx, cy, around, balls, known):
    """Whether a circle about a centre lies within one of the balls."""
    inside = False
    for k in range(known):
        inside |= np.hypot(cx - balls[k, 0], cy - balls[k, 1]) + around <= balls[k, 2]
    return inside


@compiled
def _off_hull(hull, cx, cy):
    """Distance of a centre outside the worst edge of a hull, mm; negative inside."""
    off = -np.inf
    for k in range(hull.shape[0]):
        off = max(off, hull[k, 0] * cx + hull[k, 1] * cy + hull[k, 2])
    return off


@compiled
def _keep(x, y, here, cx, cy, around, zone, kept):
    """Write the listed points that may be nearest or, for a zone, farthest in a circle; return the count."""
    xs, ys = _part(x, here), _part(y, here)
    _, most, _, least = extremes(xs, ys, cx, cy)
    left = 0
    for k in range(here.size):
        away = _distance(xs, ys, cx, cy, k)
        if away <= least + 2.0 * around or (zone and away >= most - 2.0 * around):
            kept[left] = here[k]
            left += 1
    return left
