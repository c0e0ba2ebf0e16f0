"""Steps of a profile, runout removal and filters; each makes samples of the same ring at the same offset."""

import dataclasses
import warnings
from math import hypot, inf, log, sqrt

import numpy as np

from centering.roundness._certainty import averaged_sd
from centering.roundness._circles import reference_circle
from centering.roundness._filters import CUT_OFFS, Filter
from centering.roundness._form import ENOUGH, Form, broad_form, form_of, has_residuals
from centering.roundness._harmonic_fit import HarmonicFit, even_harmonics, even_values, values_at
from centering.roundness._harmonics import Harmonics
from centering.roundness._origin import (
    Made,
    form_sentence,
    gap_sentence,
    runout_sentence,
    sd_of_harmonics,
)
from centering.roundness._part_frame import from_part, into_part
from centering.roundness._profile_protocol import Measured
from centering.roundness._robust_filter import robust_gaussian
from centering.roundness._roller_fit import separate
from centering.roundness._roller_task import SeparationTask
from centering.roundness._roundness import Roundness
from centering.roundness._samples import Samples
from centering.roundness._sampling import even_turn, highest_degree, is_even, supported, widest_gap
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread

_LEAST = 2  # derived: upr; 1 upr is the offset
_NEARLY_ALL = 0.9  # chosen: of the harmonics of a turn, which a high pass is made to show
_NEARLY = 0.01  # chosen: steps; an outlier moves the centre, and with it the part angles, by less
_BRIDGE = 2.0  # chosen: sd of the form in a gap, over that of a reading, above which a warning is given


def without_runout(profile: Measured, task: SeparationTask) -> Made:
    """The samples without the roller's runout, or unchanged if that is below the noise."""
    with one_blas_thread():
        found = separate(task)
    runout, center = found.runout, found.circle[1:]
    steps = (*profile.steps, runout_sentence(runout))
    origin = dataclasses.replace(profile._origin, steps=steps, runout=runout, noise_sd=runout.noise_sd)
    if not runout.seen:
        circle = profile.circle
        return Made(
            profile.angle,
            profile.reading,
            profile.tip_radius,
            circle,
            origin,
            found.residual,
            profile.internal,
        )
    part_angle, distance = into_part(profile.angle, profile.reading, found.tip_radius, center)
    angle, reading = from_part(part_angle, distance - runout.deviation(part_angle), found.tip_radius, center)
    freedom = max(found.residual.size - 2 * task.upr_max - 3 - (runout.ratio_sd > 0), 1)
    known = {"noise_sd": runout.noise_sd, "freedom": float(freedom), "tip_radius": found.tip_radius}
    circle = profile.circle.replace(value=found.circle, covariance=found.covariance, **known)
    return Made(angle, reading, abs(found.tip_radius), circle, origin, found.residual, profile.internal)


def filtered_evenly(profile: Measured, asked: Filter) -> Made:
    """One turn on an even grid, filtered by FFT."""
    deviation = asked.applied(profile.deviation)
    passed = asked.transmission(np.arange((profile.angle.size + 1) // 2), profile.angle.size)
    sd = _thinned(harmonic_sd(profile, passed.size), passed)
    left = profile.deviation - deviation
    made = _even(profile, profile.circle.value, deviation, sd, asked, "by FFT", left)
    smooth = asked._replace(low=1.0).transmission(np.arange(passed.size), profile.angle.size)
    return dataclasses.replace(
        made, sd=averaged_sd(profile.deviation_sd, smooth, sd_of_harmonics(sd[2:]), profile.noise_sd)
    )


def filtered(profile: Measured, asked: Filter) -> Made:
    """Filtered harmonics by least squares, on an even grid of as many points as a turn had."""
    form = _broad(profile, asked)
    size = _points(profile, form)
    passed = asked.transmission(np.arange(form.coef.size), size)
    coef = form.coef * passed
    deviation = even_values(coef, size)
    with one_blas_thread():
        left = form.fit.residual + values_at(form.coef - coef, form.part_angle)
        each = form.deviation_sd(passed, deviation.size)
    known = _with_spindle(profile, np.zeros(passed.size)) * passed
    gap = gap_sentence(each, form.part_angle)
    how = "; ".join(filter(None, (form_sentence(form), gap)))
    if gap and float(each.max()) > _BRIDGE * form.noise_sd:
        warnings.warn(f"{asked}: {gap}", stacklevel=3)
    sd = _thinned(_with_spindle(profile, form.sd), passed)
    made = _even(profile, form.circle, deviation, sd, asked, how, left)
    return dataclasses.replace(made, sd=np.hypot(each, sd_of_harmonics(known[2:])))


def filtered_robustly(profile: Measured, asked: Filter) -> Made:
    """Robust low pass of one turn on an even grid; of other samples, of the form through them."""
    if is_even(profile.part_angle, _NEARLY):
        circle, values, how = profile.circle.value, profile.deviation, "by regression"
        deviation = robust_gaussian(values, asked.high)
        left = values - deviation
    else:
        form = _broad(profile, asked)
        circle, how = form.circle, f"{form_sentence(form)}; by regression"
        values = even_values(form.coef, _points(profile, form))
        deviation = robust_gaussian(values, asked.high)
        lost = even_harmonics(values - deviation)[: form.coef.size]
        left = form.fit.residual + values_at(lost, form.part_angle)
    circle, deviation = _about_itself(circle, deviation)  # outliers moved the circle, too
    unknown = np.full((deviation.size + 1) // 2, inf)  # no transmission: what noise is left is not known
    return _even(profile, circle, deviation, unknown, asked, how, left)


def _about_itself(circle: Floats, deviation: Floats) -> tuple[Floats, Floats]:
    """Circle moved by 0 and 1 upr of a form on an even turn, and the form without them, mm."""
    coef = even_harmonics(deviation)
    moved = np.array([coef[0].real, 2 * coef[1].real, -2 * coef[1].imag])
    coef[:2] = 0.0
    return circle + moved, even_values(coef, deviation.size)


def _broad(profile: Measured, asked: Filter) -> Form:
    """Form of uneven samples with all harmonics that the filter passes."""
    most, sure = _most(profile), supported(widest_gap(profile.part_angle))
    if asked.high == inf and sure < _NEARLY_ALL * most:
        gap = np.degrees(widest_gap(profile.part_angle))
        told = f"a gap of {gap:.3g} degrees leaves {sure} of {most} upr sure"
        raise checks.refuse("upr", f"a band with a higher cut-off: {told}", (asked.low, None), "upr")
    return broad_form(_samples(profile, most), asked.cut_off, asked.needed, most)


def _points(profile: Measured, form: Form) -> int:
    """Points of an even turn: as many as a turn had."""
    return max(round(2 * profile.nyquist), 2 * form.coef.size - 1)


def _samples(profile: Measured, degree: int) -> Samples:
    """The samples, with a known noise where many harmonics leave few degrees of freedom."""
    size = profile.angle.size
    if has_residuals(size - 2 * degree - 1, size):
        return profile._samples
    return dataclasses.replace(profile._samples, noise_sd=_reading_noise(profile))


def _thinned(sd: Floats, passed: Floats) -> Floats:
    """Standard deviation after transmission; unknown stays unknown."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(sd), sd * passed, inf)


def _even(
    profile: Measured, circle: Floats, deviation: Floats, sd: Floats, asked: Filter, how: str, left: Floats
) -> Made:
    """One turn on an even grid of the part angle with these deviations (mm)."""
    part_angle = even_turn(deviation.size)
    angle, reading = from_part(part_angle, circle[0] + profile._tip + deviation, profile._tip, circle[1:])
    origin = dataclasses.replace(
        profile._origin,
        steps=(*profile.steps, f"{asked}, {how}"),
        filter=f"{profile._origin.filter}; {asked}".lstrip("; "),
        low=max(asked.low, profile._origin.low),
        high=min(asked.high, profile._origin.high),
        separated=_separated(profile, asked, deviation.size),
        lost=profile._origin.lost,
        sd=tuple(sd.tolist()),
        noise_sd=sd_of_harmonics(sd[2:]),
        nyquist=profile.nyquist,
        spindle_sd=(),  # in sd
    )
    return Made(
        angle,
        reading,
        profile.tip_radius,
        profile.circle.replace(value=circle),
        origin,
        left,
        profile.internal,
    )


def harmonic_sd(profile: Measured, count: int) -> Floats:
    """Standard deviation of amplitudes 0..count-1 of an even turn, mm: recorded, or from its noise."""
    if profile._origin.sd:
        return np.pad(np.array(profile._origin.sd), (0, count))[:count]
    sd = np.full(count, _reading_noise(profile) * sqrt(2 / profile.angle.size))
    sd[0] /= sqrt(2)
    return _with_spindle(profile, sd)


def _with_spindle(profile: Measured, sd: Floats) -> Floats:
    """Standard deviations of harmonics, with those of a spindle's error that was taken off."""
    return np.asarray(np.hypot(sd, np.pad(np.array(profile._origin.spindle_sd), (0, sd.size))[: sd.size]))


def _separated(profile: Measured, asked: Filter, size: int) -> tuple[float, ...]:
    """Standard deviations of harmonics by a separation, filtered on so many points, mm."""
    sd = np.array(profile._origin.separated or profile._origin.spindle_sd)
    return tuple((sd * asked.transmission(np.arange(sd.size), size)).tolist())


def _reading_noise(profile: Measured) -> float:
    """Noise of one deviation without the uncertainty of a spindle's error, mm."""
    spindle = sd_of_harmonics(np.array(profile._origin.spindle_sd))
    return sqrt(max(profile.noise_sd**2 - spindle**2, 0.0)) if spindle else profile.noise_sd


def _most(profile: Measured) -> int:
    """Highest harmonic below the limits of the points of a turn and of all samples."""
    return min(highest_degree(profile.points_per_turn), (profile.angle.size - 1) // 2)


def _sure(profile: Measured) -> int:
    """Highest harmonic that the widest gap determines, up to the highest usual cut-off."""
    return min(_most(profile), supported(widest_gap(profile.part_angle)), CUT_OFFS[-1])


def limits(profile: Measured) -> str:
    """Sentence on a gap that limits a spectrum; "" where the points of a turn are the limit."""
    sure, most = _sure(profile), min(_most(profile), CUT_OFFS[-1])
    if 2 * sure >= most:
        return ""
    gap = np.degrees(widest_gap(profile.part_angle))
    return f"a gap of {gap:.3g} degrees leaves {sure} upr sure: faster form is taken for noise, or for these"


def _default_degree(profile: Measured) -> int:
    """Highest harmonic of a default spectrum; raises where there is none, warns where there are few."""
    sure, limited = _sure(profile), limits(profile)
    if sure < _LEAST:
        gap = np.degrees(widest_gap(profile.part_angle))
        raise ValueError(
            f"angle must leave no gap above 90 degrees for a spectrum, so that {_LEAST} upr are sure;"
            f" got {gap:.3g} degrees without a sample (upr_max asks for harmonics all the same)"
        )
    if limited:
        warnings.warn(limited, stacklevel=4)
    return sure


def noise_sd(profile: Measured) -> float:
    """Noise of one deviation, mm: known or found, with the uncertainty of a spindle's error taken off."""
    known = profile._origin.noise_sd
    return hypot(
        _found_noise(profile) if known is None else known,
        sd_of_harmonics(np.array(profile._origin.spindle_sd)),
    )


def _found_noise(profile: Measured) -> float:
    """Noise beyond all determined harmonics, mm; over one turn, noise in most of their upper half."""
    degree = _sure(profile)
    form = form_of(profile._samples, degree) if degree else None
    if form is None:
        return inf
    return form.fit.noise_sd if has_residuals(form.fit.freedom, profile.angle.size) else _floor(form.fit)


def _floor(fit: HarmonicFit) -> float:
    """Noise from the median of the upper half of the harmonics, mm; infinite for too few."""
    upper = slice(fit.coef.size // 2 + 1, None)
    power = (2 * np.abs(fit.coef[upper]) / fit.amplitude_spread[upper]) ** 2
    return sqrt(float(np.median(power)) / (2 * log(2))) if 2 * power.size >= ENOUGH else inf


def harmonics(profile: Measured, degree: int | None) -> Harmonics:
    """Amplitudes and phases of a profile."""
    if profile._origin.sd:
        coef = even_harmonics(profile.deviation)[: (degree or len(profile._origin.sd) - 1) + 1]
        sd = harmonic_sd(profile, coef.size)
    else:
        wanted = degree or _default_degree(profile)
        form = form_of(_samples(profile, wanted), wanted)
        coef, sd = form.coef, _with_spindle(profile, form.sd)
    upr = np.arange(1.0, coef.size)
    return Harmonics(upr, 2 * np.abs(coef[1:]), -np.angle(coef[1:]), sd[1:], profile.nyquist)


def roundness(profile: Measured, kind: str) -> Roundness:
    """Reference circle, with noise and its undulations; of a band without 1 upr the circle it lies about."""
    sd, upr, name = profile.deviation_sd, np.array(profile._origin.sd), profile._origin.filter
    noise = sd if np.all(np.isfinite(sd)) and np.any(sd > 0) else None
    upr = np.where(np.isfinite(upr), upr, 0.0)
    if profile._origin.low > 1:
        return _about_zero(profile, kind, noise, upr)
    return reference_circle(
        profile.points, kind, tip_radius=profile._tip, noise_sd=noise, noise_upr=upr, filter=name
    ).replace(origin=profile._origin, internal=profile.internal)


def _about_zero(profile: Measured, kind: str, noise: Floats | None, upr: Floats) -> Roundness:
    """Roundness of a band that holds no 1 upr: a circle of its own would add that again."""
    if kind != "LSC":
        rule = (
            f"'LSC' after {profile._origin.filter}: another circle would add 1 upr again, which it took off"
        )
        raise checks.refuse("kind", rule, kind)
    none = np.empty(0, dtype=int)
    deviation = profile.deviation
    return Roundness(
        kind, profile.circle.value[1:], float(profile.circle.radius), none, none.astype(bool),
        float(np.sqrt(np.mean(deviation**2))), profile.points, tip_radius=profile._tip,
        noise_sd=np.empty(0) if noise is None else noise, noise_upr=upr, filter=profile._origin.filter,
        origin=profile._origin, internal=profile.internal,
        certificate="the band holds no 1 upr: deviations are about its own zero, not about a fitted circle",
    )  # fmt: skip
