"""Exact push of a part that rests, sticks, slips or flies (Mears 5.26-5.27)."""

import numpy as np

from centering.push._contact.phase_kernels import FREE, SLIP, _horizon, _mode_of, _phase, _phase_energies
from centering.push._profile.rows import STILL
from sdpgrind.base.compiling.compiled import compiled

FINAL_POSITION, FREE_SLIDE, PEAK_FORCE, TIME, EVENTS, ENERGY_ERROR, BREAKAWAY_TIME, FINAL_SPEED = range(8)
"""Columns of the result of a push: mm, mm, N, s, count, relative, s (NaN: no breakaway), mm/s."""
COLUMNS = 8  # derived: number of columns above
# derived: at the beginning of a phase time (s), mode, tip (mm, mm/s, mm/s^2), gap (mm), part speed (mm/s)
LOG_COLUMNS = 7

DONE, TOO_MANY, STALLED = range(3)
"""How a push ended."""
EVENTS_MAX = 200_000  # chosen: four times the phases of the slowest useful push of the lightest part
_STALLED = 200  # chosen: phases in a row without duration that count as no progress
TRAVEL, FORCE, WORK = range(3)
"""What is asked of a push: where it ends; the peak force too; the energy balance too (most of the time)."""
_WORK, _FRICTION, _FLYING, _LEFT_AT = range(4)


@compiled
def push(parameters, segments, start, out, log, asked):
    """Simulate a push; write its result into `out` and its phases into the rows of `log`; return the status.

    `parameters`: M (N s^2/mm), k (N/mm), b (N s/mm), F_s (N), F_k (N), k_v (N s/mm). `segments`, (n, 3):
    duration (s), initial velocity (mm/s) and acceleration (mm/s^2) of the tip, which begins at `start` (mm);
    the resting part is at 0. `log`, (m, LOG_COLUMNS), takes one row more than there are events; m may be 0.
    `asked`: TRAVEL, FORCE or WORK; what is not asked is written as infinite force and NaN balance.

    After the last segment a tip that does not advance keeps its speed until the part rests; a tip that
    advances ends the push. A part at rest that a receding tip still touches stays.
    """
    law = (parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5])
    sums = _blank(out, asked)
    tip, gap, speed, tip_speed = start, start, 0.0, 0.0
    for s in range(segments.shape[0]):
        duration, tip_speed, acceleration = segments[s, 0], segments[s, 1], segments[s, 2]
        tip, gap, speed, status = _segment(
            law, duration, tip, tip_speed, acceleration, gap, speed, out, log, sums, asked
        )
        tip_speed += acceleration * duration
        if status != DONE:
            return status
    tip_speed = _end_speed(segments, tip_speed)
    if tip_speed <= 0.0:
        tip, gap, speed, status = _segment(
            law, np.inf, tip, tip_speed, 0.0, gap, speed, out, log, sums, asked
        )
        speed = 0.0 if status == DONE else speed
    _finish(law, tip, tip_speed, gap, speed, out, log, sums, asked)
    return status


@compiled
def _blank(out, asked):
    """Clear the result of a push; return its sums. No force exceeds an infinite peak: none is searched."""
    out[:COLUMNS] = 0.0
    out[BREAKAWAY_TIME] = np.nan
    if asked < FORCE:
        out[PEAK_FORCE] = np.inf
    return np.zeros(4)


@compiled
def push_many(parameters, segments, ends, starts, out, status, asked):
    """Simulate pushes: row i (or the only one) of `parameters`, segments up to ``ends[i]`` (or all)."""
    log = np.empty((0, LOG_COLUMNS))
    for i in range(out.shape[0]):
        profile = i if ends.size > 1 else 0
        begin = ends[profile - 1] if profile > 0 else 0
        law = parameters[i if parameters.shape[0] > 1 else 0]
        status[i] = push(law, segments[begin : ends[profile]], starts[profile], out[i], log, asked)


@compiled
def _end_speed(segments, speed):
    """Speed (mm/s) at the end of segments, 0 where it is rounding of a standstill."""
    greatest = 0.0
    for s in range(segments.shape[0]):
        begins = segments[s, 1]
        greatest = max(greatest, abs(begins), abs(begins + segments[s, 2] * segments[s, 0]))
    return speed if abs(speed) > STILL * greatest else 0.0


@compiled
def _segment(law, duration, tip, tip_speed, acceleration, gap, speed, out, log, sums, asked):
    """Follow the part over a segment (inf: until it rests); return tip, gap (mm), speed (mm/s), status."""
    time, begun, stalled = 0.0, out[TIME], 0
    mode = _mode_of(law, gap, tip_speed - speed, speed, acceleration)
    while True:
        moved = tip + (tip_speed + 0.5 * acceleration * time) * time
        velocity = tip_speed + acceleration * time
        _note(mode, moved, velocity, acceleration, gap, speed, out, log, sums)
        left = duration - time if duration < np.inf else _horizon(law, mode, gap, velocity, speed)
        if left <= 0.0:
            break
        taken, after, gap_after, speed_after, peak = _phase(
            law, mode, gap, velocity, acceleration, speed, left, out[PEAK_FORCE]
        )
        out[PEAK_FORCE] = max(out[PEAK_FORCE], peak)
        if asked == WORK:
            _add_energies(law, mode, gap, velocity, acceleration, speed, speed_after, gap_after, taken, sums)
        time, gap, speed = time + taken, gap_after, speed_after
        out[TIME] = begun + time
        if taken == left:
            break
        mode = after
        stalled = 0 if taken > 0.0 else stalled + 1
        if stalled > _STALLED:
            return tip, gap, speed, STALLED
        if out[EVENTS] >= EVENTS_MAX:
            return tip, gap, speed, TOO_MANY
    return tip + (tip_speed + 0.5 * acceleration * time) * time, gap, speed, DONE


@compiled
def _note(mode, tip, tip_speed, acceleration, gap, speed, out, log, sums):
    """Record the beginning of a phase: count, row of the log, breakaway, start of a flight."""
    row = int(out[EVENTS])
    if row < log.shape[0]:
        log[row, 0], log[row, 1], log[row, 2], log[row, 3] = out[TIME], mode, tip, tip_speed
        log[row, 4], log[row, 5], log[row, 6] = acceleration, gap, speed
    out[EVENTS] += 1.0
    if mode == SLIP and np.isnan(out[BREAKAWAY_TIME]):
        out[BREAKAWAY_TIME] = out[TIME]
    _slide(tip - gap, out, sums)
    if mode == FREE and sums[_FLYING] == 0.0:
        sums[_LEFT_AT] = tip - gap
    sums[_FLYING] = 1.0 if mode == FREE else 0.0


@compiled
def _slide(position, out, sums):
    """Update the longest flight; an unfinished one counts with its length so far."""
    if sums[_FLYING] == 1.0:
        out[FREE_SLIDE] = max(out[FREE_SLIDE], position - sums[_LEFT_AT])


@compiled
def _add_energies(law, mode, gap, tip_speed, acceleration, speed, speed_after, gap_after, taken, sums):
    """Add the works of a phase."""
    if mode in (SLIP, FREE):
        travel = (tip_speed + 0.5 * acceleration * taken) * taken - (gap_after - gap)
        work, drag = _phase_energies(law, mode, gap, tip_speed, acceleration, speed, taken)
        sums[_WORK] += work
        sums[_FRICTION] += law[4] * travel + drag


@compiled
def _finish(law, tip, tip_speed, gap, speed, out, log, sums, asked):
    """Record where and how the push has ended."""
    row = int(out[EVENTS])
    if row < log.shape[0]:
        log[row, 0], log[row, 1], log[row, 2], log[row, 3] = out[TIME], log[row - 1, 1], tip, tip_speed
        log[row, 4], log[row, 5], log[row, 6] = 0.0, gap, speed
    _slide(tip - gap, out, sums)
    out[FINAL_POSITION], out[FINAL_SPEED] = tip - gap, speed
    scale = sums[_WORK] + 0.5 * law[3] * law[3] / law[1]  # work and energy stored in the contact at breakaway
    balance = sums[_WORK] - sums[_FRICTION] - 0.5 * law[0] * speed * speed
    out[ENERGY_ERROR] = abs(balance) / scale if asked == WORK else np.nan
