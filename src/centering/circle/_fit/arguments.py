"""Checks of the arguments of fits and estimators, angles in degrees that were taken for rad among them."""

from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.circle._fit.fit_kernels import distinct
from centering.circle._fit.form import known_harmonics
from centering.circle._fit.limacon import limacon_columns
from sdpgrind.base import checks, units
from sdpgrind.base.checks import Floats

COARSE = 0.75  # chosen: rad; mean step of several turns that is refused, as in the streaming estimator
DOUBTFUL = 0.08  # chosen: rad; mean step from which several turns are tried as degrees; finer is plausible
BETTER = 0.25  # chosen: largest residual squares as degrees, over those as rad, of angles in degrees
SMALL = 1e-9  # chosen: residual over the largest reading that is rounding
_NEAR = 0.36  # chosen: a thousandth of a turn of 360; the nearest whole turns in rad are 0.7 away


def readings(
    angle: npt.ArrayLike, reading: npt.ArrayLike, turns: float | None = None
) -> tuple[Floats, Floats]:
    """Return angles (rad) and readings (mm) as checked arrays of one length."""
    # copies: read-only or strided arrays would need a compilation of their own
    turned, line = (
        _real(name, given, unit)
        for name, given, unit in (("angle", angle, "rad"), ("reading", reading, "mm"))
    )
    if turned.ndim != 1 or line.shape != turned.shape:
        shapes = f"{turned.shape} and {line.shape}"
        raise ValueError(f"angle and reading must be one-dimensional of one length; got shapes {shapes}")
    if turned.size < 3:
        raise checks.refuse("angle", "at least 3 angles", turned.size)
    span = float(turned.max() - turned.min())
    if turns is not None and span > 2 * pi * checks.positive("turns", turns, "1") * (1 + 1e-9):
        raise ValueError(
            f"angle must span at most {turns:g} turns, {2 * pi * turns:.6g} rad;"
            f" got {span:.6g}: is it in degrees?"
        )
    smell = "" if turns is not None else evidence_of_degrees(turned, line)
    if smell:
        raise ValueError(
            f"angle must be in rad; {smell} smells of degrees: give units.deg(angle), or say how many turns"
        )
    return turned, line


def _real(name: str, given: npt.ArrayLike, unit: str) -> Floats:
    """New array of finite real numbers."""
    if np.iscomplexobj(given):
        raise TypeError(f"{name} must be real numbers ({unit}); got complex ones")
    return checks.finite_array(name, given, unit).copy()


def enough_angles(angle: Floats, wanted: int) -> None:
    """Refuse fewer than `wanted` different angles."""
    found = distinct(angle, wanted)
    if found < wanted:
        raise checks.refuse("angle", f"at least {wanted} different angles, with their readings", found)


def noise_of(noise_sd: float | None) -> float:
    """Checked least noise, mm; 0: unknown."""
    return 0.0 if noise_sd is None else checks.positive("noise_sd", noise_sd, "mm")


def form_of(harmonics: Any, least: float) -> Floats:
    """Rows of upr, cosine and sine (mm) of a known form, checked to be less than the least reading (mm)."""
    form = known_harmonics(harmonics)
    largest = float(np.hypot(form[:, 1], form[:, 2]).max(initial=0.0))
    if largest >= least:
        raise checks.refuse("harmonics amplitude", f"< {least:.6g}, the least reading", largest, "mm")
    return form


def evidence_of_degrees(angle: Floats, reading: Floats) -> str:
    """Return the evidence for degrees in words; "" if there is none."""
    span = float(angle.max() - angle.min())
    step = span / (angle.size - 1)
    if span > 4 * pi and _whole_in_degrees(span, step):
        return f"a span of {span:.6g}, with {angle.size} readings,"
    if span <= 4 * pi or step <= DOUBTFUL:
        return ""
    if step > COARSE:
        return f"a mean step of {step:.4g} over {span / (2 * pi):.3g} turns"
    as_rad, as_degrees = _left(angle, reading), _left(units.deg(1.0) * angle, reading)
    least = angle.size * (SMALL * float(np.abs(reading).max())) ** 2
    if as_rad > least and as_degrees < BETTER * as_rad:
        return f"{span / (2 * pi):.3g} turns, of which the readings go on as over {span:.4g} deg,"
    return ""


def _whole_in_degrees(span: float, step: float) -> bool:
    """Whether a span, with its last step or without, is one to five turns of 360."""
    turns = range(1, 6)  # chosen: from ten on whole turns in rad come as near
    return any(abs(value - 360.0 * m) <= _NEAR for value in (span, span + step) for m in turns)


def _left(angle: Floats, reading: Floats) -> float:
    """Sum of squared residuals of a limacon."""
    columns = limacon_columns(angle)
    return float(np.sum((reading - columns @ np.linalg.lstsq(columns, reading, rcond=None)[0]) ** 2))


def radius_and_sd(prior: tuple[float, float], tip_radius: float) -> tuple[float, float]:
    """Radius with the tip, and its standard deviation, mm."""
    if not isinstance(prior, tuple | list) or len(prior) != 2:
        raise TypeError(
            f"radius_prior must be a pair: radius and its standard deviation (mm); got {checks.shown(prior)}"
        )
    return checks.positive("radius_prior[0]", prior[0], "mm") + tip_radius, checks.positive(
        "radius_prior[1]", prior[1], "mm"
    )


def pairs(angle: npt.ArrayLike, reading: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Float arrays of one length; the kernels check the values."""
    angles, readings = _floats("angle", angle, "rad"), _floats("reading", reading, "mm")
    if angles.ndim != 1 or angles.shape != readings.shape:
        shapes = f"{angles.shape} and {readings.shape}"
        raise ValueError(f"angle and reading must be one-dimensional of one length; got {shapes}")
    return angles, readings


def _floats(name: str, values: npt.ArrayLike, unit: str) -> Floats:
    """Float array, which may hold NaN."""
    try:
        return np.ascontiguousarray(values, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be numbers ({unit}); got {checks.shown(values)}") from None


def flag(name: str, value: object) -> bool:
    """A value that must be True or False."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False; got {checks.shown(value)}")
    return bool(value)
