"""Scans of a part: circle, place, noise and form."""

from collections.abc import Sequence
from math import pi
from typing import Any, NamedTuple

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.circle._fit.estimate import CircleEstimate
from centering.circle._fit.identify import identify_circle
from centering.roundness._gone_round import unlike
from sdpgrind import identify as idf
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.rows import Doubt, compared
from sdpgrind.base.doubts.words import amount, significant
from sdpgrind.base.tables import tables_in

_UNITS = {"angle": "rad", "reading": "mm"}
_TURN = 0.99 * 2 * pi  # chosen: an arc that lacks a hundredth of a turn still separates form from place
_WIDER = 1.05  # chosen: less changes no digit of an interval
_HARMONICS = range(2, 16)  # chosen: the usual undulations of a ring; higher ones move no centre


class Scan(NamedTuple):
    """Spindle angle (rad) and reading (mm) of one part."""

    angle: Floats
    reading: Floats


def scans_of(data: Any) -> tuple[Scan, ...]:
    """Scans of each part; empty: the data hold none."""
    if isinstance(data, tuple) and len(data) == 2 and np.ndim(data[0]) == 1:
        return (_kept(*data),)
    if not hasattr(data, "tiers") and not hasattr(data, "data_vars") and hasattr(data, "angle"):
        return (_kept(data.angle, data.reading),) if hasattr(data, "reading") else ()
    if isinstance(data, dict) and not tables_in(data, "probe") and "time" not in data:
        return (_kept(data["angle"], data["reading"]),) if _UNITS.keys() <= data.keys() else ()
    try:
        each = idf.series(data, _UNITS, tier="probe")
    except (TypeError, ValueError, KeyError):
        return ()
    return tuple(_kept(one["angle"], one["reading"]) for one in each)


def _kept(angle: Any, reading: Any) -> Scan:
    angle, reading = np.asarray(angle, dtype=float), np.asarray(reading, dtype=float)
    there = np.isfinite(angle) & np.isfinite(reading)
    return Scan(angle[there], reading[there])


def of_scans(problem: CenteringProblem, each: Sequence[Scan]) -> tuple[Doubt, list[str]]:
    """Row of the radius, and sentences on place, noise, form and arc."""
    circles = [identify_circle(scan, throw=False) for scan in each]
    row = compared(_mean(circles), "radius", problem.model.part.radius, note="circle")
    sentences = [] if len(each) > 1 else [_place(problem, circles[0])]
    sentences += [_noise(circles, each), _form(circles[0], each[0]), _arc(circles)]
    sentences += dict.fromkeys(unlike(*scan) for scan in each)
    return row, [sentence for sentence in sentences if sentence]


def _mean(circles: Sequence[CircleEstimate]) -> idf.Estimate:
    """Radius of one part, or its mean over several with its standard error."""
    if len(circles) == 1 or not all(circle.ok for circle in circles):
        return next((circle for circle in circles if not circle.ok), circles[0])
    radius = np.array([circle.radius for circle in circles])
    own = float(np.mean([circle.radius_sd**2 for circle in circles]))
    variance = max(float(radius.var(ddof=1)), own) / radius.size
    return idf.Estimate(
        ("radius",),
        radius.mean(keepdims=True),
        np.array([[variance]]),
        units=("mm",),
        freedom=radius.size - 1.0,
    )


def _place(problem: CenteringProblem, circle: CircleEstimate) -> str:
    if not circle.ok:
        return ""
    away = f"{amount(circle.offset, 'mm', 4)} at {circle.offset_angle:.4g} rad"
    limit = "more than" if circle.offset > problem.offset_max else "within"
    return (
        f"The part is off by {away}, known to ±{amount(circle.uncertainty(), 'mm')} (95 %), {limit}"
        f" offset_max = {problem.offset_max:g} mm; sd of the centre in each direction"
        f" {amount(circle.center_sd, 'mm')}, measuring_sd {amount(problem.scatter.measuring_sd, 'mm')}."
    )


def _noise(circles: Sequence[CircleEstimate], each: Sequence[Scan]) -> str:
    sd = float(np.sqrt(np.mean([circle.noise_sd**2 for circle in circles])))
    alike = max(circle.inflation for circle in circles)
    words = (
        f", correlated from reading to reading, which makes intervals {significant(alike)} times as wide"
        if alike > _WIDER
        else ""
    )
    step = gauge.step_words(np.concatenate([scan.reading for scan in each]), sd, "mm")
    return f"Readings scatter about the circle by {amount(sd, 'mm')}{words}; {step}."


def _form(circle: CircleEstimate, scan: Scan) -> str:
    """Largest undulation of the residuals over whole turns."""
    if not circle.ok or circle.swept < _TURN or scan.angle.size <= 2 * len(_HARMONICS) + 1:
        return ""
    left = scan.reading - circle.reading(scan.angle)
    waves = [wave(k * scan.angle) for k in _HARMONICS for wave in (np.cos, np.sin)]
    columns = np.column_stack([np.ones(left.size), *waves])
    value, *_ = np.linalg.lstsq(columns, left, rcond=None)
    sizes = np.hypot(value[1::2], value[2::2])
    most = int(np.argmax(sizes))
    return f"The largest undulation is harmonic {_HARMONICS[most]}: {amount(float(sizes[most]), 'mm', 3)}."


def _arc(circles: Sequence[CircleEstimate]) -> str:
    least = min(circle.swept for circle in circles)
    if least >= _TURN:
        return ""
    return (
        f"The readings cover {np.degrees(least):.0f} degrees: a whole turn would tell the form of the part"
        " from its place."
    )
