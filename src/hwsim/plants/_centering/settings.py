"""Settings of the compiled core of a centering machine: slide, spindle, contact, gauges."""

import math

import numpy as np

from centering import CenteringLimits, PushScatter
from centering.kernels import gauges, slide
from centering.push import PushModel
from hwsim.plants._probe.errors import NO_ERRORS, ProbeErrors
from sdpgrind.base.checks import Floats

# Velocity loop of the slide; with this damping the bandwidth is the natural frequency.
_BANDWIDTH = 2 * math.pi * 825.0  # rad/s; source: Mears (2006)
_DAMPING = math.sqrt(0.5)  # chosen: the source gives none
_STROKE = 25.0  # stroke of the probe, mm; source: Mears (2006)
_FORCE_MAX = 446.0  # range of the force sensor, N; source: Mears (2006)
_FORCE_QUANTUM = 2 * _FORCE_MAX / 4096  # N; derived: 12 bits of the sensor's range
_FINENESS = 0.08  # step over the contact's times sqrt(M/k) and M/b; chosen: larger ones lose accuracy
_LONGEST_STEP = 5e-4  # s; chosen: as above, for soft contacts


def core_settings(limits: CenteringLimits, model: PushModel, radius: float, lag_time: float) -> Floats:
    """Settings of slide, spindle, ring (radius in mm) and contact; `lag_time` of the loaded slide in s."""
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
    """Settings of the gauges; `phase` (rad) of the roller's runout where the errors give none."""
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
