"""Noise of the readings of a profile: known, or found in the highest harmonics that they determine."""

from math import hypot, inf, log, sqrt

import numpy as np

from centering.roundness._evened import Evened
from centering.roundness._filters import CUT_OFFS
from centering.roundness._form import ENOUGH, Form, form_of, has_residuals
from centering.roundness._harmonic_fit import HarmonicFit, even_harmonics, even_values
from centering.roundness._origin import sd_of_harmonics
from centering.roundness._profile_protocol import Measured
from centering.roundness._sampling import highest_degree, supported, widest_gap
from sdpgrind.base.checks import Floats


def most_upr(profile: Measured) -> int:
    """Highest harmonic below the limits of the points of a turn and of all samples."""
    return min(highest_degree(profile.points_per_turn), (profile.angle.size - 1) // 2)


def sure_upr(profile: Measured) -> int:
    """Highest harmonic that the widest gap determines, up to the highest usual cut-off."""
    return min(most_upr(profile), supported(widest_gap(profile.part_angle)), CUT_OFFS[-1])


def noise_sd(profile: Measured) -> float:
    """Noise of one deviation, mm: known or found, with the uncertainty of a spindle's error taken off."""
    known = profile._origin.noise_sd
    return hypot(
        _found_noise(profile) if known is None else known,
        sd_of_harmonics(np.array(profile._origin.spindle_sd)),
    )


def harmonic_sd(profile: Measured, count: int, noise_sd: float | None = None) -> Floats:
    """Standard deviation of amplitudes 0..count-1 of an even turn, mm: recorded, or from noise of a reading.

    Without `noise_sd` (mm) it is that of the profile.
    """
    if profile._origin.sd:
        return np.pad(np.array(profile._origin.sd), (0, count))[:count]
    noise = _without_spindle(profile) if noise_sd is None else noise_sd
    sd = np.full(count, noise * sqrt(2 / profile.angle.size))
    sd[0] /= sqrt(2)
    return with_spindle(profile, sd)


def noise_beyond(profile: Measured, even: Evened, upr: float) -> float | None:
    """Noise of a reading that was moved onto an even turn, from what so many harmonics leave, mm.

    None where that does not tell it: of readings that were even, with a noise that was given, or of few.
    """
    degree = max(int(min(upr, most_upr(profile))), 1)
    told = has_residuals(even.values.size - 2 * degree - 1, even.values.size)
    known = even.shift is None or profile._origin.noise_given or not told
    return None if known else _left_noise(even.values, degree)


def with_spindle(profile: Measured, sd: Floats) -> Floats:
    """Standard deviations of harmonics, with those of a spindle's error that was taken off."""
    return np.asarray(np.hypot(sd, np.pad(np.array(profile._origin.spindle_sd), (0, sd.size))[: sd.size]))


def known_form(profile: Measured, form: Form) -> Form:
    """The form; where many harmonics leave few degrees of freedom, with the noise of the profile."""
    size = profile.angle.size
    if has_residuals(form.fit.freedom, size):
        return form
    found = profile._origin.noise_sd is None and form.fit.coef.size - 1 == sure_upr(profile)
    return form.of_noise(_floor_of(form.fit) if found else _without_spindle(profile))


def _without_spindle(profile: Measured) -> float:
    """Noise of one deviation without the uncertainty of a spindle's error, mm."""
    spindle = sd_of_harmonics(np.array(profile._origin.spindle_sd))
    return sqrt(max(profile.noise_sd**2 - spindle**2, 0.0)) if spindle else profile.noise_sd


def _found_noise(profile: Measured) -> float:
    """Noise beyond all determined harmonics, mm; over one turn, noise in most of their upper half."""
    degree = sure_upr(profile)
    if not degree:
        return inf
    if profile._evened is not None:
        return _even_noise(profile._evened, degree)
    fit = form_of(profile._samples, degree).fit
    return fit.noise_sd if has_residuals(fit.freedom, profile.angle.size) else _floor_of(fit)


def _even_noise(even: Evened, degree: int) -> float:
    """The same of an even turn by FFT, whose amplitudes all have one standard deviation, mm."""
    size = even.values.size
    if has_residuals(size - 2 * degree - 1, size):
        return _left_noise(even.values, degree)
    coef = even_harmonics(even.values)[: degree + 1]
    return _floor(np.abs(coef), np.full(coef.size, sqrt(2 / size)))


def _left_noise(values: Floats, degree: int) -> float:
    """Noise from the harmonics of an even turn above so many, mm."""
    coef = even_harmonics(values)
    coef[: degree + 1] = 0.0
    return float(np.linalg.norm(even_values(coef, values.size))) / sqrt(values.size - 2 * degree - 1)


def _floor_of(fit: HarmonicFit) -> float:
    return _floor(np.abs(fit.coef), fit.amplitude_spread)


def _floor(size: Floats, spread: Floats) -> float:
    """Noise from the median of the upper half of the harmonics, mm; infinite for too few."""
    upper = slice(size.size // 2 + 1, None)
    power = (2 * size[upper] / spread[upper]) ** 2
    return sqrt(float(np.median(power)) / (2 * log(2))) if 2 * power.size >= ENOUGH else inf
