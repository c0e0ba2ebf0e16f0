"""Balance of volumes of `_kernels` with the bead as a polyline, clipped exactly at its crossings.

Slower, without a grid: the remaining error is that of the time step. For a disc moved at given heights.
"""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.weldbead.passes._kernels import (
    DONE,
    OVERLAPPING,
    PATCHES,
    RATE,
    STALLED,
    STATES,
    TIP_X,
    TIP_Z,
    WIND,
    CutCore,
    _removal,
    _torque_at,
)

_WALL = 1e-9  # chosen: mm; width of the upright wall where the disc comes down
_TOLERANCE = 1e-13  # chosen: rad; as in `_kernels`


class _Step(NamedTuple):
    """Step of the disc over the polyline, for which wind-ups are tried."""

    px: Any
    pz: Any
    size: int
    top: float
    width: float
    core: CutCore
    state: Any
    center: float
    height: float
    relaxed: float
    time: float
    share: float
    carried: float


@compiled
def _lower(at, old_x, old_y, x, y, rise):
    """Height of the disc's lower surface, mm: path of the tip, then the face."""
    return old_y + (y - old_y) * (at - old_x) / (x - old_x) if at < x else y + rise * (at - x)


@compiled
def _piece(start, end, above, below):
    """Area where the gap between two lines over [start, end], `above` and `below` there, is positive."""
    if above >= 0.0 and below >= 0.0:
        return 0.5 * (end - start) * (above + below)
    if above <= 0.0 and below <= 0.0:
        return 0.0
    return 0.5 * (end - start) * max(above, below) ** 2 / abs(above - below)


@compiled
def _swept(px, pz, size, top, state, center, x, y, rise, cut, cut_x, cut_z):
    """Area between the polyline and the disc's lower surface, mm^2, number of new points, and patches.

    Where `cut`, the new points are written to `cut_x`, `cut_z`.
    """
    old_x, old_y = state[TIP_X], state[TIP_Z]
    begin = min(old_x, x)
    first = max(0, np.searchsorted(px[:size], begin, side="right") - 1)
    area, points, patches, was = 0.0, 0, 0, False
    for k in range(first, size - 1):
        if px[k] > center or (px[k] > x and y + rise * (px[k] - x) > top):
            break
        slope = (pz[k + 1] - pz[k]) / (px[k + 1] - px[k])
        start = max(px[k], begin)
        while start < px[k + 1]:
            end = min(px[k + 1], x) if start < x else px[k + 1]
            high = pz[k] + slope * (start - px[k])
            low = _lower(start, old_x, old_y, x, y, rise)
            far = pz[k] + slope * (end - px[k])
            gap, gap_end = high - low, far - _lower(end, old_x, old_y, x, y, rise)
            area += _piece(start, end, gap, gap_end)
            if cut:
                if points == 0 and gap > 0.0 and start > px[0]:
                    cut_x[0], cut_z[0], points = start - _WALL, high, 1
                cut_x[points], cut_z[points] = start, min(high, low)
                points += 1
                if gap * gap_end < 0.0:
                    at = start + (end - start) * gap / (gap - gap_end)
                    cut_x[points], cut_z[points] = at, pz[k] + slope * (at - px[k])
                    points += 1
                now = gap > 0.0 or gap_end > 0.0
                patches += 1 if now and not was else 0
                was = gap_end > 0.0
                cut_x[points], cut_z[points] = end, far - max(0.0, gap_end)
            start = end
    return area, points + 1 if points > 0 else 0, patches


@compiled
def _spliced(px, pz, size, cut_x, cut_z, points):
    """Replace the points between the first and the last new point by the new ones; return the size."""
    low = np.searchsorted(px[:size], cut_x[0], side="left")
    high = np.searchsorted(px[:size], cut_x[points - 1], side="right")
    tail = size - high
    rest_x, rest_z = px[high:size].copy(), pz[high:size].copy()
    used = low
    for k in range(points):
        if used == 0 or cut_x[k] > px[used - 1]:
            px[used], pz[used] = cut_x[k], cut_z[k]
            used += 1
    for k in range(tail):
        px[used + k], pz[used + k] = rest_x[k], rest_z[k]
    return used + tail


@compiled
def _excess(wind, step):
    """Volume in the way less the volume removed in a step, mm^3."""
    core, angle = step.core, step.relaxed - wind
    x, y = step.center - core.radius * np.cos(angle), step.height - core.radius * np.sin(angle)
    px, pz = step.px, step.pz
    area, _, _ = _swept(
        px, pz, step.size, step.top, step.state, step.center, x, y, np.tan(angle), False, px, pz
    )
    removed = step.time * step.share * _removal(_torque_at(wind, core), core)
    return step.width * area - removed - step.carried


@compiled
def _least_wind(last, most, step):
    """Least wind-up, rad, that leaves nothing in the way, by bisection from the last one; inf: none."""
    low, high, stride = 0.0, min(last + 1e-4, most), 1e-4
    while _excess(high, step) > 0.0:
        if high >= most:
            return np.inf
        low, high, stride = high, min(high + stride, most), 4.0 * stride
    while high - low > _TOLERANCE:
        middle = 0.5 * (low + high)
        if _excess(middle, step) > 0.0:
            low = middle
        else:
            high = middle
    return high


@compiled
def grind(px, pz, size, width, core, center, height, relaxed, times, second_order, out):
    """Grind a whole pass; return code, steps, points.

    `px`, `pz` have room for new points. Rows of `out` as in `_kernels.grind`.
    """
    state, top = np.zeros(STATES), np.max(pz[:size])
    cut_x, cut_z = np.empty(px.size), np.empty(px.size)
    for k in range(center.size):
        time = times[k - 1] if k > 0 else 0.0
        wind, share, carried = 0.0, 1.0, 0.0
        angle = relaxed[k]
        x, y = center[k] - core.radius * np.cos(angle), height[k] - core.radius * np.sin(angle)
        if k == 0:
            state[TIP_X], state[TIP_Z] = x, y
            if _swept(px, pz, size, top, state, center[k], x, y, np.tan(angle), False, cut_x, cut_z)[0] > 0.0:
                return OVERLAPPING, 0, size
        free = (
            width * _swept(px, pz, size, top, state, center[k], x, y, np.tan(angle), False, cut_x, cut_z)[0]
        )
        if second_order and state[RATE] > 0.0 and free >= 0.5 * time * state[RATE]:
            share, carried = 0.5, 0.5 * time * state[RATE]
        if free > carried:
            step = _Step(
                px, pz, size, top, width, core, state, center[k], height[k], angle, time, share, carried
            )
            wind = _least_wind(state[WIND], core.wind_max, step)
            if wind == np.inf:
                return STALLED, k, size
        angle = relaxed[k] - wind
        x, y = center[k] - core.radius * np.cos(angle), height[k] - core.radius * np.sin(angle)
        area, points, patches = _swept(
            px, pz, size, top, state, center[k], x, y, np.tan(angle), True, cut_x, cut_z
        )
        if area > 0.0:
            size = _spliced(px, pz, size, cut_x, cut_z, points)
        torque = _torque_at(wind, core)
        state[WIND], state[TIP_X], state[TIP_Z], state[RATE] = wind, x, y, _removal(torque, core)
        state[PATCHES] = patches if area > 0.0 else 0
        row = out[k]
        row[0], row[1], row[2], row[3], row[4] = wind, torque, height[k], x, y
        row[5], row[6], row[7], row[8] = state[RATE], width * area, state[PATCHES], 0.0
    return DONE, center.size, size
