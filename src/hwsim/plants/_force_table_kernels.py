"""Compiled core of the force table: a tilted disc on a bead, the table under it, the sensors, one control sample at a time.

Everything lives in arrays that are changed in place; serial, without allocation. The cut is solved by volume balance: the
disc angle with which the metal between the old and the new pose of the disc is what the power removes meanwhile.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.force._kernels import DriveCore, SensorCore, drive_step, sensor_step

_OPTIONS: Any = {"cache": True, "nogil": True}
_TOLERANCE = 1e-12  # rad

# Places in the state of a machine (mm, s, N, rad, W).
CENTER, TIP_X, TIP_Z, WIND, WIND_RATE, WIND_ACCELERATION, RATE, PHASE, SPIN, WEAR, FORCE, REMOVED, INTEGRAL = range(13)
FORCE_SUM, POWER_SUM, OVER_SUM, READ_FORCE, STATES = 13, 14, 15, 16, 17


class DiscCore(NamedTuple):
    """Disc, grinder and motor over one grinding sub-step of `step` s."""

    step: float
    radius: float
    width: float
    relaxed_angle: float
    spring_angles: Floats
    spring_torques: Floats
    inertia: float  # N mm s^2; 0: none
    damping: float  # N mm s
    free_speed: float
    speed_droop: float
    spin_time: float  # s; 0: the spin follows the load at once
    runout: float
    grinding_ratio: float  # volume ground for a volume worn
    reads_spring: bool  # the sensor sees the spring, not the contact
    burn_force: float  # N; inf: no limit


class Truth(NamedTuple):
    """Coefficients of one pass."""

    specific_energy: float
    idle_power: float
    friction_ratio: float


@njit(**_OPTIONS)
def spring_torque(wind, angles, torques):
    """Torque (N mm) of the compliance wound up by `wind` (rad): a table, its end pieces carried on, odd below 0."""
    size = abs(wind)
    k = 1
    while k < angles.size - 1 and size > angles[k]:
        k += 1
    torque = torques[k - 1] + (torques[k] - torques[k - 1]) * (size - angles[k - 1]) / (angles[k] - angles[k - 1])
    return torque if wind >= 0.0 else -torque


@njit(**_OPTIONS)
def swept(z, grid, disc, state, pose, wind, cut):
    """Volume (mm^3) between metal and the disc that goes on from its old tip to `pose` wound up by `wind`, and nodes in it.

    `grid`: x of the first node, spacing, highest metal (mm). Metal is taken away where `cut`.
    """
    angle = disc.relaxed_angle - wind
    tip_x, tip_z = pose[0] - disc.radius * np.cos(angle), pose[1] - disc.radius * np.sin(angle)
    slope, old_x, old_z = np.tan(angle), state[TIP_X], state[TIP_Z]
    path = (tip_z - old_z) / (tip_x - old_x) if tip_x > old_x else 0.0
    first = max(0, int(np.ceil((min(tip_x, old_x) - grid[0]) / grid[1])))
    reach = min(pose[0], tip_x + (grid[2] - tip_z) / slope)
    last = min(z.size - 1, int(np.floor((max(reach, tip_x) - grid[0]) / grid[1])))
    total, nodes = 0.0, 0
    for i in range(first, last + 1):
        x = grid[0] + i * grid[1]
        lower = tip_z + (x - tip_x) * slope if x >= tip_x else old_z + (x - old_x) * path
        if z[i] > lower:
            total += (z[i] - lower) * (0.5 if i in (0, z.size - 1) else 1.0)
            nodes += 1
            if cut:
                z[i] = lower
    return total * grid[1] * disc.width, nodes


@njit(**_OPTIONS)
def removal(torque, disc, state, truth):
    """Removal rate (mm^3/s) of a torque (N mm) at the contact: the power that exceeds the idle power (Brown (6.13))."""
    power = state[SPIN] * truth.friction_ratio * max(torque, 0.0) / 1000.0
    return max(0.0, power - truth.idle_power) / truth.specific_energy


@njit(**_OPTIONS)
def inertial(disc, state):
    """Torque (N mm) beside the spring's that turns the grinder, as slope and offset in its wind-up after the step."""
    if disc.inertia == 0.0:
        return 0.0, 0.0
    h = disc.step
    wind, rate, acceleration = state[WIND], state[WIND_RATE], state[WIND_ACCELERATION]
    slope = 4.0 * disc.inertia / h**2 + 2.0 * disc.damping / h
    offset = disc.inertia * (4.0 * wind / h**2 + 4.0 * rate / h + acceleration) + disc.damping * (2.0 * wind / h + rate)
    return slope, offset


@njit(**_OPTIONS)
def contact_torque(wind, disc, slope, offset):
    """Torque (N mm) by which the metal must hold the disc where it is."""
    return spring_torque(wind, disc.spring_angles, disc.spring_torques) + slope * wind - offset


@njit(**_OPTIONS)
def free_wind(disc, slope, offset):
    """Wind-up (rad) of a disc that touches nothing."""
    if slope == 0.0:
        return 0.0
    low, high = -1.0, 1.0
    wind = offset / (slope + disc.spring_torques[1] / disc.spring_angles[1])
    for _ in range(60):
        torque = contact_torque(wind, disc, slope, offset)
        if abs(torque) <= 1e-9 * (abs(offset) + 1.0):
            break
        low, high = (wind, high) if torque < 0.0 else (low, wind)
        wind = 0.5 * (low + high)
    return wind


@njit(**_OPTIONS)
def cut_step(z, grid, disc, state, pose, truth):
    """Bring the disc to `pose` (center x, fly height; mm), cut, and return volume (mm^3), contact torque, nodes in contact."""
    slope, offset = inertial(disc, state)
    free = free_wind(disc, slope, offset)
    volume, nodes = swept(z, grid, disc, state, pose, free, False)
    old = 0.5 * disc.step * state[RATE]
    share = 0.5 if state[RATE] > 0.0 and volume >= old else 1.0
    carried = old if share < 1.0 else 0.0
    wind, torque = free, 0.0
    if volume > 0.0:
        wind = _wound(z, grid, disc, state, pose, truth, (slope, offset, free, share, carried, volume))
        torque = max(0.0, contact_torque(wind, disc, slope, offset))
    volume, nodes = swept(z, grid, disc, state, pose, wind, True)
    _keep(disc, state, pose, wind, removal(torque, disc, state, truth))
    return volume, torque, nodes


@njit(**_OPTIONS)
def _excess(z, grid, disc, state, pose, truth, wind, balance):
    """Volume in the way less volume that is removed in the step; falls with the wind-up."""
    slope, offset, _, share, carried, _ = balance
    volume, _ = swept(z, grid, disc, state, pose, wind, False)
    torque = contact_torque(wind, disc, slope, offset)
    return volume - disc.step * share * removal(torque, disc, state, truth) - carried


@njit(**_OPTIONS)
def _wound(z, grid, disc, state, pose, truth, balance):
    """Least wind-up (rad) with nothing in the way: a bracket round the last one, then false position kept honest."""
    free, first = balance[2], balance[5] - balance[4]
    low, at_low = free, first
    high, step = max(state[WIND], free) + 2e-5, 1e-4
    at_high = _excess(z, grid, disc, state, pose, truth, high, balance)
    while at_high > 0.0 and high < disc.relaxed_angle - 0.02:
        low, at_low = high, at_high
        high, step = min(high + step, disc.relaxed_angle - 0.02), 4.0 * step
        at_high = _excess(z, grid, disc, state, pose, truth, high, balance)
    if low == free and high - 4e-5 > free:
        trial = high - 4e-5
        value = _excess(z, grid, disc, state, pose, truth, trial, balance)
        if value > 0.0:
            low, at_low = trial, value
        else:
            high, at_high = trial, value
    side = 0
    for k in range(100):
        if high - low <= _TOLERANCE:
            break
        middle = 0.5 * (low + high) if k % 3 == 2 or at_high == 0.0 else (low * at_high - high * at_low) / (at_high - at_low)
        value = _excess(z, grid, disc, state, pose, truth, middle, balance)
        if value > 0.0:
            low, at_low = middle, value
            at_high = 0.5 * at_high if side == 1 else at_high
            side = 1
        else:
            high, at_high = middle, value
            at_low = 0.5 * at_low if side == -1 else at_low
            side = -1
            if value == 0.0 and removal(contact_torque(high, disc, balance[0], balance[1]), disc, state, truth) > 0.0:
                break
    return high


@njit(**_OPTIONS)
def _keep(disc, state, pose, wind, rate):
    """Remember pose, wind-up with its derivatives, and removal rate."""
    angle = disc.relaxed_angle - wind
    state[TIP_X], state[TIP_Z] = pose[0] - disc.radius * np.cos(angle), pose[1] - disc.radius * np.sin(angle)
    if disc.inertia > 0.0:
        h, moved = disc.step, wind - state[WIND]
        acceleration = 4.0 * (moved / h - state[WIND_RATE]) / h - state[WIND_ACCELERATION]
        state[WIND_RATE] = 2.0 * moved / h - state[WIND_RATE]
        state[WIND_ACCELERATION] = acceleration
    state[WIND] = wind
    state[INTEGRAL] += 0.5 * disc.step * (state[RATE] + rate)
    state[RATE] = rate


@njit(**_OPTIONS)
def _wear_and_spin(disc, state, truth, volume, torque, nodes, spacing):
    """What the cut does to the disc and to its motor."""
    if volume > 0.0 and disc.grinding_ratio < np.inf:
        patch = max(nodes, 1) * spacing / np.cos(disc.relaxed_angle - state[WIND])
        state[WEAR] += volume / (disc.grinding_ratio * 2.0 * np.pi * (disc.radius - 0.5 * patch) * patch)
    state[PHASE] = (state[PHASE] + disc.step * state[SPIN]) % (2.0 * np.pi)
    loaded = max(0.0, disc.free_speed - disc.speed_droop * truth.friction_ratio * torque)
    follows = 1.0 if disc.spin_time == 0.0 else 1.0 - np.exp(-disc.step / disc.spin_time)
    state[SPIN] += follows * (loaded - state[SPIN])


@njit(**_OPTIONS)
def sample(z, grid, disc, state, truth, feed, command, drive, drive_core, sensors, sensor_core, shape):
    """Advance by one control sample. `shape`: grinding sub-steps, table sub-steps in each, datum (mm), contact stiffness.

    `sensors`: states of the normal and the tangential force sensor. Sums over the sample go into the state.
    """
    grinding, table, datum, stiffness = int(shape[0]), int(shape[1]), shape[2], shape[3]
    state[FORCE_SUM], state[POWER_SUM], state[OVER_SUM] = 0.0, 0.0, 0.0
    pose = np.empty(2)
    for _ in range(grinding):
        before = state[READ_FORCE]
        platform = drive[4]
        for _ in range(table):
            touch = platform - state[FORCE] / stiffness if state[FORCE] > 0.0 else np.inf
            platform = drive_step(drive, command, drive_core, touch)
        state[CENTER] += feed * disc.step
        pose[0] = state[CENTER]
        pose[1] = datum - platform + state[WEAR] + disc.runout * np.sin(state[PHASE])
        volume, torque, nodes = cut_step(z, grid, disc, state, pose, truth)
        state[REMOVED] += volume
        state[FORCE] = torque / disc.radius
        _sense(disc, state, truth, before, sensors, sensor_core, table)
        state[FORCE_SUM] += state[FORCE] / grinding
        state[POWER_SUM] += state[SPIN] * truth.friction_ratio * torque / 1000.0 / grinding
        state[OVER_SUM] += disc.step if state[FORCE] > disc.burn_force else 0.0
        _wear_and_spin(disc, state, truth, volume, torque, nodes, grid[1])


@njit(**_OPTIONS)
def _sense(disc, state, truth, before, sensors, sensor_core, table):
    """Both force sensors over one grinding sub-step, forces a straight line in it."""
    now = state[FORCE]
    if disc.reads_spring:
        now = spring_torque(state[WIND], disc.spring_angles, disc.spring_torques) / disc.radius
    for k in range(table):
        force = before + (now - before) * (k + 1) / table
        sensor_step(sensors[0], force, sensor_core)
        sensor_step(sensors[1], truth.friction_ratio * max(force, 0.0), sensor_core)
    state[READ_FORCE] = now


__all__ = ["DiscCore", "DriveCore", "SensorCore", "Truth", "cut_step", "sample", "spring_torque", "swept"]
