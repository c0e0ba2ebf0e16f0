"""Simulated part: true state, readings of the gauges, and whole parts under a controller, compiled."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import control_step
from sdpgrind.plunge._control.cycle_kernels import moved
from sdpgrind.plunge._model.drive import Drive
from sdpgrind.plunge._model.kernels import (
    PlungeCore,
    _damage,
    _deflected,
    _pair_near,
    _rate_near,
    _worn,
    rate,
    reserve,
)
from sdpgrind.plunge._model.model import PlungeModel

# State: deflection beyond ploughing, rate, remaining stock, wear flat area over that at the start, least
# slack while balancing and in the part, gauge readings, command not yet executed, samples, distance by which
# the axis trails its target, reserve; then the commands that have not acted yet (mm/s).
Y, RATE, REMAINING, WORN, SLACK, PART_SLACK, LAST_SIZE, LAST_POWER, UNFED, SAMPLES, TRAIL = range(11)
RESERVE, STATES = range(SAMPLES + 2, SAMPLES + 4)
RETRACT = at.RETRACT  # section in which the part is done
DAMAGE_TOLERANCE = 1e-6  # chosen: damage counted as none, mm; above the error of the integration
HALVINGS = 50  # derived: a bracket of a sample shrinks below 1e-16 s
STEPS = 2  # measured: Runge-Kutta steps per sample, error of the cycle time 1e-9 s
COLUMNS = ("size", "grinding_power", "power_saturated")
PLANNED = tuple(at.REPORTS)
ROW = ("samples", *COLUMNS, "command_rate", "balancing", *PLANNED)  # columns of the table of a part


class PartRig(NamedTuple):
    """True parameters of a part and its gauges; exact gauges by default."""

    core: PlungeCore
    sample_time: float
    stock: float
    samples_max: int
    growth: float = 0.0  # of the wear flat area at the reference rate, relative, 1/mm
    growth_exponent: float = 0.0
    growth_rate: float = 1.0  # reference rate, mm/s
    contact_zero: float = 0.0  # command lacking at contact, mm
    size_sd: float = 0.0
    size_offset: float = 0.0
    size_delay: bool = False  # one sample late
    power_sd: float = 0.0  # relative
    power_gain: float = 1.0
    power_max: float = np.inf  # W: saturation
    power_pole: float = 0.0  # pole of the monitor per sample; 0: no lag
    command_quantum: float = 0.0  # mm: step of the actuator; 0: none
    feed_lag: float = 0.0  # s: time constant of the axis
    feed_delay: int = 0  # samples: dead time of the command
    wheel_wear: float = 0.0  # radial wear of the wheel over radial stock
    idle_power: float = 0.0  # W
    coldest_rate: float = 0.0  # mm/s: below it burning is an artefact of the ploughing force


def rig(model: PlungeModel, stock: float, sample_time: float, samples_max: int = 20_000) -> PartRig:
    """Parameters of a part with exact gauges."""
    exact = PartRig(model.core, float(sample_time), float(stock), samples_max)
    low, high = model.burn_onset
    coldest = float(low) if low <= high else 0.0  # a work that burns at every rate has no artefact
    exact = exact._replace(wheel_wear=model.wheel_wear, coldest_rate=coldest)
    if model.wear is None:
        return exact
    growth = model.wear.growth / model.wear_flat_area
    return exact._replace(
        growth=growth, growth_exponent=model.wear.exponent, growth_rate=model.wear.reference_rate
    )


def driven(rig: PartRig, drive: Drive) -> PartRig:
    """Part whose feed and power monitor are those of a drive."""
    return rig._replace(
        power_pole=drive.power_pole(rig.sample_time),
        command_quantum=float(drive.command_quantum),
        feed_lag=float(drive.feed_lag),
        feed_delay=drive.delay_samples(rig.sample_time),
        idle_power=float(drive.idle_power),
    )


def part_state(rig: PartRig) -> Floats:
    """State of a part before its start, with a place for each command that has not acted yet."""
    return np.zeros(STATES + rig.feed_delay)


@compiled
def start_part(state, rig):
    """Set the state at the start of a part."""
    for place in range(state.size):
        state[place] = 0.0
    state[Y], state[REMAINING], state[WORN] = -rig.core.K0 - rig.contact_zero, rig.stock, 1.0
    state[RATE] = rate(state[Y], rig.core)
    state[SLACK] = state[PART_SLACK] = state[RESERVE] = np.inf


@compiled
def read(state, rig, of_size, of_power):
    """Size (mm), power (W) and whether it is clipped, from two standard normal numbers."""
    now = rig.stock - state[REMAINING]
    size = state[LAST_SIZE] if rig.size_delay else now
    state[LAST_SIZE] = now
    if rig.power_pole <= 0.0:
        state[LAST_POWER] = true_power(state, rig)
    power = (state[LAST_POWER] + rig.idle_power) * (rig.power_gain + rig.power_sd * of_power)
    saturated = power >= 0.99 * rig.power_max
    return size + rig.size_offset + rig.size_sd * of_size, min(power, rig.power_max), saturated


@compiled
def true_power(state, rig):
    """Power at the contact, W; proportional to the deflection until the wheel cuts."""
    core, v = _worn(rig.core, state[WORN]), state[RATE]
    x = state[Y] + rig.core.K0
    if state[Y] > 0.0:
        return core.power0 + core.power1 * v + core.power2 * v**core.p
    return core.power0 * x / rig.core.K0 if x > 0.0 else 0.0


@compiled
def update_slacks(state, rig, balanced):
    """Update the reserve and the least slacks: of samples with damage, and while the controller balances."""
    core, rate = _worn(rig.core, state[WORN]), state[RATE]
    state[RESERVE] = min(state[RESERVE], reserve(rate, state[REMAINING], rig.coldest_rate, core))
    burn = _damage(rate, core)
    slack = state[REMAINING] - burn
    if burn > DAMAGE_TOLERANCE:
        state[PART_SLACK] = min(state[PART_SLACK], slack)
    if balanced:
        state[SLACK] = min(state[SLACK], slack)


@compiled
def advance(state, rig, command_rate):
    """Advance by one sample at a command rate, mm/s."""
    u, dt = command_rate, rig.sample_time
    if rig.command_quantum > 0.0:
        state[UNFED] += u * dt
        fed = np.rint(state[UNFED] / rig.command_quantum) * rig.command_quantum
        state[UNFED] -= fed
        u = fed / dt
    before = true_power(state, rig) if rig.power_pole > 0.0 else 0.0
    if rig.feed_delay > 0:
        place = STATES + int(state[SAMPLES]) % rig.feed_delay
        u, state[place] = state[place], u
    for _ in range(STEPS):
        _ground(state, rig, u, dt / STEPS)
    state[SAMPLES] += 1.0
    if rig.power_pole > 0.0:
        now, pole = true_power(state, rig), rig.power_pole
        state[LAST_POWER] = _monitored(state[LAST_POWER], before, now, pole, np.log(pole))


@compiled
def _ground(state, rig, u, h):
    """Grind for a step (s) at the acting command, mm/s."""
    halfway = state[WORN] + 0.5 * _wear(rig, state[RATE] * h, h)
    removed = _fed(state, rig, u, h, _worn(rig.core, halfway))
    state[REMAINING] -= removed
    if rig.growth > 0.0:
        state[WORN] += _wear(rig, removed, h)
        state[RATE] = _rate_near(state[Y], state[RATE], _worn(rig.core, state[WORN]))


@compiled(inline="always")
def _monitored(shown, before, after, pole, log_pole):
    """Power shown (W) a sample later by a monitor with a pole, where the true power changes linearly."""
    late = 1.0 - pole
    return pole * shown + late * before + (after - before) * (1.0 + late / log_pole)


@compiled
def _fed(state, rig, u, h, core):
    """Feed by a command (mm/s) for a duration (s); return the stock removed, mm."""
    before = state[Y]
    if rig.feed_lag <= 0.0 and rig.wheel_wear == 0.0:
        state[Y], state[RATE] = _deflected(before, state[RATE], u, h, 1, core)
        return before + u * h - state[Y]
    first, fed = 0.0, moved(state[TRAIL], u, h, rig.feed_lag)
    if before < 0.0 < before + fed:
        first = _until_contact(state[TRAIL], u, h, rig.feed_lag, -before)
    start = moved(state[TRAIL], u, first, rig.feed_lag)
    half = moved(state[TRAIL], u, 0.5 * (first + h), rig.feed_lag) - start
    growth = 1.0 + rig.wheel_wear
    state[Y], state[RATE] = _driven(before + start, state[RATE], half, fed - start, h - first, growth, core)
    state[TRAIL] += u * h - fed
    return (fed - (state[Y] - before)) / growth


@compiled
def _until_contact(trail, u, duration, lag, gap):
    """Time (s), at most `duration`, in which the axis moves by `gap` (mm): bisection."""
    low, high = 0.0, duration
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if moved(trail, u, middle, lag) < gap:
            low = middle
        else:
            high = middle
    return high


@compiled
def _driven(y, near, half, whole, duration, growth, core):
    """Deflection beyond ploughing (mm) and rate (mm/s) after the axis moved by `half`, then `whole` (mm).

    y - p, p the position of the axis, falls by `growth` times the rate: Runge and Kutta.
    """
    v, w = _pair_near(y, near, near**core.p, core)
    a = -growth * v
    v, w = _pair_near(y + half + 0.5 * duration * a, v, w, core)
    b = -growth * v
    v, w = _pair_near(y + half + 0.5 * duration * b, v, w, core)
    c = -growth * v
    v, w = _pair_near(y + whole + duration * c, v, w, core)
    after = y + whole + duration / 6.0 * (a + 2.0 * b + 2.0 * c - growth * v)
    return after, _pair_near(after, v, w, core)[0]


@compiled
def _wear(rig, removed, duration):
    """Relative growth of the wear flat area while `removed` (mm) is ground in a duration (s)."""
    if rig.growth <= 0.0 or removed <= 0.0:
        return 0.0
    return rig.growth * (removed / duration / rig.growth_rate) ** rig.growth_exponent * removed


@compiled
def grind(state, rig, control, law, normals, table, row):
    """Run a part under a controller until it is done or `normals` end; return the rows of the table.

    Order of a sample: read, decide, update_slacks, advance. Negative rows: the part is done.
    """
    for k in range(normals.shape[0]):
        size, power, saturated = read(state, rig, normals[k, 0], normals[k, 1])
        table[row, 0], table[row, 1], table[row, 2] = state[SAMPLES], size, power
        table[row, 3] = 1.0 if saturated else 0.0
        if state[SAMPLES] >= rig.samples_max:
            table[row, 4:] = np.nan
            return -(row + 1)
        command = control_step(control, law, size, np.nan if saturated else power)
        ended = control[at.SECTION] == at.RETRACT
        table[row, 4] = np.nan if ended else command
        table[row, 5] = np.nan if ended else control[at.BALANCED]
        table[row, 6], table[row, 7] = control[at.SECTION], control[at.RATE]
        table[row, 8], table[row, 9] = control[at.REMAINING], control[at.SHARPNESS]
        table[row, 10], table[row, 11] = control[at.ZERO], control[at.SCALE]
        table[row, 12] = control[at.SATURATED]
        row += 1
        update_slacks(state, rig, control[at.BALANCED] > 0.0)
        if ended:
            return -row
        advance(state, rig, command)
    return row
