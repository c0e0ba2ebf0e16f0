"""Contact of a round tip with a ring with lobes, and readings of the probe, sample by sample.

Rows of lobes: undulations per revolution, amplitude (mm), phase (rad). Lengths in mm, times in s, angles in
rad. Arrays are changed in place.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# shape of ring and tip; REACH: sum of amplitudes; SCAN: whether the tip may touch twice
RADIUS, TIP, REACH, UPR_MAX, SCAN, SHAPE = range(6)

# settings; tick: TICK_ABOVE/TICK_BELOW s; PER_TURN: triggered samples in a turn, 0: one each tick; START:
# count of the encoder, or an angle without counts
TICK_ABOVE, TICK_BELOW, PER_TURN, COUNTS, START, SKEW = range(6)
RUNOUT, RUNOUT_PHASE, ROLL, NOISE_SD, DUST, DUST_SIZE = range(6, 12)
PROBE_QUANTUM, SLIDE_QUANTUM, FOLLOW_TIME, HALF_STROKE = range(12, 16)
MOVE_TIME, MOVE_X, MOVE_Y, SETTINGS = range(16, 20)

# state; NEXT: number of the next sample; SPEED since SINCE (time) and ANGLE; SLIDE follows TARGET, of SEEN
NEXT, SPEED, SINCE, ANGLE, SLIDE, TARGET, SEEN, LOST, CENTER_X, CENTER_Y, MOVED, STATES = range(12)

COLUMNS = ("angle", "reading", "slide", "probe", "ticks")

_SCANNED = 16.0  # places in an undulation searched for contacts; chosen: fewer may miss one
_STEP = 1e-13  # rad; chosen: Newton's next step is below rounding
_MOST = 80  # chosen: bisection alone reaches rounding


@compiled
def _profile(shape, lobes, at):
    """Radius of the surface at a polar angle about its centre, with two derivatives."""
    radius, first, second = shape[RADIUS], 0.0, 0.0
    for k in range(lobes.shape[0]):
        upr, amplitude = lobes[k, 0], lobes[k, 1]
        turn = upr * at - lobes[k, 2]
        cosine = amplitude * np.cos(turn)
        radius += cosine
        first -= upr * amplitude * np.sin(turn)
        second -= upr * upr * cosine
    return radius, first, second


@compiled
def _tip(shape, lobes, along, across, angle, ahead):
    """Centre of a tip touching the surface `ahead` of the probe line: distance from it, slope, place on it.

    The part's centre is at (along, across) of the line. The tip's centre is off the surface by its radius,
    along the normal, which is turned back from the polar direction by atan(s'/s).
    """
    radius, first, second = _profile(shape, lobes, angle + ahead)
    length = np.sqrt(radius * radius + first * first)
    sine, cosine = np.sin(ahead), np.cos(ahead)
    normal_x = (radius * cosine + first * sine) / length
    normal_y = (radius * sine - first * cosine) / length
    bend = 1.0 - (second * radius - first * first) / (length * length)
    beside = across + radius * sine + shape[TIP] * normal_y
    return beside, (length + shape[TIP] * bend) * normal_x, along + radius * cosine + shape[TIP] * normal_x


@compiled
def _touch(shape, lobes, along, across, angle, low, high, ahead):
    """Position on the line and polar angle of the contact, by Newton's method within a bracket."""
    place = 0.0
    for _ in range(_MOST):
        beside, slope, place = _tip(shape, lobes, along, across, angle, ahead)
        if beside > 0.0:
            high = ahead
        else:
            low = ahead
        following = ahead - beside / slope if slope > 0.0 else high + 1.0
        if not low <= following <= high:
            following = 0.5 * (low + high)
        step, ahead = following - ahead, following
        if abs(step) <= _STEP:
            break
    _, _, place = _tip(shape, lobes, along, across, angle, ahead)
    return place, ahead


@compiled
def _within(shape, away):
    """Largest polar angle off the line at which the surface can be `away` from it."""
    reach = shape[REACH] if away > 0.0 else -shape[REACH]
    return np.arcsin(min(max(away / (shape[RADIUS] - reach), -1.0), 1.0))


@compiled
def _outermost(shape, lobes, along, across, angle):
    """The outermost of all possible contacts: in a narrow valley the tip rests on both flanks."""
    low, high = -_within(shape, across + shape[TIP]), _within(shape, shape[TIP] - across)
    pieces = int(np.ceil((high - low) * shape[UPR_MAX] * _SCANNED / (2.0 * np.pi))) + 8
    best, where = -np.inf, low
    before, last = low, -1.0
    for k in range(1, pieces + 1):
        here = low + (high - low) * k / pieces
        beside, _, _ = _tip(shape, lobes, along, across, angle, here)
        if k == pieces:
            beside = max(beside, 1e-300)  # beside the line by rounding alone
        if last <= 0.0 < beside:
            place, ahead = _touch(shape, lobes, along, across, angle, before, here, 0.5 * (before + here))
            if place > best:
                best, where = place, ahead
        before, last = here, beside
    return best, where


@compiled
def contact(shape, lobes, center_x, center_y, angle):
    """Reading (mm) at a spindle angle, and polar angle of the contact about the part's centre, unwrapped."""
    sine, cosine = np.sin(angle), np.cos(angle)
    along, across = center_x * cosine + center_y * sine, center_y * cosine - center_x * sine
    if shape[SCAN] != 0.0:
        place, ahead = _outermost(shape, lobes, along, across, angle)
    else:
        start = np.arcsin(-across / (shape[RADIUS] + shape[TIP]))
        place, ahead = _touch(shape, lobes, along, across, angle, -0.5 * np.pi, 0.5 * np.pi, start)
    return place - shape[TIP], angle + ahead


@compiled
def contacts(shape, lobes, center_x, center_y, angles, reading, part_angle):
    """Contacts at many spindle angles."""
    for k in range(angles.shape[0]):
        reading[k], part_angle[k] = contact(shape, lobes, center_x, center_y, angles[k])


@compiled
def least_spread(shape, lobes, places):
    """Least derivative of the tip centre's travel by polar angle on the parallel curve; < 0: it bridges."""
    least = np.inf
    for k in range(places):
        radius, first, second = _profile(shape, lobes, 2.0 * np.pi * k / places)
        square = radius * radius + first * first
        least = min(least, np.sqrt(square) + shape[TIP] * (1.0 - (second * radius - first * first) / square))
    return least


@compiled
def rounded(value, step):
    """Nearest multiple of `step`; 0: unrounded."""
    return step * np.floor(value / step + 0.5) if step > 0.0 else value


@compiled
def edge_angle(cell, k):
    """Spindle angle that triggers sample k: an edge of the encoder, or any angle without steps."""
    if cell[COUNTS] > 0.0:
        return (cell[START] + np.floor(k * cell[COUNTS] / cell[PER_TURN] + 0.5)) * (
            2.0 * np.pi / cell[COUNTS]
        )
    return cell[START] + k * (2.0 * np.pi / cell[PER_TURN])


@compiled
def due(cell, state):
    """Tick of the next sample, and true spindle angle when the probe is read.

    The trigger is an edge of the encoder; the probe was read SKEW before it.
    """
    k = state[NEXT]
    if cell[PER_TURN] == 0.0:
        seconds = k * cell[TICK_ABOVE] / cell[TICK_BELOW]
        return k, state[ANGLE] + state[SPEED] * (seconds - state[SINCE])
    edge = edge_angle(cell, k)
    seconds = state[SINCE] + max(edge - state[ANGLE], 0.0) / state[SPEED]
    return np.ceil(seconds * cell[TICK_BELOW] / cell[TICK_ABOVE]), edge - state[SPEED] * cell[SKEW]


@compiled
def _follow(cell, state, seconds):
    """Move the slide towards the last reading."""
    passed = seconds - state[SEEN]
    state[SLIDE] += (state[TARGET] - state[SLIDE]) * (1.0 - np.exp(-passed / cell[FOLLOW_TIME]))
    state[SEEN] = seconds


@compiled
def _errors(cell, part_angle, normal, first, second):
    """Error of the reading: runout of the roller, noise, dust."""
    tone = cell[RUNOUT] * np.cos(cell[ROLL] * part_angle - cell[RUNOUT_PHASE])
    dust = cell[DUST_SIZE] * (0.5 + second) if first < cell[DUST] else 0.0
    return tone + cell[NOISE_SD] * normal + dust


@compiled
def measure(shape, lobes, cell, state, normals, uniforms, out):
    """Take the next samples, one a row: readings of spindle, slide and probe, and the tick."""
    for row in range(out.shape[0]):
        ticks, angle = due(cell, state)
        seconds = ticks * cell[TICK_ABOVE] / cell[TICK_BELOW]
        if state[MOVED] == 0.0 and seconds >= cell[MOVE_TIME]:
            state[CENTER_X] += cell[MOVE_X]
            state[CENTER_Y] += cell[MOVE_Y]
            state[MOVED] = 1.0
        radial, part_angle = contact(shape, lobes, state[CENTER_X], state[CENTER_Y], angle)
        if state[NEXT] == 0.0:
            state[SLIDE] = radial
        _follow(cell, state, seconds)
        state[TARGET] = radial
        probe = (
            radial
            + _errors(cell, part_angle, normals[row], uniforms[row, 0], uniforms[row, 1])
            - state[SLIDE]
        )
        step = 2.0 * np.pi / cell[COUNTS] if cell[COUNTS] > 0.0 else 0.0
        if abs(probe) > cell[HALF_STROKE]:
            state[LOST] += 1.0
            probe = np.nan
        out[row, 0] = rounded(angle + state[SPEED] * cell[SKEW], step)
        out[row, 2] = rounded(state[SLIDE], cell[SLIDE_QUANTUM])
        out[row, 3] = rounded(probe, cell[PROBE_QUANTUM])
        out[row, 1] = out[row, 2] + out[row, 3]
        out[row, 4] = ticks
        state[NEXT] += 1.0
