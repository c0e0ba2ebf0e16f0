"""Steps of a profile, runout removal and filters; each makes samples of the same ring at the same offset."""

import dataclasses
import warnings
from math import inf

import numpy as np

from centering.roundness._certainty import averaged_sd
from centering.roundness._circles import reference_circle
from centering.roundness._evened import Evened, about_itself
from centering.roundness._filters import CUT_OFFS, Filter
from centering.roundness._form import Form, broad_form, form_of
from centering.roundness._harmonic_fit import even_harmonics, even_values, values_at
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
from centering.roundness._reading_noise import (
    harmonic_sd,
    known_form,
    most_upr,
    noise_beyond,
    sure_upr,
    with_spindle,
)
from centering.roundness._robust_filter import robust_gaussian
from centering.roundness._roller_fit import separate
from centering.roundness._roller_task import SeparationTask
from centering.roundness._roundness import Roundness
from centering.roundness._sampling import even_turn, is_even, supported, widest_gap
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


def filtered_evenly(profile: Measured, asked: Filter, even: Evened) -> Made:
    """One turn on an even grid, filtered by FFT."""
    size = even.values.size
    deviation = asked.applied(even.values)
    passed = asked.transmission(np.arange((size + 1) // 2), size)
    noise = noise_beyond(profile, even, asked.needed)
    sd = _thinned(harmonic_sd(profile, passed.size, noise), passed)
    left = even.at_readings(even.values - deviation)
    made = _even(profile, even.circle, deviation, sd, asked, even.told, left)
    if profile._origin.sd == ():  # readings have one noise, and so has their form
        return made
    smooth = asked._replace(low=1.0).transmission(np.arange(passed.size), size)
    each = averaged_sd(profile.deviation_sd, smooth, made.origin.noise_sd or 0.0, profile.noise_sd)
    return dataclasses.replace(made, sd=each)


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
    known = with_spindle(profile, np.zeros(passed.size)) * passed
    gap = gap_sentence(each, form.part_angle)
    how = "; ".join(filter(None, (form_sentence(form), gap)))
    if gap and float(each.max()) > _BRIDGE * form.noise_sd:
        warnings.warn(f"{asked}: {gap}", stacklevel=3)
    sd = _thinned(with_spindle(profile, form.sd), passed)
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
    deviation, circle = about_itself(deviation, circle)  # outliers moved the circle, too
    unknown = np.full((deviation.size + 1) // 2, inf)  # no transmission: what noise is left is not known
    return _even(profile, circle, deviation, unknown, asked, how, left)


def _broad(profile: Measured, asked: Filter) -> Form:
    """Form of uneven samples with all harmonics that the filter passes."""
    most, sure = most_upr(profile), supported(widest_gap(profile.part_angle))
    if asked.high == inf and sure < _NEARLY_ALL * most:
        gap = np.degrees(widest_gap(profile.part_angle))
        told = f"a gap of {gap:.3g} degrees leaves {sure} of {most} upr sure"
        raise checks.refuse("upr", f"a band with a higher cut-off: {told}", (asked.low, None), "upr")
    return known_form(profile, broad_form(profile._samples, asked.cut_off, asked.needed, most))


def _points(profile: Measured, form: Form) -> int:
    """Points of an even turn: as many as a turn had."""
    return max(round(2 * profile.nyquist), 2 * form.coef.size - 1)


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


def _separated(profile: Measured, asked: Filter, size: int) -> tuple[float, ...]:
    """Standard deviations of harmonics by a separation, filtered on so many points, mm."""
    sd = np.array(profile._origin.separated or profile._origin.spindle_sd)
    return tuple((sd * asked.transmission(np.arange(sd.size), size)).tolist())


def limits(profile: Measured) -> str:
    """Sentence on a gap that limits a spectrum; "" where the points of a turn are the limit."""
    sure, most = sure_upr(profile), min(most_upr(profile), CUT_OFFS[-1])
    if 2 * sure >= most:
        return ""
    gap = np.degrees(widest_gap(profile.part_angle))
    return f"a gap of {gap:.3g} degrees leaves {sure} upr sure: faster form is taken for noise, or for these"


def _default_degree(profile: Measured) -> int:
    """Highest harmonic of a default spectrum; raises where there is none, warns where there are few."""
    sure, limited = sure_upr(profile), limits(profile)
    if sure < _LEAST:
        gap = np.degrees(widest_gap(profile.part_angle))
        raise ValueError(
            f"angle must leave no gap above 90 degrees for a spectrum, so that {_LEAST} upr are sure;"
            f" got {gap:.3g} degrees without a sample (upr_max asks for harmonics all the same)"
        )
    if limited:
        warnings.warn(limited, stacklevel=4)
    return sure


def harmonics(profile: Measured, degree: int | None) -> Harmonics:
    """Amplitudes and phases of a profile."""
    if profile._origin.sd:
        coef = even_harmonics(profile.deviation)[: (degree or len(profile._origin.sd) - 1) + 1]
        sd = harmonic_sd(profile, coef.size)
    else:
        wanted = degree or _default_degree(profile)
        form = known_form(profile, form_of(profile._samples, wanted))
        coef, sd = form.coef, with_spindle(profile, form.sd)
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
