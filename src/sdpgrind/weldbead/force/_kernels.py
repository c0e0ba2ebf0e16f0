"""Compiled steps of the force loop: table drive, play, sensor, controller, and a stiff contact.

Functions work on plain arrays in place, serial and without allocation: kernels of stands call them. A
sub-step of a table drive is exact for a held command; friction is solved for at the end of the sub-step
(implicitly), so that the speed is exactly 0 while the table sticks and nothing chatters.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.control.kernels import LawCore, law_output, law_update, quantised


class DriveCore(NamedTuple):
    """Table drive over one sub-step; state: motor x mm, speed v mm/s, lag w mm, played mm, platform mm.

    v' = gain (lead e + (1 - lead) w) - ... - friction, e = command - tachometer v - x, w' = (e - w)/lag.
    """

    transition: Floats
    command: Floats
    friction: Floats
    gain: float
    lead: float
    tachometer: float
    decay: float
    friction_max: float
    half_play: float
    half_backlash: float


class SensorCore(NamedTuple):
    """Analogue filter over one sub-step (force linear in it), then a digital filter every `ratio` sub-steps.

    State: analogue (n), last force, two of the digital filter, its output, sub-steps since its last sample.
    """

    transition: Floats
    old: Floats
    new: Floats
    output: Floats
    numerator: Floats
    denominator: Floats
    ratio: int
    quantum: float


@compiled
def drive_of(row):
    """Constants of a drive from their row (22,): a call with a named tuple takes Python 4 us, not 0.3."""
    return DriveCore(
        row[:9].reshape(3, 3), row[9:12], row[12:15],
        row[15], row[16], row[17], row[18], row[19], row[20], row[21],
    )  # fmt: skip


@compiled
def sensor_of(row, n):
    """Constants of a sensor with an analogue filter of order `n` from their row (n^2 + 3 n + 8,)."""
    a, b = n * n, n * n + 3 * n
    return SensorCore(
        row[:a].reshape(n, n), row[a : a + n], row[a + n : a + 2 * n], row[a + 2 * n : b],
        row[b : b + 3], row[b + 3 : b + 6], int(row[b + 6]), row[b + 7],
    )  # fmt: skip


class ControlCore(NamedTuple):
    """Controller of one sample: feedback law, model of the loop, limits; see `control_step`."""

    law: LawCore
    model: LawCore
    stiffness: float
    blend: float
    follows_model: bool
    low: float
    high: float
    rate: float
    contact: float
    patience: int
    approach: float


@compiled
def _play_step(position, played, half):
    """Position after a play of half-width `half`, mm: it moves only when pushed."""
    return min(max(played, position - half), position + half)


@compiled
def _backlash_step(position, platform, half, touch):
    """Platform in a dead zone, mm: pressed down to the start of contact (`touch`) or to the lower flank."""
    moved = min(max(platform, position - half), position + half)
    return max(position - half, touch) if moved > touch else moved


@compiled
def drive_step(state, command, core, touch):
    """Advance a table drive by one sub-step in place; return the platform position, mm.

    `touch` is the platform position at which contact begins, mm; inf: no contact.
    """
    x, v, w = state[0], state[1], state[2]
    stuck = False
    if core.friction_max > 0.0 and v == 0.0:
        error = command - x
        lagged = error + (w - error) * core.decay
        before = core.gain * (core.lead * error + (1.0 - core.lead) * w)
        after = core.gain * (core.lead * error + (1.0 - core.lead) * lagged)
        stuck = max(abs(before), abs(after)) <= core.friction_max
        if stuck:
            state[2] = lagged
    if not stuck:
        _slide(state, x, v, w, command, core)
    state[3] = _play_step(state[0], state[3], core.half_play)
    state[4] = _backlash_step(state[3], state[4], core.half_backlash, touch)
    return state[4]


@compiled
def _slide(state, x, v, w, command, core):
    """Sub-step in motion: friction just stops the table, or is all there is."""
    A, b, f = core.transition, core.command, core.friction
    for i in range(3):
        state[i] = A[i, 0] * x + A[i, 1] * v + A[i, 2] * w + b[i] * command
    if core.friction_max > 0.0:
        stopping = -state[1] / f[1]
        friction = min(max(stopping, -core.friction_max), core.friction_max)
        for i in range(3):
            state[i] += f[i] * friction
        if friction == stopping:
            state[1] = 0.0


@compiled
def sensor_step(state, force, core):
    """Advance a force sensor by one sub-step in place; `force`, N, is that at its end."""
    order = core.output.size
    last = state[order]
    state[order] = force
    total = 0.0
    for i in range(order):
        total += core.output[i] * _row(core, state, i, last, force)
    for i in range(order):
        state[i] = state[order + 5 + i]
    state[order + 4] += 1.0
    if state[order + 4] >= core.ratio:
        state[order + 4] = 0.0
        _filter(state, total, core, order)


@compiled
def _row(core, state, i, last, force):
    """One entry of the new analogue state, kept behind the state until all are done."""
    order = core.output.size
    total = core.old[i] * last + core.new[i] * force
    for k in range(order):
        total += core.transition[i, k] * state[k]
    state[order + 5 + i] = total
    return total


@compiled
def _filter(state, value, core, order):
    """Digital filter of second order, transposed direct form."""
    b, a = core.numerator, core.denominator
    out = b[0] * value + state[order + 1]
    state[order + 1] = b[1] * value - a[1] * out + state[order + 2]
    state[order + 2] = b[2] * value - a[2] * out
    state[order + 3] = out


@compiled
def sensor_read(state, core, noise):
    """Return the reading, N: last filtered sample plus noise, in whole quanta."""
    return quantised(state[core.output.size + 3] + noise, core.quantum)


@compiled(error_model="numpy")
def control_sample(row, n, state, work, force, demand, position):
    """`control_step` for Python, with the constants as a row; `n`: order of the law."""
    m = state.size - n - 4
    law = n * n + 3 * n + 1
    r = row[law + m * m + 3 * m + 1 :]
    core = ControlCore(
        _law_of(row[:law], n), _law_of(row[law:], m), r[0], r[1], r[2] != 0.0, r[3], r[4], r[5], r[6],
        int(r[7]), r[8],
    )  # fmt: skip
    return control_step(core, state, work, force, demand, position)


@compiled(error_model="numpy")
def _law_of(row, n):
    """Constants of a law of order `n` from their row, which may be longer."""
    a = n * n
    return LawCore(
        row[:a].reshape(n, n), row[a : a + n], row[a + n : a + 2 * n], row[a + 2 * n],
        row[a + 2 * n + 1 : a + 3 * n + 1],
    )  # fmt: skip


@compiled(error_model="numpy")
def control_step(core, state, work, force, demand, position):
    """Return the platform command of one sample, mm.

    `force` (N) is the reading (NaN: none), `demand` (N) the planned force and `position` (mm) the planned
    platform position, both ahead by the lag of the loop where the controller follows a model. State: law,
    model, then correction (mm), command (mm; NaN before the first), samples without contact, last error (N).
    The law's state is corrected for a replaced command, so that it resumes without a bump.
    """
    law, model = core.law, core.model
    n, m = law.B.size, model.B.size
    inner, foreseen, rest = state[:n], state[n : n + m], state[n + m :]
    wanted = law_output(model, foreseen, demand) if core.follows_model else demand
    law_update(model, foreseen, demand, 0.0, work)
    rest[2] = rest[2] + 1.0 if force < core.contact < wanted else 0.0
    lost = rest[2] >= core.patience
    missing = np.isnan(force)
    error = rest[3]
    if not missing:
        error = (1.0 - core.blend) * (wanted - force) - core.blend * core.stiffness * rest[0]
    asked = law_output(law, inner, error)
    command = position + (rest[0] if missing else asked)
    if lost:
        command = rest[1] + min(core.approach, core.rate)
    elif not np.isnan(rest[1]):
        command = min(max(command, rest[1] - core.rate), rest[1] + core.rate)
    command = min(max(command, core.low), core.high)
    rest[0], rest[1], rest[3] = command - position, command, error
    law_update(law, inner, error, command - position - asked, work)
    return command


@compiled(error_model="numpy")
def exported_step(state, core, force, demand, position, out):
    """Take one sample as `control_step` does; `out`: platform command (mm)."""
    out[0] = control_step(core, state, np.empty(state.size), force, demand, position)
    return 0


@compiled
def _contact_force(platform, surface, stiffness):
    """Force of a stiff contact, N; 0 where the platform is below the surface."""
    return stiffness * max(0.0, platform - surface)


@compiled
def plant_sample(command, drive, sensor, drive_core, sensor_core, surface, stiffness, forces):
    """Advance drive, contact and sensor by one control sample; `surface`, `forces`: one entry a sub-step."""
    for j in range(surface.size):
        platform = drive_step(drive, command, drive_core, surface[j])
        forces[j] = _contact_force(platform, surface[j], stiffness)
        sensor_step(sensor, forces[j], sensor_core)


@compiled
def simulate_core(
    control, state, drive, sensor, queue, cores, demand, position, surface, stiffness, noise, record
):
    """Close the loop over stiff contact; return commands (mm) and readings (N), one a sample.

    `surface`: (samples, sub-steps) mm; `record`: forces (samples, sub-steps) N.
    """
    drive_core, sensor_core = cores
    samples = demand.size
    commands, readings = np.empty(samples), np.empty(samples)
    work = np.empty(state.size)
    for k in range(samples):
        readings[k] = sensor_read(sensor, sensor_core, noise[k])
        commands[k] = control_step(control, state, work, readings[k], demand[k], position[k])
        applied = delay_step(queue, commands[k])
        plant_sample(applied, drive, sensor, drive_core, sensor_core, surface[k], stiffness, record[k])
    return commands, readings


@compiled
def delay_step(queue, value):
    """Push `value` into a queue of whole samples in place; return its oldest."""
    if queue.size == 0:
        return value
    out = queue[0]
    for k in range(queue.size - 1):
        queue[k] = queue[k + 1]
    queue[-1] = value
    return out
