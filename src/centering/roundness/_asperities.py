"""Readings of dust, burrs and pits: found beside a robust form, taken out, and kept apart."""

import dataclasses

import numpy as np

from centering.roundness._asperity_runs import FOOT, AsperityRuns, Outstanding, runs_of
from centering.roundness._origin import Made, refuse_late
from centering.roundness._part_frame import circle_of
from centering.roundness._profile_protocol import Measured
from centering.roundness._robust_filter import LEAST, robust_gaussian
from centering.roundness._sampling import even_turn
from sdpgrind.base import checks
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.units import UM

_FORM = 150  # chosen: upr of the form, the usual cut-off for waves
_POINTS = 20  # measured: of 30 turns of noise half lose good readings with 7 points an undulation, here none
_SIGMAS = 6.0  # chosen: sd, as the default of `Profile.remove_asperities`
_MAYBE = 4.5  # chosen: sd beside a linear filter; one turn in 80 of 3600 readings of noise goes farther
_ROUNDING = 16 * float(np.finfo(float).eps)  # derived: of a reading and its centring, some operations
_SWEEPS = 150  # chosen: of the robust filter where nobody asked; forms with noise needed up to 130
_MEDIAN = 1.4826  # derived: standard deviation over median absolute deviation of a normal distribution
_MOST = 0.02  # chosen: share of the readings; more is form
# chosen: residual over the range of the form that is curvature, not noise. measured: without noise, 2, 3 and
# 2 with 7 upr on 360 to 3600 points were refused as form with 1e-4
_SMOOTH = 1e-3
_NORMAL = 2.44  # derived: quantile of 90 % of the size of normal noise over that of 50 %, 1.645 over 0.674
_SCATTER = 3.0  # derived: sd of that ratio times the root of the readings, from the densities there
_ONE_IN = 0.01  # chosen: readings expected above and below all, half of them above


def asked_for(sigmas: float, both: bool, width: float | None) -> Outstanding:
    """What is asked for, checked."""
    least = checks.positive("sigmas", sigmas, "1")
    if least <= FOOT:
        raise checks.refuse("sigmas", f"> {FOOT:g}, where an asperity ends", least)
    widest = None if width is None else checks.positive("width", width, "rad")
    return Outstanding(least, checks.kind("both", both, bool), widest)


def without_asperities(profile: Measured, asked: Outstanding) -> Made:
    """The samples without those that stand out of a robust form; they are kept in the origin."""
    refuse_late(profile, "remove_asperities")
    if profile.angle.size < LEAST:
        rule = f"at least {LEAST} samples for remove_asperities"
        raise ValueError(f"reading must have {rule}; got {profile.angle.size}")
    height, runs, scale = _found(profile, asked)
    _refuse_form(runs.out, asked)
    told = _told(height[runs.out], runs, asked, scale, profile.internal)
    removed = np.column_stack([profile.angle, profile.reading, height])[runs.out]
    return _without(profile, runs.out, tuple(map(tuple, removed.tolist())), told)


def suspects(profile: Measured) -> int:
    """Number of readings that `without_asperities` would take out; 0 where it would refuse.

    A linear filter tells first whether there may be any, in a hundredth of the time. Noise with heavier tails
    than a normal distribution raises the least height.
    """
    if profile.angle.size < LEAST:
        return 0
    _, readings, cut_off = _evenly(profile)
    coef = np.fft.rfft(readings)
    rest = np.fft.irfft(coef * (1 - np.exp2(-((np.arange(coef.size) / cut_off) ** 2))), readings.size)
    least = _MAYBE * _MEDIAN * float(np.median(np.abs(rest)))
    if np.max(-rest if profile.internal else rest) <= max(least, _SIGMAS * _SMOOTH * float(np.ptp(readings))):
        return 0
    out = _found(profile, Outstanding(_SIGMAS, False, None), _SWEEPS, tails=True)[1].out
    return int(np.sum(out)) if np.mean(out) <= _MOST else 0


def _found(
    profile: Measured, asked: Outstanding, sweeps: int | None = None, *, tails: bool = False
) -> tuple[Floats, AsperityRuns, float]:
    """Height of each reading above the form (mm), asperities, and the standard deviation of a height (mm)."""
    height, high = _height(profile, sweeps)
    rounding = _ROUNDING * float(np.max(profile.reading))
    scale = max(_MEDIAN * float(np.median(np.abs(height))), _SMOOTH * high, rounding)
    order = np.argsort(profile.part_angle, kind="stable")
    if tails:
        asked = asked._replace(sigmas=max(asked.sigmas, _least_in(height[order] / scale)))
    away = -profile.deviation if profile.internal else profile.deviation
    runs = runs_of(height[order] / scale, away[order] / scale, profile.part_angle[order], asked)
    out = np.zeros(height.size, dtype=bool)
    out[order] = runs.out
    return height, runs._replace(out=out), scale


def _least_in(height: Floats) -> float:
    """Height above which one turn of noise in 200 has a reading, sd; 0 for noise as of a normal distribution.

    Heavier tails are taken as exponential, as those of a Laplace distribution are, through the quantiles of
    50 and 90 %: farther out dust would count. Neighbours beside the edge of a slot are no noise.
    """
    far = np.abs(height) >= FOOT
    inner = far & np.roll(far, 1) & np.roll(far, -1)
    size = np.abs(height[~(inner | np.roll(inner, 1) | np.roll(inner, -1))])
    half, most = np.quantile(size, [0.5, 0.9])
    if most <= (_NORMAL + 3 * _SCATTER / np.sqrt(size.size)) * half:
        return 0.0
    return float(half + (most - half) * np.log(0.5 * size.size / _ONE_IN) / np.log(5.0))


def _height(profile: Measured, sweeps: int | None) -> tuple[Floats, float]:
    """Height of each reading above a robust form, away from the part's material, and the form's range, mm.

    Between samples that are not even the readings are taken as straight: harmonics through dust would ring.
    """
    turn, readings, cut_off = _evenly(profile)
    form = robust_gaussian(readings, cut_off, sweeps)
    residual = profile.deviation - np.interp(profile.part_angle, turn, form, period=2 * np.pi)
    return -residual if profile.internal else residual, float(np.ptp(form))


def _evenly(profile: Measured) -> tuple[Floats, Floats, float]:
    """Even turn (rad), the deviations there (mm), and the cut-off of the form (upr)."""
    points = 2 * profile.nyquist
    turn = even_turn(round(points))
    readings = np.interp(turn, profile.part_angle, profile.deviation, period=2 * np.pi)
    return turn, readings, min(_FORM, points / _POINTS)


def _refuse_form(out: Bools, asked: Outstanding) -> None:
    share = float(np.mean(out))
    if share > _MOST:
        raise ValueError(
            f"reading must have at most {100 * _MOST:g} % of its points in asperities; got"
            f" {100 * share:.2g} % with sigmas={asked.sigmas:g}: that is form"
        )


def _told(height: Floats, runs: AsperityRuns, asked: Outstanding, scale: float, internal: bool) -> str:
    """Sentence on the readings that were taken out."""
    off = "off" if asked.both else "above"
    way = ", towards the axis of the bore" if internal and not asked.both else ""
    least = f"more than {asked.sigmas:g} sd ({UM * asked.sigmas * scale:.2g} µm) {off} the form{way}"
    if not height.size:
        return f"no asperity {least}"
    places = f"{runs.number} asperities" if runs.number > 1 else "1 asperity"
    wide = f"at most {np.degrees(runs.widths.max()):.2g} degrees wide"
    highest = UM * float(height[np.argmax(np.abs(height))])
    said = f"{counted(height.size, 'reading')} of {places} {least} taken out"
    return f"{said}, up to {highest:.3g} µm, {wide}"


def _without(profile: Measured, out: Bools, removed: tuple[tuple[float, ...], ...], told: str) -> Made:
    """The samples that are left."""
    origin = dataclasses.replace(
        profile._origin,
        steps=(*profile.steps, told),
        removed=(*profile._origin.removed, *removed),
        nyquist=profile.nyquist,
        suspects=0,
    )
    angle, reading = profile.angle[~out], profile.reading[~out]
    circle = circle_of(angle, reading, profile._tip) if np.any(out) else profile.circle
    return Made(angle, reading, profile.tip_radius, circle, origin, None, profile.internal)
