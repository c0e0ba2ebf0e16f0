"""Circle from measured data, by the exact curve or by the source's limacon and its correction."""

import warnings
from collections.abc import Mapping
from math import hypot, inf, pi
from typing import Any

import numpy as np

from centering.circle._fit.arguments import enough_angles, noise_of, readings
from centering.circle._fit.estimate import NAMES, CircleEstimate
from centering.circle._fit.fit import CONDITION, fit_circle
from centering.circle._fit.fit_kernels import distinct
from centering.circle._fit.fit_noise import (
    ROUNDING,
    TURN,
    Seen,
    Travel,
    seen_noise,
    step_noise,
    travel_of,
    turn_and_place,
)
from centering.circle._fit.limacon import MEARS, corrected_radius, limacon_bias, limacon_columns, whole_turns
from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.words import amount
from sdpgrind.base.warned import warn
from sdpgrind.identify import Status

METHODS = ("exact", "limacon", "printed")
NEAR = 0.01  # chosen: offset over radius above which the bias of a limacon over an arc is worth a warning
_SIGMAS = 5.0  # chosen: of a reading, as axes wander by some; Gaussian noise differs so in 1 of 300 000 scans
_READINGS = 12  # chosen: fewest directions of a turn that is held against another; fewer tell no scatter
_EXACT = 1e-9  # chosen: difference over the reading that is rounding
_UNITS = {"angle": "rad", "reading": "mm"}


def identify_circle(
    data: Any,
    *,
    tip_radius: float = 0.0,
    loss: str = "linear",
    method: str = "exact",
    noise_sd: float | None = None,
    radius_prior: tuple[float, float] | None = None,
    harmonics: Any = None,
    turns: float | None = None,
    part: int | None = None,
    throw: bool = True,
) -> CircleEstimate:
    """Estimate radius and centre of an offset circle from measured data.

    ========== ===============================================================================================
    `method`   fitted curve
    ========== ===============================================================================================
    "exact"    offset circle with a tip, Mears (4.11), see `fit_circle`: valid at any offset and over any arc
    "limacon"  R + d cos(angle - phi), (4.4). Over whole even turns the centre is unbiased and the radius too
               small by about d^2/(4 R); over an arc all are biased, with a warning from d/R = 0.01 on
    "printed"  the limacon with the radius corrected by (4.22), as in the source: whole even turns only
    ========== ===============================================================================================

    Parameters
    ----------
    data : pair of arrays, mapping of arrays, scan, table of a log, or log
        Spindle angle (rad) and reading (mm): (angle, reading), or by these names (also attributes, as of a
        scan), or a log whose only table, or table "probe", holds these columns and time (s), or that table.
        Rows of scans and logs without a reading are left out.
    method : {"exact", "limacon", "printed"}
        Fitted curve.
    part : int, optional
        Number of the part in a log, unit 1; needed where there are several.
    tip_radius, noise_sd, turns, throw : optional
        See `fit_circle`, mm and unit 1.
    loss, radius_prior, harmonics : optional
        See `fit_circle`; for the exact curve only.

    Returns
    -------
    CircleEstimate
        Radius and centre with their covariance.

    Raises
    ------
    ValueError, TypeError
        For missing, bad or too few data, or an option that the method does not take; for "printed" without
        even whole turns.

    Warns
    -----
    UserWarning
        When a limacon is fitted to less than whole even turns of a circle offset by more than 0.01 radius:
        with the bias, mm. When turns of a log show different centres, as of two parts.

    Examples
    --------
    >>> angle = np.radians(np.arange(0, 360))
    >>> reading = 26.4 * np.cos(angle) + np.sqrt(61.9**2 - (26.4 * np.sin(angle)) ** 2)
    >>> for method in ("exact", "limacon", "printed"):
    ...     circle = identify_circle((angle, reading), method=method)
    ...     print(method, round(circle.radius, 3), round(circle.offset, 3))
    exact 61.9 26.4
    limacon 58.981 26.4
    printed 61.753 26.4
    """
    angle, reading = _pair(data, part, turns)
    if checks.one_of("method", method, METHODS) == "exact":
        known: dict[str, Any] = {"radius_prior": radius_prior, "noise_sd": noise_sd, "harmonics": harmonics}
        return fit_circle(angle, reading, tip_radius=tip_radius, loss=loss, turns=turns, throw=throw, **known)
    for name, given, taken in (
        ("loss", loss, "linear"),
        ("radius_prior", radius_prior, None),
        ("harmonics", harmonics, None),
    ):
        if given is not taken and given != taken:
            raise ValueError(f"{name} must be {taken!r} for method {method!r}; got {checks.shown(given)}")
    turned, line = readings(angle, reading, turns)
    fitted = _limacon(turned, line, checks.nonnegative("tip_radius", tip_radius, "mm"), noise_of(noise_sd))
    if method == "printed":
        fitted = _corrected(fitted, turned)
    elif fitted.ok:
        _warn_of_bias(fitted, turned, line)
    if throw and not fitted.ok:
        raise ValueError(fitted.message)
    return fitted


def _pair(data: Any, part: int | None, turns: float | None) -> tuple[Any, Any]:
    """Angle and reading from any of the accepted data."""
    if isinstance(data, tuple | list | np.ndarray):
        if len(data) != 2:
            raise ValueError(f"data must be the pair (angle, reading) (rad, mm); got {len(data)} entries")
        return data[0], data[1]
    if not hasattr(data, "data_vars") and isinstance(data, Mapping) and "angle" in data:
        read = idf.readings(data, _UNITS, tier="probe", each="readings", part=part)
        return read["angle"], read["reading"]
    if not isinstance(data, Mapping) and hasattr(data, "angle") and hasattr(data, "reading"):
        return _read(data.angle, data.reading)
    of_parts = idf.series(data, _UNITS, tier="probe", part=part)
    if len(of_parts) != 1:
        held = ", ".join(one.label for one in of_parts) or "none"
        raise ValueError(f"part must say which part (unit 1); data hold {held}")
    kept = _read(of_parts[0]["angle"], of_parts[0]["reading"])
    if told := unlike_turns(*kept, turns):
        warn(told)
    return kept


def unlike_turns(angle: Any, reading: Any, turns: float | None = None) -> str:
    """Sentence on turns whose circles differ, as of two parts in one scan; empty: they agree."""
    angle, reading = readings(angle, reading, turns)
    turn, place = turn_and_place(angle)
    filled = np.flatnonzero(np.bincount(turn) >= _READINGS)
    for other in sorted({*filled[-2:], *filled[len(filled) // 2 :][:1]} - {*filled[:1]}):
        arcs = _same_arc(place, turn == filled[0], turn == other)
        one, another = (_arc_circle(angle[arc] % TURN, reading[arc]) for arc in arcs)
        differs = _differ(one, another, _EXACT * float(np.abs(reading).max()))
        if differs is not None:
            return (
                f"{differs} from turn to turn, by more than {_SIGMAS:g} standard deviations of a reading; did"
                " part or axis move, is the angle in another unit, or is it of another part? Log.read takes"
                ' its column, part="header", and Profile.read one of them, section=("header", ...)'
            )
    return ""


def _same_arc(place: Floats, *turns: Any) -> list[Any]:
    """Rows of turns within the arc that all of them cover: on it the form of one part shifts all alike."""
    first = max(place[rows].min() for rows in turns) - ROUNDING
    last = min(place[rows].max() for rows in turns) + ROUNDING
    return [rows & (place >= first) & (place <= last) for rows in turns]


def _arc_circle(angle: Any, reading: Any) -> CircleEstimate | None:
    """Circle of an arc, of a limacon where a probe shows deviations; None: too few directions."""
    if distinct(angle, _READINGS) < _READINGS:
        return None
    if reading.min() <= 0:
        return _limacon(angle, reading, 0.0, 0.0)
    return fit_circle(angle, reading, turns=1.0, throw=False)


def _differ(one: CircleEstimate | None, other: CircleEstimate | None, rounding: float) -> str | None:
    """Difference of two circles in words; None: it is within noise, and within what an axis moves."""
    if one is None or other is None:
        return None
    apart = hypot(one.center_x - other.center_x, one.center_y - other.center_y)
    for what, off, sd in (
        ("centre", apart, hypot(one.center_sd, other.center_sd)),
        ("radius", abs(one.radius - other.radius), hypot(one.radius_sd, other.radius_sd)),
    ):
        if off > max(_SIGMAS * max(sd, one.noise_sd, other.noise_sd), rounding):
            return f"the {what} differs by {amount(off, 'mm', 3)}"
    return None


def _read(angle: Any, reading: Any) -> tuple[Any, Any]:
    """Rows with a reading."""
    kept = np.isfinite(angle) & np.isfinite(reading)
    return angle[kept], reading[kept]


def _limacon(angle: Floats, reading: Floats, tip_radius: float, known: float) -> CircleEstimate:
    """Least squares on [1, cos, sin], Mears (4.5)-(4.7) in this order."""
    enough_angles(angle, 4 - (known > 0))
    travel = travel_of(angle)
    q, upper = np.linalg.qr(limacon_columns(angle))
    length = np.sqrt(np.sum(upper**2, axis=0))
    fields: dict[str, Any] = {
        "samples": angle.size,
        "swept": travel.swept,
        "tip_radius": tip_radius,
        "model": "limacon",
    }
    if np.abs(np.diag(upper)).min() * CONDITION <= length.max():
        name = NAMES[int(np.argmin(np.abs(np.diag(upper))))]
        message = f"the readings do not tell {name} from the others: turn the part further"
        value = np.array([reading.mean(), 0.0, 0.0])
        return CircleEstimate(value, np.diag([inf] * 3), Status.UNDETERMINED, message, freedom=1.0, **fields)
    back = np.linalg.inv(upper)
    value = back @ (q.T @ reading)
    left = reading - limacon_columns(angle) @ value
    seen = _noise(travel, angle, left, known, step_noise(reading))
    status, message = Status.OK, ""
    if not (offset := hypot(value[1], value[2])) <= pi / 2 * value[0]:
        status = Status.IMPOSSIBLE
        message = (
            "offset must be <= pi/2 radius (mm), as the spindle's axis lies in the part;"
            f" got {offset:.6g} and {value[0]:.6g}"
        )
    fields |= {"noise_sd": seen.noise_sd, "inflation": seen.inflation, "form_bound": seen.form_bound}
    return CircleEstimate(
        value, seen.scale**2 * back @ back.T, status, message, freedom=seen.freedom, **fields
    )


def _noise(travel: Travel, angle: Floats, left: Floats, known: float, step: float) -> Seen:
    """Noise of a limacon, whose columns are those of a circle about the axis."""
    freedom = float(angle.size - 3)
    sd = float(np.sqrt(left @ left / max(freedom, 1.0)))
    return seen_noise(
        travel, (angle, np.ones_like(angle)), np.array([1.0, 0.0, 0.0]), left, (sd, sd, freedom), known, step
    )


def _corrected(fitted: CircleEstimate, angle: Floats) -> CircleEstimate:
    """The limacon with radius and covariance corrected by (4.22)."""
    if not whole_turns(angle):
        raise ValueError(
            "method 'printed' must have readings even over whole turns (rad),"
            " as its correction of the radius holds for these only;"
            f" got {fitted.samples} readings over {fitted.swept:.4g} rad: use method 'exact'"
        )
    if not fitted.ok:
        return fitted
    seen, tip = fitted.radius + fitted.tip_radius, fitted.tip_radius
    share = fitted.offset / seen
    carry = np.eye(3)
    carry[0] = 1 - MEARS * share**2, 2 * MEARS * fitted.center_x / seen, 2 * MEARS * fitted.center_y / seen
    value = [corrected_radius(seen, fitted.offset, method="mears") - tip, fitted.center_x, fitted.center_y]
    return fitted.replace(value=value, covariance=carry @ fitted.covariance @ carry.T, model="printed")


def _warn_of_bias(fitted: CircleEstimate, angle: Floats, reading: Floats) -> None:
    """Warn of the bias of a limacon over an arc, at the offset of the exact curve."""
    if fitted.offset_ratio <= NEAR or whole_turns(angle):
        return
    size = "of unknown size"
    if reading.min() > 0:
        circle = fit_circle(angle, reading, tip_radius=fitted.tip_radius, throw=False)
        size = _bias(circle, angle) if circle.ok else size
    text = f"a limacon fitted to less than whole even turns has a bias {size}: method 'exact' has none"
    warnings.warn(text, UserWarning, stacklevel=4)


def _bias(circle: CircleEstimate, angle: Floats) -> str:
    """Sentence on the bias of a limacon, at the offset of the exact curve."""
    error = limacon_bias(angle, circle.radius + circle.tip_radius, circle.offset, circle.offset_angle)
    centre = hypot(error[1], error[2])
    bias = f"of {centre:.3g} mm in the centre and {error[0]:.3g} mm in the radius"
    return f"{bias}, at an offset of {circle.offset:.4g} mm"
