"""Gauges of a centering machine: readings of encoders, probe and force sensor from the true state."""

import numpy as np

from centering._plant import probe_kernels as probe
from centering._plant import slide_kernels as slide
from sdpgrind.base.compiling.compiled import compiled

# settings: steps of encoders, inward stroke of the probe, errors, force sensor
COUNTS, SLIDE_QUANTUM, PROBE_QUANTUM, STROKE, SKEW, NOISE_SD, RUNOUT, RUNOUT_PHASE, ROLL = range(9)
DUST, DUST_SIZE, FORCE_QUANTUM, FORCE_MAX, GAUGES = range(9, 14)

# readings, in the order of the samples
TIME, ANGLE, SLIDE, PROBE, FORCE, PEAK_FORCE, SPINDLE_SPEED, PUSHING, REFRESHED = range(9)
NAMES = ("time", "angle", "slide", "probe", "force", "peak_force", "spindle_speed", "pushing", "refreshed")
_SQUEEZED = 1.0  # largest compression of the contact, mm; chosen: more is no reading


@compiled
def _force(force, gauge):
    return probe.rounded(min(max(force, -gauge[FORCE_MAX]), gauge[FORCE_MAX]), gauge[FORCE_QUANTUM])


@compiled
def measure(state, cell, profile, shape, lobes, gauge, normal, first, second, out):
    """Read all gauges; reset the peak force."""
    radial, part_angle = probe.contact(shape, lobes, state[slide.X], state[slide.Y], state[slide.ANGLE])
    place = slide.tip_at(state, cell, profile, 0.0)[0] - cell[slide.STOP]
    held_off = (
        gauge[RUNOUT] * np.cos(gauge[ROLL] * part_angle - gauge[RUNOUT_PHASE]) + gauge[NOISE_SD] * normal
    )
    if first < gauge[DUST]:
        held_off += gauge[DUST_SIZE] * (0.5 + second)
    extended = radial + held_off - place
    if not -gauge[STROKE] <= extended <= _SQUEEZED:
        extended = np.nan
    turn = 2.0 * np.pi / gauge[COUNTS] if gauge[COUNTS] > 0.0 else 0.0
    out[TIME] = state[slide.TIME]
    out[ANGLE] = probe.rounded(state[slide.ANGLE] + state[slide.SPEED] * gauge[SKEW], turn)
    out[SLIDE] = probe.rounded(place, gauge[SLIDE_QUANTUM])
    out[PROBE] = probe.rounded(extended, gauge[PROBE_QUANTUM])
    out[FORCE] = _force(state[slide.FORCE], gauge)
    out[PEAK_FORCE] = _force(state[slide.PEAK], gauge)
    out[SPINDLE_SPEED] = state[slide.SPEED]
    out[PUSHING] = 1.0 if state[slide.SEGMENT] >= 0.0 else 0.0
    state[slide.PEAK] = state[slide.FORCE]
