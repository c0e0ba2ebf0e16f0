"""Finishing cell: ticks of arm, table, surface and torque axis, and whole parts.

A course has the columns below and is linear between rows. Arrays are changed in place. Lengths in mm, times
in s, angles in rad, torques in N m.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.timing._table_kernels import table_step
from sdpgrind.finishing.torque._axis_kernels import _axis_tick, encoder_reading
from sdpgrind.finishing.torque._controller_kernels import _controller_step, _feed_override, _torque_at
from sdpgrind.finishing.torque._states import AXIS, CONTROLLER, LAW, MOTOR

# derived: columns of a course: time, table commands, tip, normal, azimuth of the tool, weight torque,
# direction ahead, clearance in the air; their number
TIME, TABLE, TIP, NORMAL, AZIMUTH, WEIGHT, AHEAD, CLEARANCE, COLUMNS = 0, 1, 3, 6, 9, 12, 13, 16, 17

# settings of a cell
TICK, LEVER, CONTACT_ANGLE, SIDE, FRICTION, LOAD, RESOLUTION, OFFSET, CURRENT_STEP, CURRENT_MAX, SETTINGS = (
    range(11)
)

# derived: state of a cell: course and tool, then results; each table axis has three states and its command
PLAYED, LEG, SURFACE, CONTACT, TABLE_X, TABLE_Y = 0, 1, 2, 3, 6, 10
FORCE, FEED, HEIGHT, TICKS, TOUCHED, SAMPLES, EVERY = range(14, 21)
COUNT, FORCE_MEAN, FORCE_SQUARES, FORCE_MIN, FORCE_MAX, LIFTED, FEED_MEAN, FEED_SQUARES, DEVIATION = range(
    21, 30
)
AIR = 30  # derived: place of the clearance, mm, by which the surface is farther from the planned tip
STATES = 31  # derived: number of places above

TRACE = ("sample_time", "true_normal_force", "true_feed", "height_error", "true_x", "true_y")
ROWS = (
    "motor_angle",
    "path_time",
    "current_command",
    "feed_override_command",
    "torque_estimate_planned",
    "torque_ref_planned",
)

_STUCK = 0.5  # mm/s; chosen: below it friction falls with the speed, to 0 at rest
_LEAST = 0.05  # least lever over the lever arm; chosen: on steeper slopes the tool would lock itself
_ROUNDING = 1e-3  # ticks; chosen: above the rounding of summed times
_FLYING = 1e-9  # N m; chosen: above rounding


@compiled
def field(waves, place, along):
    """Height (mm) of a field at a point, slope along a direction; `waves`: vector, phase, amplitude."""
    height, slope = 0.0, 0.0
    for k in range(waves.shape[0]):
        phase = waves[k, 0] * place[0] + waves[k, 1] * place[1] + waves[k, 2] * place[2] + waves[k, 3]
        turn = waves[k, 0] * along[0] + waves[k, 1] * along[1] + waves[k, 2] * along[2]
        height += waves[k, 4] * np.cos(phase)
        slope -= waves[k, 4] * turn * np.sin(phase)
    return height, slope


@compiled
def _play(course, state, seconds):
    """Advance the course by `seconds`; return its leg and the fraction of it."""
    last = course.shape[0] - 1
    state[PLAYED] += seconds
    if state[PLAYED] > course[last, TIME] - _ROUNDING * seconds:
        state[PLAYED] = course[last, TIME]
    leg = int(state[LEG])
    while leg < last - 1 and course[leg + 1, TIME] <= state[PLAYED]:
        leg += 1
    state[LEG] = leg
    return leg, (state[PLAYED] - course[leg, TIME]) / (course[leg + 1, TIME] - course[leg, TIME])


@compiled
def _between(course, leg, share, column):
    return course[leg, column] + share * (course[leg + 1, column] - course[leg, column])


@compiled
def touch(course, waves, loop, cell, state, seconds):
    """Advance the course by `seconds`; return point and direction of contact, slope of error, weight torque.

    The tool is off its planned point by the error d of the table; the surface is higher than planned by the
    field h. Along the normal n the surface is nearer by h - d.n (d^2/2 times its curvature is neglected), so
    that the tool swings back by this over cos(theta_f), and aside along its azimuth by tan(theta_f) of it.
    """
    leg, share = _play(course, state, seconds)
    place, normal, along = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        place[i] = _between(course, leg, share, TIP + i)
        normal[i] = _between(course, leg, share, NORMAL + i)
        along[i] = _between(course, leg, share, AZIMUTH + i)
    x = _between(course, leg, share, TABLE) - course[0, TABLE]
    y = _between(course, leg, share, TABLE + 1) - course[0, TABLE + 1]
    off_x = x - table_step(loop, state[TABLE_X:TABLE_Y], x)
    off_y = y - table_step(loop, state[TABLE_Y:FORCE], y)
    place[0] += off_x
    place[1] += off_y
    height, slope = field(waves, place, along)
    state[HEIGHT] = height - off_x * normal[0] - off_y * normal[1]
    state[AIR] = _between(course, leg, share, CLEARANCE)
    aside = cell[SIDE] * np.tan(cell[CONTACT_ANGLE]) * state[HEIGHT]
    off = np.empty(3)
    for i in range(3):
        off[i] = state[HEIGHT] * normal[i] + aside * along[i]
        place[i] += off[i]
    off[0] += off_x
    off[1] += off_y
    if state[AIR] == 0.0:
        _deviate(course, leg, normal, off, state)
    weight = _between(course, leg, share, WEIGHT)
    return place, along, slope, weight


@compiled
def _deviate(course, leg, normal, off, state):
    """Keep the largest distance from the path, in the surface and across the planned direction."""
    ahead, up = 0.0, 0.0
    for i in range(3):
        ahead += off[i] * course[leg, AHEAD + i]
        up += off[i] * normal[i]
    across = 0.0
    for i in range(3):
        across += (off[i] - ahead * course[leg, AHEAD + i] - up * normal[i]) ** 2
    state[DEVIATION] = max(state[DEVIATION], np.sqrt(across))


@compiled
def begin(course, waves, loop, cell, state):
    """Put the tool at the beginning of the course."""
    place, _, _, _ = touch(course, waves, loop, cell, state, 0.0)
    for i in range(3):
        state[CONTACT + i] = place[i]
    state[SURFACE] = surface_angle(cell, state)


@compiled
def surface_angle(cell, state):
    """Motor angle (rad) at the true surface, relative to that at the planned one."""
    return -(state[HEIGHT] - state[AIR]) / (cell[LEVER] * np.cos(cell[CONTACT_ANGLE]))


@compiled
def _slide(place, along, cell, state):
    """Store the feed (mm/s) of the contact since the last tick; return its share along the tool's azimuth."""
    speed, forward = 0.0, 0.0
    for i in range(3):
        rate = (place[i] - state[CONTACT + i]) / cell[TICK]
        speed += rate * rate
        forward += rate * along[i]
        state[CONTACT + i] = place[i]
    state[FEED] = np.sqrt(speed)
    return forward / max(state[FEED], _STUCK)


@compiled
def tick(course, waves, loop, cell, axis, state, axis_state, trace, current, override):
    """Advance by a tick with a current (A) and a share of the planned speed, both held."""
    _tick(
        course,
        waves,
        loop,
        cell,
        axis.view(AXIS)[0],
        state,
        axis_state.view(MOTOR)[0],
        trace,
        current,
        override,
    )


@compiled
def _tick(course, waves, loop, cell, axis, state, motor, trace, current, override):
    """Advance by a tick, with named records of the torque axis."""
    before = state[PLAYED]
    place, along, slope, weight = touch(course, waves, loop, cell, state, override * cell[TICK])
    forward = _slide(place, along, cell, state)
    angle = cell[CONTACT_ANGLE] + cell[SIDE] * np.arctan(slope)
    lever = np.cos(angle) - cell[SIDE] * cell[FRICTION] * np.sin(angle) * forward
    surface = surface_angle(cell, state)
    _axis_tick(axis, motor, _converted(current, cell), cell[LOAD] - weight, state[SURFACE], surface)
    state[SURFACE] = surface
    state[FORCE] = max(motor.mean_torque, 0.0) / (1e-3 * cell[LEVER] * max(lever, _LEAST))
    state[TICKS] += 1.0
    if motor.mean_torque > _FLYING and state[TOUCHED] < 0.0:
        state[TOUCHED] = state[TICKS]
    if state[PLAYED] > before and state[AIR] == 0.0:
        _count(state, motor.mean_torque <= _FLYING)
    _keep(state, cell, trace)


@compiled
def _converted(current, cell):
    """Current after the converter: rounded to steps, clipped."""
    most, step = cell[CURRENT_MAX], cell[CURRENT_STEP]
    if step > 0.0:
        current = step * np.floor(current / step + 0.5)
        most = step * np.floor(most / step + 1e-9)
    return min(max(current, -most), most)


@compiled
def _count(state, flying):
    """Add a tick of the motion to means and sums of squares (Welford)."""
    state[COUNT] += 1.0
    for value, mean in ((FORCE, FORCE_MEAN), (FEED, FEED_MEAN)):
        away = state[value] - state[mean]
        state[mean] += away / state[COUNT]
        state[mean + 1] += away * (state[value] - state[mean])
    state[FORCE_MIN] = min(state[FORCE_MIN], state[FORCE])
    state[FORCE_MAX] = max(state[FORCE_MAX], state[FORCE])
    if flying:
        state[LIFTED] += 1.0


@compiled
def _keep(state, cell, trace):
    """Keep each `EVERY`-th tick in the trace; when it is full, drop every second row."""
    if state[TICKS] % state[EVERY] != 0.0:
        return
    row = int(state[SAMPLES])
    if row == trace.shape[0]:
        row //= 2
        for k in range(row):
            for column in range(trace.shape[1]):
                trace[k, column] = trace[2 * k + 1, column]
        state[EVERY] *= 2.0
        state[SAMPLES] = row
        if state[TICKS] % state[EVERY] != 0.0:
            return
    trace[row, 0] = state[TICKS] * cell[TICK]
    trace[row, 1], trace[row, 2], trace[row, 3] = state[FORCE], state[FEED], state[HEIGHT]
    trace[row, 4], trace[row, 5] = state[CONTACT], state[CONTACT + 1]
    state[SAMPLES] = row + 1


@compiled
def shown(cell, axis_state):
    """Reading of the encoder, rad."""
    return _shown(cell, axis_state.view(MOTOR)[0])


@compiled
def _shown(cell, motor):
    return encoder_reading(motor.angle + cell[OFFSET], cell[RESOLUTION])


@compiled
def finish(
    course,
    waves,
    loop,
    cell,
    axis,
    state,
    axis_state,
    trace,
    law,
    controller,
    time,
    torque,
    known,
    table,
    most,
):
    """Run a controller until the table of rows is full or the part is done; return rows and whether done."""
    motor, known_axis = axis_state.view(MOTOR)[0], axis.view(AXIS)[0]
    setting, told = law.view(LAW)[0], controller.view(CONTROLLER)[0]
    for row in range(table.shape[0]):
        angle, played = _shown(cell, motor), state[PLAYED]
        current = _controller_step(setting, told, angle, played, time, torque, 0.0, 0.0)
        override = _feed_override(setting, told)
        table[row, 0], table[row, 1], table[row, 2], table[row, 3] = angle, played, current, override
        load = _torque_at(time, known, played, told)
        table[row, 4], table[row, 5] = told.estimate - load, told.reference - load
        _tick(course, waves, loop, cell, known_axis, state, motor, trace, current, override)
        if state[PLAYED] >= course[course.shape[0] - 1, TIME] or state[TICKS] >= most:
            return row + 1, True
    return table.shape[0], False
