"""Whole turns of readings: even ones without angles, a closing point, deviations from a nominal radius."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from centering.roundness._sampling import even_turn
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM
from sdpgrind.base.warned import warn

NOT_GIVEN: Floats = np.empty(0)
"""Default of angles, and of readings; told apart by identity."""
_RADII = 0.75  # chosen: median over range; radii with a wrong reading below 0 have 1, deviations about a half
_CLOSING = 0.25  # chosen: steps; a last angle so near to the first, a turn on, is the first again
_DRIFT = 10.0  # chosen: sd of a reading; of two readings of one place none in 10^11 pairs is farther apart
_SECOND = np.sqrt(6)  # derived: sd of second differences over that of a reading: root of 1 + 4 + 1
_ROUGH = 0.1  # chosen: height of deviations over the radius from which a unit was mistaken
_FORM, _TENTHS = 0.02, (0.1, 0.9)  # chosen: no ring that is measured is so far from round; quantiles
UNKNOWN_RADIUS = "deviations are from the tester's own circle, of a radius that is not known"
_FLAT = 1e6  # chosen: assumed radius over the largest deviation; 1000 shifts RONt (MZC) by 3e-6 um


def placed(angle: npt.ArrayLike, reading: npt.ArrayLike) -> tuple[npt.ArrayLike, npt.ArrayLike]:
    """Return angles and readings; one array alone holds the readings of an even turn that begins at 0."""
    if angle is not NOT_GIVEN and reading is not NOT_GIVEN:
        return angle, reading
    alone = reading if angle is NOT_GIVEN else angle
    if alone is NOT_GIVEN:
        raise TypeError("reading must be given (mm); got neither angle nor reading")
    return even_turn(np.size(alone)), alone


def refuse_deviations(reading: Floats) -> None:
    """Refuse readings of both signs: they count from a nominal radius."""
    low, high = float(reading.min()), float(reading.max())
    if low < 0 < high and float(np.median(reading)) < _RADII * (high - low):
        raise ValueError(
            f"reading must be > 0 (mm), the distance from the spindle axis; got {low:.4g} ... {high:.4g}:"
            " these are deviations: give them to Profile.from_deviation(..., radius=)"
        )


class OneTurn(NamedTuple):
    """Angles (rad) and readings (mm) without a closing point; a sentence where one was dropped."""

    angle: Floats
    reading: Floats
    told: tuple[str, ...] = ()


def without_closing(angle: Floats, reading: Floats) -> OneTurn:
    """Drop a last reading that is the first again; refuse one that drifted away from it."""
    step = np.diff(angle)
    span = abs(float(angle[-1] - angle[0]))
    usual = float(np.median(np.abs(step)))
    ordered = bool(np.all(step > 0) or np.all(step < 0))
    if not ordered or abs(span - 2 * np.pi) > _CLOSING * usual:
        return OneTurn(angle, reading)
    place = float(angle[-1])
    again = np.interp(place, angle[:-1], reading[:-1], period=2 * np.pi)
    _refuse_drift(float(reading[-1] - again), place, reading[:-1])
    told = f"closing point at {np.degrees(place):.6g} degrees dropped: the first reading again"
    return OneTurn(angle[:-1], reading[:-1], (told,))


def _refuse_drift(apart: float, place: float, reading: Floats) -> None:
    """Refuse a closing point that is far from the turn, over what noise and form do between neighbours."""
    sd = float(np.sqrt(np.mean(np.diff(reading, 2) ** 2))) / _SECOND
    rounding = 4 * np.finfo(float).eps * float(reading.max())
    if abs(apart) > _DRIFT * max(sd, rounding):
        raise ValueError(
            f"reading must close: the last one, at {np.degrees(place):.6g} degrees, is at the place of the"
            f" first and must differ from it by at most {_DRIFT:g} sd of a reading ({UM * sd:.2g} µm); got a"
            f" step of {UM * apart:.4g} µm: drift, measure again"
        )


def nominal_radius(deviation: Floats, radius: float | None, centred: bool) -> float:
    """Return the radius from which deviations count, mm; an assumed one where it is not known."""
    height = float(np.ptp(deviation))
    if radius is not None:
        nominal = checks.positive("radius", radius, "mm")
        refuse_rough(height, nominal)
        return nominal
    if not centred:
        raise ValueError(
            "radius must be the nominal radius (mm), or centred=True, where deviations are from the tester's"
            " own circle and the radius is not known; got None"
        )
    return assumed_radius(deviation)


def assumed_radius(deviation: Floats) -> float:
    """Return a radius at which deviations from a circle are as from a straight line, mm."""
    return _FLAT * max(float(np.abs(deviation).max(initial=0.0)), 1 / _FLAT)


def told_radius(radius: float | None, digits: int) -> str:
    """Words on a radius (mm) in so many digits."""
    return "radius not known" if radius is None else f"radius {radius:.{digits}g} mm"


def refuse_rough(height: float, radius: float) -> None:
    """Refuse deviations of a height (mm) that no ring has."""
    if height > _ROUGH * radius:
        raise ValueError(
            f"deviation must be at most {100 * _ROUGH:g} % of the radius from peak to valley,"
            f" {_ROUGH * radius:.6g} mm; got {height:.6g} mm: units.um(...) for micrometres?"
        )


def warn_of_form(left: Floats, radius: float) -> None:
    """Warn of residuals of a circle, mm, that are those of no ring, slots left out."""
    form = float(np.subtract(*np.quantile(left, _TENTHS[::-1])))
    if form > _FORM * radius:
        warn(
            f"deviation is {form:.3g} mm from valley to peak without the offset, {100 * form / radius:.2g} %"
            " of the radius: units.um(...) for micrometres?"
        )
