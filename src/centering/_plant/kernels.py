"""A ring on a turning table and the tip that pushes it, from event to event.

The laws are those of `ring_kernels`. Steps are of fourth order and short against the oscillation of the
contact; touch, separation, stop and breakaway are located within a step. Arrays are those of `slide_kernels`.
"""

import numpy as np

from centering._plant import probe_kernels as probe
from centering._plant import ring_kernels as ring
from centering._plant import slide_kernels as slide
from sdpgrind.base.compiling.compiled import compiled

_NEAR = 0.8  # pull over breakaway force; chosen: above it a ring at rest is advanced in small steps
_FASTEST = 150.0  # mm/s; chosen: above the speed of any tip
_SPLITS = 60  # derived: an event time to rounding
# chosen: steps in a piece, beyond 20 times an uneventful one's; only endless stick-slip exceeds it
_STEPS_MAX = 100_000
_CLOSE = 1e-12  # s; chosen: below the rounding of event times
_STILL = 1e-6  # mm/s; chosen: a viscous ring never stops by itself
_SLOW = 0.5  # rim speed over friction's change of it in a step; chosen: a slower spin stops with the ring
# step over stopping time of a spinning ring, and least step over `STEP`; chosen: longer steps miss how the
# friction of a slow ring turns, shorter ones cost time
_RESOLVED, _FINEST = 0.1, 0.03
_PEAK_NEAR = 0.01  # relative; chosen: peaks that exceed the last one by a step's rise are found


@compiled
def _when(cell, pose, x, y, u, v, way_x, way_y):
    """Event functions of a sliding ring: speed along its way, closure, and contact force."""
    _, _, force, closure = ring.contact_force(cell, pose, x, y, u, v)
    return u * way_x + v * way_y, closure, force


@compiled
def _happens(onward, closure, force, spins, closed, pushed):
    """Whether a stop, a touch, a separation or a renewed push has occurred; a spinning ring does not stop."""
    return (onward <= 0.0 and not spins) or (closure > 0.0) != closed or (force > 0.0) != pushed


@compiled
def _move(state, cell, profile, begin, time, step):
    """Advance a sliding ring by a step, or to an earlier stop, touch or separation; return the time, s.

    `begin`: pose at its beginning; the one at its end is returned, too.
    """
    x, y, u, v = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    w, z = ring.way(state, cell, begin)
    _, closure, force = _when(cell, begin, x, y, u, v, w, z)
    closed, pushed = closure > 0.0, force > 0.0
    slow = _SLOW * cell[slide.COULOMB] * cell[slide.FRICTION] / cell[slide.INERTIA] * cell[slide.STEP]
    low, high, taken = 0.0, step, step
    for _ in range(_SPLITS):
        middle = ring.pose(state, cell, profile, begin[7], time + 0.5 * taken)
        end = ring.pose(state, cell, profile, begin[7], time + taken)
        x, y, u, v, s = ring.slide_on(state, cell, (begin, middle, end), w, z, taken)
        onward, closure, force = _when(cell, end, x, y, u, v, w, z)
        if _happens(onward, closure, force, abs(s) > slow, closed, pushed):
            high = taken
            if high - low < _CLOSE:
                break
        else:
            low = taken
            if low == step:
                break
        taken = 0.5 * (low + high) if high - low >= _CLOSE else high
    before, after = state[slide.SPEED_X] ** 2 + state[slide.SPEED_Y] ** 2, u * u + v * v
    state[slide.X], state[slide.Y] = x, y
    state[slide.SPEED_X], state[slide.SPEED_Y], state[slide.SPIN] = u, v, s
    if abs(s) <= slow and (onward <= 0.0 or after < min(before, _STILL * _STILL)):
        state[slide.SPEED_X], state[slide.SPEED_Y] = 0.0, 0.0
        state[slide.SPIN], state[slide.MOVING] = 0.0, 0.0
    return taken, end


@compiled
def _at_rest(state, cell, pose):
    """Whether a ring at rest stays at rest, and the closure."""
    pull_x, pull_y, closure = ring.pull(cell, pose, state[slide.X], state[slide.Y], 0.0, 0.0)
    most = ring.holds(state, cell)
    return pull_x * pull_x + pull_y * pull_y <= most * most, closure


@compiled
def _wait(state, cell, profile, begin, time, step):
    """Advance a ring at rest by a step, or until it is touched or set in motion; return as `_move`."""
    stays, closure = _at_rest(state, cell, begin)
    if not stays:
        state[slide.MOVING] = 1.0
        if ring.contact_force(cell, begin, state[slide.X], state[slide.Y], 0.0, 0.0)[2] == 0.0:
            state[slide.SLIPPED] = 1.0
        return 0.0, begin
    end = ring.pose(state, cell, profile, begin[7], time + step)
    later, closed = _at_rest(state, cell, end)
    if later and not closure < 0.0 < closed:
        return step, end
    low, high = 0.0, step
    for _ in range(_SPLITS):
        middle = 0.5 * (low + high)
        if high - low < _CLOSE:
            break
        stays, closed = _at_rest(state, cell, ring.pose(state, cell, profile, begin[7], time + middle))
        if stays and not closure < 0.0 < closed:
            low = middle
        else:
            high = middle
    return high, ring.pose(state, cell, profile, begin[7], time + high)


@compiled
def _far(state, cell, begin, swing, length):
    """Whether nothing can happen to a ring at rest within a piece: the tip is far, and the table slow.

    `swing`: peak to valley of the rim, mm.
    """
    if state[slide.MOVING] != 0.0:
        return False
    x, y = state[slide.X], state[slide.Y]
    spin = max(abs(state[slide.SPEED]), abs(state[slide.SPEED_SET]))
    offset = np.sqrt(x * x + y * y)
    rate = slide.spindle_rate(state, cell)
    pull = cell[slide.INERTIA] * offset * np.sqrt(spin**4 + rate * rate)
    if pull > _NEAR * ring.holds(state, cell):
        return False
    closure = ring.contact_force(cell, begin, x, y, 0.0, 0.0)[3]
    return closure < -(_FASTEST + 2.0 * spin * offset) * length - swing


@compiled
def _feel(state, cell, pose):
    """Note the force of the contact, and its beginning."""
    where = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    _, _, force, closure = ring.contact_force(cell, pose, *where)
    state[slide.FORCE] = force
    state[slide.PEAK] = max(state[slide.PEAK], force)
    state[slide.PEAK_EVER] = max(state[slide.PEAK_EVER], force)
    if force > 0.0 and state[slide.TOUCHES] == 0.0 and state[slide.SEGMENT] < 0.0:
        state[slide.COLLISIONS] += 1.0
    if closure > 0.0:
        state[slide.TOUCHES] = 1.0
    elif closure < 0.0:
        state[slide.TOUCHES] = 0.0
    return closure > 0.0


@compiled
def _crest(state, cell, profile, aim, time, step, x, y, u, v, before):
    """Note the peak force within a completed step: a parabola through begin, middle and end."""
    after = state[slide.FORCE]
    if step <= 0.0 or max(before, after) * (1.0 + _PEAK_NEAR) < state[slide.PEAK]:
        return
    end_x, end_y, end_u, end_v = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    eighth = 0.125 * step
    middle_x, middle_y = 0.5 * (x + end_x) + eighth * (u - end_u), 0.5 * (y + end_y) + eighth * (v - end_v)
    middle_u, middle_v = (
        1.5 * (end_x - x) / step - 0.25 * (u + end_u),
        1.5 * (end_y - y) / step - 0.25 * (v + end_v),
    )
    middle = ring.pose(state, cell, profile, aim, time + 0.5 * step)
    force = ring.contact_force(cell, middle, middle_x, middle_y, middle_u, middle_v)[2]
    rise, bend = 0.5 * (after - before), before - 2.0 * force + after
    if force > 0.0 and bend < 0.0 and abs(rise) < -bend:
        most = force - 0.5 * rise * rise / bend
        state[slide.PEAK] = max(state[slide.PEAK], most)
        state[slide.PEAK_EVER] = max(state[slide.PEAK_EVER], most)


@compiled
def _step(state, cell):
    """Longest step now, s; shorter for a spinning ring so slow that its friction changes direction fast."""
    if state[slide.MOVING] == 0.0 or (state[slide.SPIN] == 0.0 and slide.spindle_rate(state, cell) == 0.0):
        return cell[slide.STEP]
    speed = np.sqrt(state[slide.SPEED_X] ** 2 + state[slide.SPEED_Y] ** 2 + state[slide.SPIN] ** 2)
    turns = speed * cell[slide.INERTIA] / (cell[slide.COULOMB] * cell[slide.FRICTION])
    return min(cell[slide.STEP], max(_RESOLVED * turns, _FINEST * cell[slide.STEP]))


@compiled
def _piece(state, cell, profile, lobes, length):
    """Advance the ring through a piece of the slide's motion, s; return the used part, to a first touch."""
    aim = ring.aim_of(cell)
    now = ring.pose(state, cell, profile, aim, 0.0)
    cell[slide.RADIUS] = ring.rim(state, cell, lobes, now)
    if _far(state, cell, now, 2.0 * lobes[:, 1].sum(), length):
        state[slide.FORCE] = 0.0
        return length
    time, steps = 0.0, 0
    touched = _feel(state, cell, now)
    while time < length - _CLOSE:
        if touched and state[slide.SEGMENT] >= 0.0 and state[slide.TOUCHED] == 0.0:
            if time > 0.0:
                return time
            state[slide.TOUCHED] = 1.0
            now = ring.pose(state, cell, profile, aim, time)  # the tip begins to lag
        step = min(_step(state, cell), length - time)
        steps += 1
        if steps > _STEPS_MAX + 20.0 * length / cell[slide.STEP]:
            raise RuntimeError(
                "a ring that is pushed starts and stops without end: "
                "stiffness, damping and friction fit no step"
            )
        x, y, u, v = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
        moves, before, since = state[slide.MOVING] != 0.0, state[slide.FORCE], time
        if moves:
            taken, now = _move(state, cell, profile, now, time, step)
        else:
            taken, now = _wait(state, cell, profile, now, time, step)
        time += taken
        cell[slide.RADIUS] = ring.rim(state, cell, lobes, now)
        touched = _feel(state, cell, now)
        if moves and before > 0.0 and state[slide.FORCE] > 0.0:
            _crest(state, cell, profile, aim, since, time - since, x, y, u, v, before)
    return length


@compiled
def advance(state, cell, profile, lobes, until):
    """Advance slide, spindle and ring to a time or the waiting profile's start; return whether it came."""
    while state[slide.TIME] < until - _CLOSE:
        length = slide.piece_length(state, cell, profile, until - state[slide.TIME])
        length = _piece(state, cell, profile, lobes, length)
        slide.commit(state, cell, profile, length)
        if (
            state[slide.SEGMENT] >= 0.0
            and state[slide.GONE] >= profile[int(state[slide.SEGMENT]), 0] - _CLOSE
        ):
            row = int(state[slide.SEGMENT]) + 1
            if row < profile.shape[0]:
                slide.begin_segment(state, profile, row)
            else:
                state[slide.SEGMENT], state[slide.ACCELERATION] = -1.0, 0.0
        if state[slide.ARMED] != 0.0 and slide.time_to(state, cell, state[slide.START]) <= _CLOSE:
            return True
    state[slide.TIME] = until
    return False


@compiled
def settled(state):
    """Whether the ring lies still on the table."""
    return state[slide.MOVING] == 0.0


@compiled
def reading(state, shape, lobes):
    """Reading of a faultless probe now, mm from the axis, and polar angle of its contact on the part."""
    return probe.contact(shape, lobes, state[slide.X], state[slide.Y], state[slide.ANGLE])
