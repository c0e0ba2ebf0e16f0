"""Simulated part: true state, readings of the gauges, and whole parts under a controller, compiled."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import control_step
from sdpgrind.plunge._model.kernels import PlungeCore, _damage, _deflected, _rate_near, _worn, rate
from sdpgrind.plunge._model.model import PlungeModel

# State: deflection beyond ploughing, rate, remaining stock, wear flat area over that at the start, least
# slack while balancing and in the part, gauge readings, command not yet executed, samples.
Y, RATE, REMAINING, WORN, SLACK, PART_SLACK, LAST_SIZE, LAST_POWER, UNFED, SAMPLES, STATES = range(11)
RETRACT = at.RETRACT  # section in which the part is done
DAMAGE_TOLERANCE = 1e-6  # chosen: damage counted as none, mm; above the error of the integration
STEPS = 2  # measured: Runge-Kutta steps per sample, error of the cycle time 1e-9 s
COLUMNS = ("size", "grinding_power", "power_saturated")
PLANNED = ("section", "infeed_rate", "remaining", "wear_flat_area", "contact_zero", "deflection_scale")
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
    power_lag: float = 0.0  # pole of the monitor per sample; 0: no lag
    command_quantum: float = 0.0  # mm: step of the actuator; 0: none


def rig(model: PlungeModel, stock: float, sample_time: float, samples_max: int = 20_000) -> PartRig:
    """Parameters of a part with exact gauges."""
    exact = PartRig(model.core, float(sample_time), float(stock), samples_max)
    if model.wear is None:
        return exact
    growth = model.wear.growth / model.wear_flat_area
    return exact._replace(
        growth=growth, growth_exponent=model.wear.exponent, growth_rate=model.wear.reference_rate
    )


@compiled
def start_part(state, rig):
    """Set the state at the start of a part."""
    for place in range(STATES):
        state[place] = 0.0
    state[Y], state[REMAINING], state[WORN] = -rig.core.K0 - rig.contact_zero, rig.stock, 1.0
    state[RATE] = rate(state[Y], rig.core)
    state[SLACK] = state[PART_SLACK] = np.inf


@compiled
def read(state, rig, of_size, of_power):
    """Size (mm), power (W) and whether it is clipped, from two standard normal numbers."""
    now = rig.stock - state[REMAINING]
    size = state[LAST_SIZE] if rig.size_delay else now
    state[LAST_SIZE] = now
    state[LAST_POWER] = rig.power_lag * state[LAST_POWER] + (1.0 - rig.power_lag) * true_power(state, rig)
    power = state[LAST_POWER] * (rig.power_gain + rig.power_sd * of_power)
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
    """Update the least slacks: of samples with damage, and of those while the controller balances."""
    burn = _damage(state[RATE], _worn(rig.core, state[WORN]))
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
    for _ in range(STEPS):
        h = dt / STEPS
        before, halfway = state[Y], state[WORN] + 0.5 * _wear(rig, state[RATE] * h, h)
        state[Y], state[RATE] = _deflected(before, state[RATE], u, h, 1, _worn(rig.core, halfway))
        removed = before + u * h - state[Y]
        state[REMAINING] -= removed
        if rig.growth > 0.0:
            state[WORN] += _wear(rig, removed, h)
            state[RATE] = _rate_near(state[Y], state[RATE], _worn(rig.core, state[WORN]))
    state[SAMPLES] += 1.0


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
        row += 1
        update_slacks(state, rig, control[at.BALANCED] > 0.0)
        if ended:
            return -row
        advance(state, rig, command)
    return row
