"""Most material of a measured part about an axis: of its form between samples, and of samples beyond it."""

import dataclasses
from math import ceil, hypot, inf, log, pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from centering.roundness._form import ENOUGH, Form, extreme_between, form_of
from centering.roundness._harmonic_fit import even_harmonics, values_at
from centering.roundness._part_frame import into_part
from centering.roundness._profile import Profile
from centering.roundness._roller_rows import harmonic_rows
from centering.roundness._sampling import supported, widest_gap
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread

_HIGHEST = 1500  # chosen: highest undulation fitted, upr; more takes time and adds no material
_SUPPORTED = 0.8  # chosen: share of the supported harmonics; more leaves no samples for the noise
_CHANCE = 1e-3  # chosen: probability that noise counts as an undulation, or one of its samples as a burr
_STILL = 1e-6  # chosen: residual counted as no noise, mm
_MEDIAN = 1.4826  # derived: standard deviation over median absolute deviation of a normal distribution
_ROUNDED = sqrt(12)  # derived: step of the readings over the standard deviation of its rounding


class Material(NamedTuple):
    """Largest radius about an axis, of a bore the smallest, and standard deviation of the form there, mm."""

    radius: float
    sd: float


def most_material(profile: Profile, axis: tuple[float, float], upr: float) -> Material:
    """Extreme of the form, of samples beyond it, or of asperities that were taken out."""
    profile.rise_between_samples(upr)  # raises where samples do not bound the form
    outward = -1 if profile.internal else 1
    found = _of_samples(profile, axis, upr, outward)
    removed = outward * (np.hypot(*(profile._removed_points - np.array(axis)).T) - profile._tip)
    if not np.any(removed > outward * found.radius):
        return found
    return found._replace(radius=outward * (float(removed.max()) + _higher(profile, axis, upr)))


def _of_samples(profile: Profile, axis: tuple[float, float], upr: float, outward: int) -> Material:
    """Extreme of the fitted form, or of the samples beyond it where they reach farther."""
    noise = profile.noise_sd
    if profile._origin.filter:
        return _filtered(profile, axis, outward)
    with one_blas_thread():
        form = form_of(
            dataclasses.replace(profile._samples, noise_sd=noise if noise < inf else None),
            _degree(profile, upr),
        )
        place, radius = extreme_between(form.coef, form.circle, profile._tip, np.array(axis), outward)
        sd = _spread(profile, form, place)
    standing_out = _beyond_form(profile, form, axis, upr, outward)
    if outward * (standing_out.radius - radius) > 0:
        return standing_out
    return Material(radius, max(sd, _rounding(profile)))


def _filtered(profile: Profile, axis: tuple[float, float], outward: int) -> Material:
    """Of a filtered profile: its harmonics are all that there is."""
    coef = even_harmonics(profile.deviation)[: len(profile._origin.sd)]
    radius = extreme_between(coef, profile.circle.value, profile._tip, np.array(axis), outward)[1]
    return Material(radius, float(profile.deviation_sd.max()))


def _degree(profile: Profile, upr: float) -> int:
    """Harmonics of the fit: `upr`, or more where undulations above it exceed the noise."""
    sure = min(int(_SUPPORTED * supported(widest_gap(profile.part_angle))), _HIGHEST)
    least = max(ceil(upr), 1)
    if sure <= least:
        return least
    spectrum = profile.harmonics(sure)
    seen = spectrum.upr[spectrum.amplitude > spectrum.sd * sqrt(2 * log(sure / _CHANCE)) + _STILL]
    return int(max(seen.max(initial=1.0), least))


def _spread(profile: Profile, form: Form, place: float) -> float:
    """Standard deviation of the fitted form at a place, from noise and the runout's covariance."""
    degree = form.coef.size - 1
    rows = harmonic_rows(form.part_angle, degree)
    weights = np.linalg.solve(rows @ rows.T, harmonic_rows(np.array([place]), degree)[:, 0]) @ rows
    noise = form.noise_sd * sqrt(_repeat_factor(profile, form)) * float(np.linalg.norm(weights))
    if profile.roller_error is None:
        return noise
    along = weights @ profile.roller_error.derivatives(form.part_angle)
    return hypot(noise, sqrt(max(float(along @ profile.roller_error.covariance @ along), 0.0)))


def _repeat_factor(profile: Profile, form: Form) -> float:
    """Variance of the mean over turns relative to independent readings: encoder errors repeat each turn."""
    count, degrees = round(profile.points_per_turn), 2 * form.coef.size - 1
    free, rest = count - degrees, _residuals(profile, form)
    if round(profile.turns) < 2 or rest.size - degrees < ENOUGH:
        return 1.0
    if free < ENOUGH:
        return profile.turns
    place = np.floor((form.part_angle - form.part_angle[0]) / (2 * pi) * count + 0.5).astype(int) % count
    size = np.maximum(np.bincount(place, minlength=count), 1)
    between = float(np.sum(np.bincount(place, rest, count) ** 2 / size)) / free
    return max(between * (rest.size - degrees) / max(float(rest @ rest), 1e-300), 1.0)


def _residuals(profile: Profile, form: Form) -> Floats:
    """Residuals of the fitted form, mm."""
    about, distance = into_part(profile.angle, profile.reading, profile._tip, form.circle[1:])
    return np.asarray(distance - profile._tip - form.circle[0] - values_at(form.coef, about))


def _beyond_form(
    profile: Profile, form: Form, axis: tuple[float, float], upr: float, outward: int
) -> Material:
    """Farthest sample beyond the form by more than noise, plus the rise possible between samples."""
    left = _residuals(profile, form)
    freedom = max(left.size - 2 * form.coef.size + 1, 1)
    noise = max(_MEDIAN * float(np.median(np.abs(left))) * sqrt(left.size / freedom), _rounding(profile))
    distance = np.hypot(*(profile.points - np.array(axis)).T) - profile._tip
    out = -float(ndtri(_CHANCE / left.size))
    reach: Floats = outward * distance[outward * left > out * noise + _STILL]
    if not reach.size:
        return Material(-outward * inf, noise)
    return Material(outward * (float(reach.max()) + _higher(profile, axis, upr)), noise)


def _higher(profile: Profile, axis: tuple[float, float], upr: float) -> float:
    """Rise that is possible between samples, mm."""
    return max(profile.largest_radius(axis, upr=upr) - profile.largest_radius(axis), 0.0)


def _rounding(profile: Profile) -> float:
    """Standard deviation of the rounding, by the smallest step of the readings; inf: no step."""
    steps = np.diff(np.sort(profile.reading))
    return float(steps[steps > _STILL * 1e-3].min(initial=inf)) / _ROUNDED
