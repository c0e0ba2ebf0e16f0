"""Readings of dust, burrs and pits: found beside a robust form, taken out, and kept apart."""

import dataclasses
from typing import NamedTuple

import numpy as np

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
_MEDIAN = 1.4826  # derived: standard deviation over median absolute deviation of a normal distribution
_FOOT = 2.0  # chosen: sd; an asperity ends where the residual falls below it
_MOST = 0.02  # chosen: share of the readings; more is form
# chosen: residual over the range of the form that is curvature, not noise. measured: without noise, 2, 3 and
# 2 with 7 upr on 360 to 3600 points were refused as form with 1e-4
_SMOOTH = 1e-3


class Outstanding(NamedTuple):
    """What counts as an asperity: sd above the form, pits too, widest (rad; None: any)."""

    sigmas: float
    both: bool
    width: float | None


def asked_for(sigmas: float, both: bool, width: float | None) -> Outstanding:
    """What is asked for, checked."""
    least = checks.positive("sigmas", sigmas, "1")
    if least <= _FOOT:
        raise checks.refuse("sigmas", f"> {_FOOT:g}, where an asperity ends", least)
    widest = None if width is None else checks.positive("width", width, "rad")
    return Outstanding(least, checks.kind("both", both, bool), widest)


def without_asperities(profile: Measured, asked: Outstanding) -> Made:
    """The samples without those that stand out of a robust form; they are kept in the origin."""
    refuse_late(profile, "remove_asperities")
    if profile.angle.size < LEAST:
        rule = f"at least {LEAST} samples for remove_asperities"
        raise ValueError(f"reading must have {rule}; got {profile.angle.size}")
    height, high = _height(profile)
    scale = max(_MEDIAN * float(np.median(np.abs(height))), _SMOOTH * high)
    order = np.argsort(profile.part_angle, kind="stable")
    runs = _runs(height[order] / scale, profile.part_angle[order], asked)
    out = np.zeros(height.size, dtype=bool)
    out[order] = np.isin(runs.of_point, runs.outstanding)
    _refuse_form(out, asked)
    told = _told(height[out], runs, asked, scale)
    removed = np.column_stack([profile.angle, profile.reading, height])[out]
    return _without(profile, out, tuple(map(tuple, removed.tolist())), told)


def _height(profile: Measured) -> tuple[Floats, float]:
    """Height of each reading above a robust form, away from the part's material, and the form's range, mm.

    Between samples that are not even the readings are taken as straight: harmonics through dust would ring.
    """
    points = 2 * profile.nyquist
    turn, place = even_turn(round(points)), np.mod(profile.part_angle, 2 * np.pi)
    readings = np.interp(turn, place, profile.deviation, period=2 * np.pi)
    form = robust_gaussian(readings, min(_FORM, points / _POINTS))
    residual = profile.deviation - np.interp(place, turn, form, period=2 * np.pi)
    return -residual if profile.internal else residual, float(np.ptp(form))


class _Runs(NamedTuple):
    """Run of neighbours of each point in order, -1: none; numbers of those that stand out, widths (rad)."""

    of_point: Floats
    outstanding: Floats
    widths: Floats


def _runs(height: Floats, angle: Floats, asked: Outstanding) -> _Runs:
    """Runs of neighbours on the closed turn above the foot, in sd, and those of them that are asperities."""
    raised = np.abs(height) if asked.both else height
    near = np.abs(height) >= _FOOT
    if np.all(near):
        return _Runs(np.zeros(height.size), np.zeros(1), np.full(1, 2 * np.pi))
    first = int(np.flatnonzero(~near)[0])  # the turn is opened at a point of no run
    opened = np.roll(near, -first)
    number = np.where(opened, np.cumsum(np.diff(opened, prepend=False) & opened), -1)
    of_point = np.roll(number, first)
    found = np.unique(of_point[near & (raised > asked.sigmas)])
    place = np.roll(angle, -first)
    place[angle.size - first :] += 2 * np.pi * np.ceil((angle[-1] - angle[0]) / (2 * np.pi) - 1e-9)
    widths = np.array([np.ptp(place[number == run]) for run in found])
    narrow = widths <= (np.inf if asked.width is None else asked.width)
    return _Runs(of_point, found[narrow], widths[narrow])


def _refuse_form(out: Bools, asked: Outstanding) -> None:
    share = float(np.mean(out))
    if share > _MOST:
        raise ValueError(
            f"reading must have at most {100 * _MOST:g} % of its points in asperities; got"
            f" {100 * share:.2g} % with sigmas={asked.sigmas:g}: that is form"
        )


def _told(height: Floats, runs: _Runs, asked: Outstanding, scale: float) -> str:
    """Sentence on the readings that were taken out."""
    off = "off" if asked.both else "above"
    least = f"more than {asked.sigmas:g} sd ({UM * asked.sigmas * scale:.2g} µm) {off} the form"
    if not height.size:
        return f"no asperity {least}"
    count = runs.outstanding.size
    places = f"{count} asperities" if count > 1 else "1 asperity"
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
    )
    angle, reading = profile.angle[~out], profile.reading[~out]
    circle = circle_of(angle, reading, profile._tip) if np.any(out) else profile.circle
    return Made(angle, reading, profile.tip_radius, circle, origin, None, profile.internal)
