"""The limacon r = R + d cos psi, Mears (4.4): exact result of its fit to a circle, and the correction."""

from math import nextafter, pi

import numpy as np
import numpy.typing as npt
from scipy.special import ellipe, ellipk, hyp2f1

from centering.circle._fit.curve import circle_reading
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

METHODS = ("exact", "mears")
MEARS = 0.2346  # source: Mears (4.21), a fit over all offsets; 0.25 for small ones
EVEN = 0.005  # derived: |mean of exp(i n angle)|, n = 1, 2, 3, of a turn that lacks 2 degrees
NEWTON_STEPS = 6  # chosen: steps at most; they converge quadratically


def limacon_reading(angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float) -> Floats:
    """Return the reading of a limacon, mm, Mears (4.4): R + d cos(angle - offset_angle).

    It lacks d^2 sin^2 psi/(2 R) of the exact curve: the mean is too large by d^2/(4 R), and an undulation of
    2 upr of this amplitude is missing. Residuals of a limacon are therefore no measure of form.

    Parameters
    ----------
    angle : array_like
        Spindle angle, rad.
    radius, offset : float
        Mean radius and amplitude, mm.
    offset_angle : float
        Direction of the largest reading, rad.

    Returns
    -------
    array, of the shape of `angle`
        Readings, mm.

    Raises
    ------
    ValueError, TypeError
        For a radius that is not > 0, a negative offset, or values that are not finite.

    Examples
    --------
    >>> limacon_reading([0.0, np.pi / 2], 61.94, 3.6, 0.0).round(9).tolist()
    [65.54, 61.94]
    """
    turned = checks.finite_array("angle", angle, "rad") - checks.number("offset_angle", offset_angle, "rad")
    mean, amplitude = checks.positive("radius", radius, "mm"), checks.nonnegative("offset", offset, "mm")
    return np.asarray(mean + amplitude * np.cos(turned))


def limacon_radius(radius: float, offset: float) -> float:
    """Return the radius (mm) of a limacon fitted to an offset circle over whole evenly sampled turns.

    (2 R/pi) E(d^2/R^2), E the complete elliptic integral of the second kind: the mean of the exact curve
    (4.11), for which the source gives no closed form (after (4.18)). Amplitude d and direction are unbiased
    at any offset.

    Parameters
    ----------
    radius, offset : float
        Radius R > 0 of the part and distance d of its centre from the spindle axis in [0, R], mm.

    Raises
    ------
    ValueError, TypeError
        For a value out of its range.

    Examples
    --------
    >>> round(limacon_radius(61.9, 26.4), 3)
    58.981
    """
    size, share = _size_and_share(radius, offset)
    return float(2 / pi * size * ellipe(share))


def _size_and_share(radius: float, offset: float) -> tuple[float, float]:
    """Radius (mm) and squared relative offset, checked."""
    size = checks.positive("radius", radius, "mm")
    return size, (checks.within("offset", offset, 0.0, size, "mm") / size) ** 2


def corrected_radius(fitted_radius: float, fitted_offset: float, method: str = "exact") -> float:
    """Return the radius of a part (mm) from the limacon fitted to it over whole evenly sampled turns.

    Parameters
    ----------
    fitted_radius, fitted_offset : float
        Constant part > 0 of the limacon and its amplitude in [0, pi/2 fitted_radius], mm.
    method : {"exact", "mears"}
        Inverse of `limacon_radius` by Newton's method, or Mears (4.22), with errors up to 0.6 %.

    Raises
    ------
    ValueError, TypeError
        For a value out of its range: beyond pi/2 no circle contains the spindle axis.

    Examples
    --------
    >>> round(corrected_radius(58.9, 26.4), 2), round(corrected_radius(58.9, 26.4, method="mears"), 2)
    (61.82, 61.68)
    """
    fitted, offset = (
        checks.positive("fitted_radius", fitted_radius, "mm"),
        checks.nonnegative("fitted_offset", fitted_offset, "mm"),
    )
    if offset > pi / 2 * fitted:
        rule = f"<= pi/2 fitted_radius, {pi / 2 * fitted:.6g}: the spindle's axis lies in the part"
        raise checks.refuse("fitted_offset", rule, offset, "mm")
    guess = fitted * (1.0 + MEARS * (offset / fitted) ** 2)
    return guess if checks.one_of("method", method, METHODS) == "mears" else _inverse(fitted, offset, guess)


def _inverse(fitted: float, offset: float, guess: float) -> float:
    """R with (2 R/pi) E((d/R)^2) = fitted, by Newton's method: d(R E)/dR = K; R E rises and is concave."""
    least = max(offset, nextafter(0.0, 1.0))
    radius = max(guess, least * (1 + 1e-12))
    for _ in range(NEWTON_STEPS):
        share = (offset / radius) ** 2
        step = (radius * ellipe(share) - pi / 2 * fitted) / ellipk(share)
        radius = max(radius - step, least * (1 + 1e-12))
        if abs(step) <= 1e-15 * radius:
            break
    return float(radius)


def limacon_wave(radius: float, offset: float) -> float:
    """Return the amplitude (mm) of the false undulation, 2 upr, in the residuals of a circle's limacon.

    About d^2/(4 R); exactly R (k^2/4) 2F1(1/2, 3/2; 3; k^2) with k = d/R. Read no roundness from such
    residuals unless this is below the wanted resolution.

    Parameters
    ----------
    radius, offset : float
        Radius R > 0 of the part and distance d of its centre from the spindle axis in [0, R], mm.

    Raises
    ------
    ValueError, TypeError
        For a value out of its range.

    Examples
    --------
    >>> round(1e6 * limacon_wave(30.0, 0.1)), round(1e3 * limacon_wave(83.5, 3.6), 1)
    (83, 38.8)
    """
    size, share = _size_and_share(radius, offset)
    return float(size * share / 4 * hyp2f1(0.5, 1.5, 3.0, share))


def limacon_bias(angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float) -> Floats:
    """Return the errors of radius and centre (x, y), mm, of a limacon fitted to the exact noiseless curve.

    Over whole even turns the centre is unbiased and `corrected_radius` corrects the radius; over an arc all
    three are biased, and correcting the radius does not help.

    Parameters
    ----------
    angle : array_like, shape (m,)
        Spindle angles of the readings, rad.
    radius, offset, offset_angle : float
        Circle as for `circle_reading`, mm and rad.

    Returns
    -------
    array, shape (3,)
        Fitted minus true radius, centre_x and centre_y, mm.

    Raises
    ------
    ValueError, TypeError
        As `circle_reading`, and for fewer than 3 angles.

    Examples
    --------
    >>> arc = np.radians(np.arange(0, 181))
    >>> error = limacon_bias(arc, 61.94, 12.388, 0.0)
    >>> round(float(np.hypot(error[1], error[2])) / 12.388, 2)
    0.11
    """
    turned = np.atleast_1d(checks.finite_array("angle", angle, "rad"))
    if turned.size < 3:
        raise checks.refuse("angle", "at least 3 angles", turned.size)
    lacking = circle_reading(turned, radius, offset, offset_angle) - limacon_reading(
        turned, radius, offset, offset_angle
    )
    return np.asarray(np.linalg.lstsq(limacon_columns(turned), lacking, rcond=None)[0])


def limacon_columns(angle: Floats) -> Floats:
    """Columns 1, cos, sin of the limacon, (m, 3), Mears (4.5)."""
    return np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=-1)


def whole_turns(angle: Floats) -> bool:
    """Whether readings are even over whole turns, as the closed forms require."""
    unevenness = [abs(np.exp(1j * n * angle).mean()) for n in (1, 2, 3)]
    return bool(max(unevenness) <= EVEN)


def linear_gauge_offset(reading: npt.ArrayLike) -> float:
    """Return the offset (mm) shown by a dial gauge, half the range of the readings, Mears (4.48).

    For display only: noise always raises it. An offset of 1 with noise of 0.5 gives about 2.2 from 360
    readings.

    Parameters
    ----------
    reading : array_like
        Readings of whole turns, mm.

    Raises
    ------
    ValueError, TypeError
        For no reading, or values that are not finite.

    Examples
    --------
    >>> round(linear_gauge_offset([58.34, 61.9, 65.54]), 9)
    3.6
    """
    values = checks.finite_array("reading", reading, "mm")
    if values.size == 0:
        raise checks.refuse("reading", "at least one reading", 0)
    return float(np.ptp(values)) / 2
