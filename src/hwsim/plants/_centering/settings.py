"""What the compiled core of a centering machine is told: slide, spindle, contact, gauges."""

import math

import numpy as np

from centering import CenteringLimits, PushScatter
from centering.kernels import gauges, slide
from centering.push import PushModel
from hwsim.plants._probe.errors import NO_ERRORS, ProbeErrors
from sdpgrind.base.checks import Floats

_BANDWIDTH = (
    2 * math.pi * 825.0
)  # rad/s, of the slide's velocity loop; with this damping it is its natural frequency, too
_DAMPING = math.sqrt(0.5)
_STROKE = 25.0  # mm, of the probe
_FORCE_MAX = 446.0  # N
_FORCE_QUANTUM = 2 * _FORCE_MAX / 4096  # N: 12 bits of the sensor's range
_FINENESS = 0.08  # of the contact's own times sqrt(M/k) and M/b
_LONGEST_STEP = 5e-4  # s


def core_settings(limits: CenteringLimits, model: PushModel, radius: float, lag_time: float) -> Floats:
    """Slide, spindle, ring (its radius in mm) and contact; a loaded slide follows late by a time constant, s."""
    cell = np.zeros(slide.SETTINGS)
    cell[slide.SPEED_MAX], cell[slide.ACCELERATION_MAX] = limits.slide_speed_max, limits.acceleration_max
    cell[slide.LOOP], cell[slide.DAMPING], cell[slide.LAG_TIME] = _BANDWIDTH, _DAMPING, lag_time
    cell[slide.SPINDLE_ACCELERATION] = limits.spindle_acceleration_max
    cell[slide.INERTIA : slide.VISCOUS + 1] = model.parameters
    cell[slide.RADIUS] = cell[slide.ROUND] = radius
    own = math.sqrt(model.inertia / model.contact_stiffness)
    if model.contact_damping > 0:
        own = min(own, model.inertia / model.contact_damping)
    cell[slide.STEP] = min(_FINENESS * own, _LONGEST_STEP)
    return cell


def gauge_settings(
    given: ProbeErrors | None, scatter: PushScatter, phase: float, radius: float, tip_radius: float
) -> Floats:
    """Slide, probe, force and spindle as they are read; the roller's runout has this phase (rad) where the errors say none."""
    errors, gauge = NO_ERRORS if given is None else given, np.zeros(gauges.GAUGES)
    gauge[gauges.COUNTS], gauge[gauges.SKEW] = errors.counts, errors.skew
    gauge[gauges.SLIDE_QUANTUM], gauge[gauges.PROBE_QUANTUM] = errors.slide_quantum, errors.probe_quantum
    gauge[gauges.STROKE] = _STROKE
    gauge[gauges.NOISE_SD] = math.hypot(errors.noise_sd, scatter.measuring_sd)
    gauge[gauges.RUNOUT_PHASE] = phase if errors.runout_phase is None else errors.runout_phase
    if tip_radius > 0:
        gauge[gauges.RUNOUT], gauge[gauges.ROLL] = errors.runout, radius / tip_radius * (1 - errors.slip)
    gauge[gauges.DUST], gauge[gauges.DUST_SIZE] = errors.dust, errors.dust_size
    gauge[gauges.FORCE_QUANTUM] = 0.0 if given is None else _FORCE_QUANTUM
    gauge[gauges.FORCE_MAX] = _FORCE_MAX
    return gauge
