"""One control sample on the force table: disc on bead, table, motor, sensors.

The cut is that of the pass planner (`sdpgrind.weldbead.passes`), table and sensors are those of the force
loop; runout, spin and grinder inertia are added here. Arrays are changed in place.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.weldbead.force.kernels import drive_of, drive_step, sensor_of, sensor_step
from sdpgrind.weldbead.passes.kernels import DONE, RATE, WIND, Bead, CutCore, Step, cut_of, cut_step

# places in the state of a machine: mm, s, N, rad, rad/s, mm^3
CENTER, DEFLECTION, DEFLECTION_RATE, PHASE, SPIN, FORCE, SHOWN = range(7)
REMOVED, INTEGRAL, FORCE_SUM, STATES = range(7, 11)


class Grinder(NamedTuple):
    """Disc, grinder and motor over one grinding sub-step."""

    step: float  # s
    relaxed_angle: float
    stiffness: float  # N mm/rad; of a grinder with inertia
    inertia: float  # N mm s^2; 0: none
    damping: float  # N mm s
    free_speed: float
    speed_droop: float
    spin_time: float  # s; 0: the spin follows its load without delay
    runout: float  # mm
    reads_spring: bool  # the sensor sees the spring, not the contact


class TableLayout(NamedTuple):
    """Sub-steps of a sample, and the height of platform position 0."""

    grinding: int
    table: int  # sub-steps in each grinding sub-step
    datum: float  # mm
    contact_stiffness: float  # N/mm


@compiled
def inertial(grinder, state):
    """Slope and offset of the torque (N mm) on the grinder, as a function of its deflection after the step.

    Backward Euler: bouncing on the unilateral contact never gains energy.
    """
    h, J, c = grinder.step, grinder.inertia, grinder.damping
    slope = J / h**2 + c / h
    return slope, slope * state[DEFLECTION] + J / h * state[DEFLECTION_RATE]


@compiled
def moved(grinder, state, deflection):
    """Store the deflection and its rate."""
    state[DEFLECTION_RATE] = (deflection - state[DEFLECTION]) / grinder.step
    state[DEFLECTION] = deflection


@compiled
def ground(bead, core, cut, grinder, state, height):
    """Move the disc to its present position and cut; return volume (mm^3) and torque (N mm) of the contact.

    With inertia the disc is on a stiffer spring, relaxed at the deflection of free flight.
    """
    free = 0.0
    if grinder.inertia > 0.0:
        slope, offset = inertial(grinder, state)
        free = offset / (grinder.stiffness + slope)
    angle = grinder.relaxed_angle - free
    now = CutCore(
        core.radius, core.angles, core.torques, angle - 0.02, state[SPIN], 0.0, core.friction_ratio,
        core.specific_energy, core.idle_power, core.grinding_ratio,
    )  # fmt: skip
    cut[WIND] = max(0.0, state[DEFLECTION] - free)
    rate = cut[RATE]
    place = Step(state[CENTER], height, 0.0, angle, grinder.runout * np.sin(state[PHASE]), grinder.step)
    # Variables where constants would do, and an array of the core for the path, unused at the given height:
    # other types would compile the cut a second time.
    raised, second_order = grinder.step < 0.0, grinder.step > 0.0
    code, volume, torque, _ = cut_step(bead, now, cut, place, core.angles, now.wind_max, raised, second_order)
    if code == DONE:
        moved(grinder, state, cut[WIND] + free)
    state[INTEGRAL] += 0.5 * grinder.step * (rate + cut[RATE])
    return volume, torque


@compiled
def spun(grinder, friction_ratio, torque, state):
    """Advance the spin angle, and the spin towards its value under load."""
    state[PHASE] = (state[PHASE] + grinder.step * state[SPIN]) % (2.0 * np.pi)
    loaded = max(0.0, grinder.free_speed - grinder.speed_droop * friction_ratio * torque)
    share = 1.0 if grinder.spin_time == 0.0 else 1.0 - np.exp(-grinder.step / grinder.spin_time)
    state[SPIN] += share * (loaded - state[SPIN])


@compiled
def sensed(core, grinder, state, before, sensors, sensor_core, table):
    """Advance both force sensors over a grinding sub-step with linear forces."""
    now = state[FORCE]
    if grinder.reads_spring and grinder.inertia > 0.0:
        now = grinder.stiffness * state[DEFLECTION] / core.radius
    normal, tangential = sensors[0], sensors[1]
    for k in range(table):
        force = before + (now - before) * (k + 1) / table
        sensor_step(normal, force, sensor_core)
        sensor_step(tangential, core.friction_ratio * max(force, 0.0), sensor_core)
    state[SHOWN] = now


@compiled
def sample(z, area, top, machine, ground, cut, state, drive, sensors, feed, command):
    """Advance by one control sample at a feed (mm/s) with a constant platform command (mm).

    Rows of constants (`sdpgrind.base.states.flat`): `machine` of layout, drive and sensors, `ground` of bead,
    grinder and disc.
    """
    layout = TableLayout(int(machine[0]), int(machine[1]), machine[2], machine[3])
    drive_core, sensor_core = drive_of(machine[4:26]), sensor_of(machine[26:], (sensors.shape[1] - 5) // 2)
    bead, core = Bead(ground[0], ground[1], z, area, top), cut_of(ground[12:])
    g = ground[2:12]
    grinder = Grinder(g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8], g[9] != 0.0)
    _sample(bead, core, cut, grinder, state, feed, command, drive, drive_core, sensors, sensor_core, layout)


@compiled
def _sample(bead, core, cut, grinder, state, feed, command, drive, drive_core, sensors, sensor_core, layout):
    state[FORCE_SUM] = 0.0
    platform = drive[4]
    for _ in range(layout.grinding):
        before = state[SHOWN]
        for _ in range(layout.table):
            touch = platform - state[FORCE] / layout.contact_stiffness if state[FORCE] > 0.0 else np.inf
            platform = drive_step(drive, command, drive_core, touch)
        state[CENTER] += feed * grinder.step
        volume, torque = ground(bead, core, cut, grinder, state, layout.datum - platform)
        state[REMOVED] += volume
        state[FORCE] = torque / core.radius
        state[FORCE_SUM] += state[FORCE] / layout.grinding
        sensed(core, grinder, state, before, sensors, sensor_core, layout.table)
        spun(grinder, core.friction_ratio, torque, state)
