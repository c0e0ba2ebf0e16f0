"""Correction of a profile by the error of the spindle."""

import dataclasses

import numpy as np

from centering.roundness._origin import Made, refuse_late
from centering.roundness._part_frame import circle_of
from centering.roundness._profile_protocol import Measured
from centering.roundness._spindle_error import SpindleError, told_lost
from sdpgrind.base import checks
from sdpgrind.base.units import UM


def corrected(profile: Measured, spindle: SpindleError) -> Made:
    """The samples without the spindle's error."""
    checks.kind("spindle", spindle, SpindleError, " (the spindle of a Separation)")
    _refuse_late(profile)
    reading = profile.reading - spindle.deviation(profile.angle)
    told = f"error of the spindle taken off, {UM * spindle.range:.3g} µm from peak to valley"
    lost = f", {told_lost(spindle.lost)}" if spindle.lost.size else ""
    sd = np.zeros(int(spindle.harmonics.upr.max(initial=1.0)) + 1)
    sd[spindle.harmonics.upr.astype(int)] = spindle.harmonics.sd
    steps = (*profile.steps, f"{told} ± {UM * spindle.noise_sd:.2g} µm (sd){lost}")
    origin = dataclasses.replace(
        profile._origin,
        steps=steps,
        noise_sd=profile.noise_sd,
        spindle_sd=tuple(sd.tolist()),
        lost=tuple(spindle.lost.tolist()),
    )
    circle = circle_of(profile.angle, reading, profile._tip)
    return Made(profile.angle, reading, profile.tip_radius, circle, origin, None, profile.internal)


def _refuse_late(profile: Measured) -> None:
    """Refuse a profile that has lost its readings, or the spindle's error."""
    refuse_late(profile, "correct")
    origin = profile._origin
    if origin.spindle_sd:
        raise ValueError(f"correct must be applied once; got {origin.steps[-1]}")
