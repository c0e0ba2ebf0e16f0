"""A noise of the readings that the user knows, instead of the noise found in them."""

import dataclasses

import numpy as np

from centering.roundness._origin import Made, refuse_late
from centering.roundness._profile_protocol import Measured
from sdpgrind.base import checks
from sdpgrind.base.units import UM


def with_known_noise(profile: Measured, noise_sd: float) -> Made:
    """The same samples with this standard deviation of a reading, mm."""
    refuse_late(profile, "with_noise_sd")
    sd, height = checks.positive("noise_sd", noise_sd, "mm"), float(np.ptp(profile.deviation))
    if sd > height:
        raise ValueError(
            f"noise_sd must be at most the height of the readings, {height:.4g} mm from peak to valley; got"
            f" {sd:g} mm: units.um(...) for micrometres?"
        )
    shown = f"{UM * profile.noise_sd:.3g} µm" if np.isfinite(profile.noise_sd) else "nothing"
    told = f"standard deviation of a reading given as {UM * sd:.3g} µm; the readings show {shown}"
    origin = dataclasses.replace(profile._origin, steps=(*profile.steps, told), noise_sd=sd, noise_given=True)
    made = (profile.angle, profile.reading, profile.tip_radius, profile.circle, origin)
    return Made(*made, None, profile.internal)
