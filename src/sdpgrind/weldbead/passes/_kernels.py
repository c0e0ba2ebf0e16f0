"""One step of a tilted disc over a bead by a balance of volumes, and whole passes of such steps.

In a step the disc sweeps what lies above its new lower surface: the path of the tip and, ahead of it, the
face, which rises with the disc's angle. The swept volume equals what the contact removes in that time, a rate
that falls as the disc springs back. This is one scalar equation in the wind-up of the spring, with one root
(where the tip is led along a path there may be several): free flight, rubbing, cutting and any number of
patches are its solutions.
"""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.units import N_MM_S_PER_W

# State: wind-up (rad), tip (mm), removal rate (mm^3/s), wear of the face (mm), nodes and patches in contact.
WIND, TIP_X, TIP_Z, RATE, WEAR, TOUCHED, PATCHES = range(7)
STATES = 7  # derived: number of these entries
DONE, STALLED, OVERLAPPING = range(3)
GIVEN, INVERSE, FEEDBACK = range(3)
_TOLERANCE = 1e-13  # chosen: rad; end of the root search
_FIRST = 2e-5  # chosen: rad; first wind-up tried where the disc was free
_BACK = 7e-4  # chosen: rad; from where the disc is free back to the cut; runout moves it as far in a step
_HALVED = 16  # chosen: places tried before the bracket is halved; measured: 7 are needed on average


class CutCore(NamedTuple):
    """Disc as arrays: radius (mm), spring (rad, N mm), and constants from torque to removal rate (mm^3/s)."""

    radius: float
    angles: Any
    torques: Any
    wind_max: float  # rad; more torque removes less
    free_speed: float
    speed_droop: float
    friction_ratio: float
    specific_energy: float
    idle_power: float
    grinding_ratio: float


@compiled
def cut_of(row):
    """Constants of a disc from their row, two entries of the spring a point and 8 numbers."""
    n = (row.size - 8) // 2
    a, r = row[1 : 1 + n], row[1 + 2 * n :]
    return CutCore(row[0], a, row[1 + n : 1 + 2 * n], r[0], r[1], r[2], r[3], r[4], r[5], r[6])


class Bead(NamedTuple):
    """Bead on even nodes: origin and spacing, mm, heights, mm, volume per mm of height at each node, mm^2.

    `top` is the greatest height, mm, at a node and all later ones.
    """

    start: float
    spacing: float
    z: Any
    area: Any
    top: Any


class Step(NamedTuple):
    """Disc target: centre, height ``a + b (path + R sin(angle))``, relaxed angle, face offset; mm, rad."""

    center: float
    a: float
    b: float
    relaxed_angle: float
    offset: float
    time: float  # since the step before, s


@compiled(forceinline=True)
def _torque_at(wind, core):
    """Torque of the spring, N mm; beyond the end of its table the last slope continues."""
    if wind <= 0.0:
        return 0.0
    k = 1
    while k < core.angles.size - 1 and core.angles[k] < wind:
        k += 1
    slope = (core.torques[k] - core.torques[k - 1]) / (core.angles[k] - core.angles[k - 1])
    return core.torques[k - 1] + slope * (wind - core.angles[k - 1])


@compiled(forceinline=True)
def _removal(torque, core):
    """Removal rate, mm^3/s: power above the idle power over the specific energy."""
    shaft = core.friction_ratio * torque
    power = shaft * (core.free_speed - core.speed_droop * shaft) / N_MM_S_PER_W
    return max(0.0, (power - core.idle_power) / core.specific_energy)


@compiled
def _along(path, bead, x):
    """Height of the tip's path at x, mm; level beyond its ends."""
    place = min(max((x - bead.start) / bead.spacing, 0.0), path.size - 1.0)
    k = min(int(place), path.size - 2)
    return path[k] + (place - k) * (path[k + 1] - path[k])


@compiled(inline="always")  # measured: a simulated pass takes 10 % less
def tip(wind, step, core, state, path, bead):
    """Position and height of the tip, and height of the centre, mm."""
    angle = step.relaxed_angle - wind
    x, drop = step.center - core.radius * np.cos(angle), core.radius * np.sin(angle)
    height = step.a
    if step.b != 0.0:
        height += step.b * (_along(path, bead, x) + drop - state[WEAR])
    return x, height - drop + state[WEAR] + step.offset, height


@compiled(forceinline=True)
def swept(bead, state, step, wind, x, y):
    """Volume, mm^3, between bead and disc with its tip at x, y: below the path of the tip, then the face."""
    old_x, old_y = state[TIP_X], state[TIP_Z]
    rise = np.tan(step.relaxed_angle - wind)
    path = (y - old_y) / (x - old_x) if x > old_x else 0.0
    volume, k = 0.0, max(0, int(np.floor((min(old_x, x) - bead.start) / bead.spacing)) + 1)
    while k < bead.z.size:
        at = bead.start + k * bead.spacing
        if at > x:
            break
        depth = bead.z[k] - (old_y + path * (at - old_x))
        if depth > 0.0:
            volume += bead.area[k] * depth
        k += 1
    while k < bead.z.size:
        at = bead.start + k * bead.spacing
        lower = y + rise * (at - x)
        if lower >= bead.top[k] or at > step.center:
            break
        depth = bead.z[k] - lower
        if depth > 0.0:
            volume += bead.area[k] * depth
        k += 1
    return volume


@compiled
def _cut_away(bead, state, step, wind, x, y):
    """Remove what `swept` measures; count its nodes and its patches."""
    old_x, old_y = state[TIP_X], state[TIP_Z]
    rise = np.tan(step.relaxed_angle - wind)
    path = (y - old_y) / (x - old_x) if x > old_x else 0.0
    touched, patches, last = 0, 0, -2
    for k in range(max(0, int(np.floor((min(old_x, x) - bead.start) / bead.spacing)) + 1), bead.z.size):
        at = bead.start + k * bead.spacing
        lower = old_y + path * (at - old_x) if at <= x else y + rise * (at - x)
        if at > x and (lower >= bead.top[k] or at > step.center):
            break
        if bead.z[k] > lower:
            bead.z[k] = lower
            patches += 1 if k > last + 1 else 0
            touched, last = touched + 1, k
    state[TOUCHED], state[PATCHES] = touched, patches


@compiled(forceinline=True)
def _excess(wind, share, carried, bead, core, state, step, path):
    """Volume in the way less the volume removed in the step, mm^3; falls as the disc winds up."""
    x, y, _ = tip(wind, step, core, state, path, bead)
    return (
        swept(bead, state, step, wind, x, y)
        - step.time * share * _removal(_torque_at(wind, core), core)
        - carried
    )


@compiled
def _least_wind(share, carried, at_zero, most, bead, core, state, step, path):
    """Least wind-up, rad, with nothing left in the way; `most` and False where there is none.

    Begins at the last one. The excess is steep and nearly convex where the disc cuts, flat where it is free:
    lines through the last two places on the steep side, else a chord, whose end is pulled in where it stays.
    """
    low, at_low, high, bracketed = 0.0, at_zero, most, False
    back, pull = _BACK, 2.0
    wind = min(state[WIND] if state[WIND] > 0.0 else _FIRST, most)
    for k in range(200):
        value = _excess(wind, share, carried, bead, core, state, step, path)
        if value > 0.0:
            if wind >= most:
                return most, False
            ahead = value * (wind - low) / (at_low - value) if value < at_low else most
            low, at_low, pull = wind, value, 2.0
        else:
            if value == 0.0 and _removal(_torque_at(wind, core), core) > 0.0:
                return wind, True
            high, bracketed, pull = wind, True, 0.5 * pull
        if bracketed and high - low <= _TOLERANCE:
            break
        if bracketed and low == 0.0 and high > back:
            wind, back = high - back, 4.0 * back
            continue
        if k >= _HALVED or (bracketed and value == 0.0):
            wind = 0.5 * (low + high) if bracketed else most
        elif value > 0.0:
            wind = low + ahead
        else:
            wind = low + (high - low) * pull * at_low / (pull * at_low - value)
        wind = max(low + 0.5 * _TOLERANCE, min(wind, high - 0.5 * _TOLERANCE if bracketed else most))
    return high, True


@compiled
def _raised(wind, wanted, bead, core, state, step, path):
    """Extra height, mm, at which the disc, wound up to `wind`, sweeps only the volume `wanted`, mm^3."""
    x, y, _ = tip(wind, step, core, state, path, bead)
    low, high = 0.0, 1e-4
    while swept(bead, state, step, wind, x, y + high) > wanted:
        low, high = high, 4.0 * high
    for _ in range(200):
        middle = 0.5 * (low + high)
        if high - low <= 1e-13 or middle in (low, high):
            break
        if swept(bead, state, step, wind, x, y + middle) > wanted:
            low = middle
        else:
            high = middle
    return high


@compiled
def _worn(bead, core, state, angle, x, y):
    """Recession of the face in a step, mm: volume cut over G, on the ring that wears."""
    into = (x - state[TIP_X]) * np.sin(angle) - (y - state[TIP_Z]) * np.cos(angle)
    k = min(max(int((x - bead.start) / bead.spacing), 1), bead.z.size - 2)
    return max(0.0, into) * bead.area[k] / bead.spacing / (core.grinding_ratio * 2.0 * np.pi * core.radius)


@compiled
def cut_step(bead, core, state, step, path, most, raise_disk, second_order):
    """Bring the disc to `step`, cut, and keep the state.

    Return code, volume (mm^3), torque (N mm), height of the centre (mm). Where the wind-up would exceed
    `most` the disc is raised until it does not (`raise_disk`), or nothing is cut and the code says why.
    """
    free = _excess(0.0, 0.0, 0.0, bead, core, state, step, path)
    carried = 0.5 * step.time * state[RATE]
    if not second_order or state[RATE] <= 0.0 or free < carried:
        carried = 0.0
    share = 1.0 if carried == 0.0 else 0.5
    wind, found, higher = 0.0, True, 0.0
    if free > 0.0:
        wind, found = _least_wind(share, carried, free - carried, most, bead, core, state, step, path)
    if not found:
        wanted = carried + step.time * share * _removal(_torque_at(wind, core), core)
        if not raise_disk:
            return STALLED, 0.0, _torque_at(wind, core), 0.0
        higher = _raised(wind, wanted, bead, core, state, step, path)
    x, y, height = tip(wind, step, core, state, path, bead)
    volume = swept(bead, state, step, wind, x, y + higher)
    _cut_away(bead, state, step, wind, x, y + higher)
    if core.grinding_ratio < np.inf and volume > 0.0:
        state[WEAR] += _worn(bead, core, state, step.relaxed_angle - wind, x, y + higher)
    state[WIND], state[TIP_X], state[TIP_Z] = wind, x, y + higher
    torque = _torque_at(wind, core)
    state[RATE] = _removal(torque, core)
    return DONE, volume, torque, height + higher


@compiled
def grind(bead, core, state, center, height, relaxed_angle, time, path, mode, gains, most, second_order, out):
    """Grind a whole pass; return a code and the number of steps done.

    out[step] = wind-up, torque, fly height, tip x, tip z, removal rate, volume, patches, limited (1). `mode`:
    heights as given, the tip on its path (inverse), or led there by gains on its error, 1 and 1/s (feedback).
    """
    error, integral, begin = 0.0, 0.0, height[0]
    for k in range(center.size):
        a, b = height[k], 0.0
        if mode == INVERSE:
            a, b = 0.0, 1.0
        elif mode == FEEDBACK:
            if k == 0:
                a = begin
            else:
                gain = gains[0] + 0.5 * gains[1] * time[k]
                b = gain / (1.0 + gain)
                a = (begin + gains[1] * (integral + 0.5 * time[k] * error)) / (1.0 + gain)
        step = Step(center[k], a, b, relaxed_angle[k], 0.0, time[k])
        code, volume, torque, reached = cut_step(
            bead, core, state, step, path, most, mode != GIVEN, second_order
        )
        if code != DONE:
            return code, k
        x, y = state[TIP_X], state[TIP_Z]
        now = _along(path, bead, x) - y
        _, _, wished = tip(state[WIND], step, core, state, path, bead)
        limited = reached - wished > 1e-12
        if mode == FEEDBACK and k == 0:
            begin -= gains[0] * now
        elif mode == FEEDBACK and limited:  # the disc is held: no integration
            begin = reached - gains[0] * now - gains[1] * integral
        elif mode == FEEDBACK:
            integral += 0.5 * time[k] * (error + now)
        error = now
        row = out[k]
        row[0], row[1], row[2], row[3], row[4] = state[WIND], torque, reached, x, y
        row[5], row[6], row[7], row[8] = state[RATE], volume, state[PATCHES], 1.0 if limited else 0.0
    return DONE, center.size
