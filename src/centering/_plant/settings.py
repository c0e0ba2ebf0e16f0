"""Settings of the compiled core of a centering machine: slide, spindle, contact, gauges."""

import math
from typing import Any

import numpy as np

from centering._plant import measure_kernels as gauges
from centering._plant import slide_kernels as slide
from centering._plant.probe import NO_ERRORS, ProbeErrors
from centering._problem.model import FORCE_MAX
from centering.push import CenteringLimits, PushModel, PushScatter
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

# Velocity loop of the slide; with this damping the bandwidth is the natural frequency.
_BANDWIDTH = 2 * math.pi * 825.0  # rad/s; source: Mears (2006)
_DAMPING = math.sqrt(0.5)  # chosen: the source gives none
_STROKE = 25.0  # stroke of the probe, mm; source: Mears (2006)
_FORCE_QUANTUM = 2 * FORCE_MAX / 4096  # N; derived: 12 bits of the sensor's range
_FINENESS = 0.08  # step over the contact's times sqrt(M/k) and M/b; chosen: larger ones lose accuracy
_LONGEST_STEP = 5e-4  # s; chosen: as above, for soft contacts
# source: Mears (2006), Table 3.2: speed (mm/min), largest following error (µm) with 0.8 kg and with 18.9 kg
FOLLOWING: tuple[tuple[float, float, float], ...] = (
    (100.0, 2.0, 10.0),
    (500.0, 8.0, 26.0),
    (1000.0, 2.0, 39.0),
    (2000.0, 14.0, 76.0),
    (3000.0, 11.0, 101.0),
    (4000.0, 14.0, 158.0),
    (5000.0, 20.0, 230.0),
)
MASSES = (0.8, 18.9)  # kg; source: Mears (2006), Table 3.2
_ROUNDING = 1e-9  # relative; chosen: above rounding of limits
_PROFILE = "rows of duration (s, > 0), velocity (mm/s) and acceleration (mm/s^2)"


def core_settings(limits: CenteringLimits, model: PushModel, radius: float, lag: float) -> Floats:
    """Settings of slide, spindle, ring (radius in mm) and contact; lag of the loaded slide in s."""
    cell = np.zeros(slide.SETTINGS)
    cell[slide.SPEED_MAX], cell[slide.ACCELERATION_MAX] = limits.slide_speed_max, limits.acceleration_max
    cell[slide.LOOP], cell[slide.DAMPING], cell[slide.LAG_TIME] = _BANDWIDTH, _DAMPING, lag
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
    gauge[gauges.FORCE_MAX] = FORCE_MAX
    return gauge


def lag_times() -> Floats:
    """Lags (s) for both masses: least-squares lines through the origin.

    An error proportional to speed is that of a first-order lag of this time constant.
    """
    table = np.array(FOLLOWING)
    speed, error = table[:, 0] / 60.0, table[:, 1:] / 1000.0  # mm/s, mm
    return np.asarray(speed @ error / (speed @ speed))


def lag_time(mass: float) -> float:
    """Lag (s) of a slide that pushes a mass (kg): linear in mass through both calibrated ones, >= 0."""
    light, heavy = (float(each) for each in lag_times())
    share = (mass - MASSES[0]) / (MASSES[1] - MASSES[0])
    return max(light + share * (heavy - light), 0.0)


def checked_profile(profile: Any, cell: Floats) -> Floats:
    """Rows of a profile that the slide can run, from an array or an object with ``segments``."""
    rows = checks.finite_array("profile", getattr(profile, "segments", profile), "s, mm/s, mm/s^2")
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise checks.refuse("profile", f"of shape (n, 3): {_PROFILE}", rows.shape)
    if not len(rows):
        return np.zeros((0, 3))
    if np.any(rows[:, 0] <= 0):
        raise checks.refuse("profile[:, 0]", "durations > 0", float(rows[:, 0].min()), "s")
    fastest = float(np.abs(np.concatenate([rows[:, 1], rows[:, 1] + rows[:, 0] * rows[:, 2]])).max())
    if fastest > cell[slide.SPEED_MAX] * (1 + _ROUNDING):
        raise checks.refuse(
            "profile[:, 1]", f"speeds <= slide_speed_max = {cell[slide.SPEED_MAX]:g}", fastest, "mm/s"
        )
    hardest = float(np.abs(rows[:, 2]).max())
    if hardest > cell[slide.ACCELERATION_MAX] * (1 + _ROUNDING):
        rule = f"accelerations <= acceleration_max = {cell[slide.ACCELERATION_MAX]:g}"
        raise checks.refuse("profile[:, 2]", rule, hardest, "mm/s^2")
    return np.ascontiguousarray(rows)
