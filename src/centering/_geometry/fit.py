"""A circle fitted to a batch of readings: the exact curve, by least squares or robustly."""

from collections.abc import Mapping
from math import inf, nan, pi
from typing import Any

import numpy as np
import numpy.typing as npt

from centering._geometry import fit_kernels as at
from centering._geometry.estimate import NAMES, CircleEstimate
from centering._geometry.robust import LOSSES, triples
from centering._geometry.robust_kernels import fit_robust
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status

CONDITION = 1e8
ROBUST = 6
ROUNDS = 10
"""Fits in which the part's known form is laid about the centre found."""


def fit_circle(
    angle: npt.ArrayLike,
    reading: npt.ArrayLike,
    *,
    tip_radius: float = 0.0,
    loss: str = "linear",
    prior: tuple[float, float] | None = None,
    noise_sd: float | None = None,
    harmonics: Any = None,
    turns: float | None = None,
    throw: bool = True,
) -> CircleEstimate:
    """Fit the exact curve of an offset circle, Mears (4.11), to readings over the spindle angle.

    A linear form of the curve, exact without noise, gives the start; Gauss-Newton steps make it the estimate of maximum
    likelihood for independent noise of the readings. Angles may repeat, lie in any order, leave gaps, and span several turns.

    Parameters
    ----------
    angle : array_like, shape (m,)
        Spindle angle, rad.
    reading : array_like, shape (m,)
        Radial position of the probe's contact, mm, > 0.
    tip_radius : float
        Radius of the probe's tip, mm, >= 0.
    loss : {"linear", "huber", "soft_l1"}
        Squares; or beyond 1.345 scales the absolute value, for readings of which up to 30 % are far off. The start is that of
        100 circles through three readings, always the same, which has half of the readings nearest. Then readings beyond 6
        scales are left out, as dust only adds; the scale is that of the median absolute residual of the others.
    prior : (mean, sd), optional
        What is known of the radius, mm, both > 0.
    noise_sd : float, optional
        Standard deviation of one reading, mm, > 0; by default what the fit leaves.
    harmonics : spectrum or mapping, optional
        The part's known form, which adds to its radius: an object with arrays upr, amplitude (mm) and phase (rad), or a mapping
        upr -> (amplitude, phase); amplitude cos(upr beta - phase) at the polar angle beta about the part's centre.
    turns : float, optional
        Turns that the readings span at most, unit 1; guards against angles in degrees.
    throw : bool
        Raise when the data do not determine the circle; else the status says so.

    Returns
    -------
    CircleEstimate
        Radius and centre, mm, with the covariance s^2 (J'J)^-1; of a robust fit that of Huber, which counts what the
        weights cost. Its `down_weighted` readings count for less than half.

    Raises
    ------
    ValueError, TypeError
        For unequal lengths, what is not finite, readings <= 0, too few different angles (3, or 4 where the noise is not known;
        one less with a prior), angles that smell of degrees; with `throw` when the axis lies outside of the circle, or the
        data do not tell the quantities apart.

    Examples
    --------
    >>> angle = np.radians(np.arange(0, 120))
    >>> reading = 3.6 * np.cos(angle - 0.5) + np.sqrt(61.94**2 - (3.6 * np.sin(angle - 0.5)) ** 2)
    >>> circle = fit_circle(angle, reading)
    >>> round(circle.radius, 9), round(circle.offset, 9), round(circle.offset_angle, 9)
    (61.94, 3.6, 0.5)
    """
    turned, line = readings(angle, reading, turns)
    if line.min() <= 0:
        raise checks.refuse(f"reading[{line.argmin()}]", "> 0", float(line.min()), "mm")
    tip, known = checks.nonnegative("tip_radius", tip_radius, "mm"), noise_of(noise_sd)
    mean, sd = radius_prior(prior)
    enough_angles(turned, 4 - np.isfinite(known) - np.isfinite(sd))
    kind = LOSSES[checks.one_of("loss", loss, LOSSES)]
    if kind and line.size < ROBUST:
        raise checks.refuse("reading", f"at least {ROBUST} readings for loss {loss!r}", line.size)
    options = (mean + tip, sd, known) if kind == 0 else (mean + tip, sd, known, kind, triples(turned))
    ended, result = _fitted(turned, line + tip, options, form_of(harmonics))
    result[at.RADIUS] -= tip
    circle = _estimate(ended, result, known, samples=line.size, swept=at.swept(np.sort(turned)), tip_radius=tip)
    if throw and not circle.ok:
        raise ValueError(circle.message)
    return circle


def _fitted(angle: Floats, reading: Floats, options: tuple[Any, ...], form: tuple[Floats, Floats, Floats]) -> tuple[int, Floats]:
    """How the fit ended and its slots; the known form is laid about the centre found until that stays."""
    result, added = np.zeros(at.RESULT), np.zeros(angle.size)
    fit = at.fit_exact if len(options) == 3 else fit_robust
    ended = fit(angle, reading, added, *options, result)
    for _ in range(ROUNDS if form[0].size else 0):
        before = result[:3].copy()
        added = formed(angle, reading, before, form)
        ended = fit(angle, reading, added, *options, result)
        if ended != at.FITTED or np.abs(result[:3] - before).max() <= 1e-13 * before[0]:
            break
    return ended, result


def formed(angle: Floats, reading: Floats, circle: Floats, form: tuple[Floats, Floats, Floats]) -> Floats:
    """What the part's form adds to its radius where it was read (private to this package)."""
    part_angle = np.arctan2(reading * np.sin(angle) - circle[2], reading * np.cos(angle) - circle[1])
    upr, amplitude, phase = form
    return np.asarray(amplitude @ np.cos(np.outer(upr, part_angle) - phase[:, None]))


def _estimate(ended: int, result: Floats, known: float, **told: Any) -> CircleEstimate:
    """The estimate in words and numbers."""
    status, message = _judged(ended, result)
    unit, freedom = result[at.UNIT], inf if np.isfinite(known) else float(result[at.FREEDOM])
    covariance = unit**2 * result[at.INVERSE :].reshape(3, 3)
    if status is not Status.OK:
        covariance, freedom = np.diag([inf, inf, inf]), 1.0
    return CircleEstimate(
        result[:3],
        covariance,
        status,
        message,
        freedom=freedom,
        noise_sd=float(result[at.NOISE]),
        down_weighted=int(result[at.AWAY]),
        **told,
    )


def _judged(ended: int, result: Floats) -> tuple[Status, str]:
    """Status, and what stands against the circle."""
    offset = float(np.hypot(result[at.X], result[at.Y]))
    if ended == at.OUTSIDE or (ended == at.FITTED and offset >= result[at.RADIUS]):
        return Status.IMPOSSIBLE, (
            f"offset must be < radius (mm), as the spindle's axis lies in the part; the readings lead to {offset:.6g} and"
            f" {result[at.RADIUS]:.6g}: turn the part further, or look for bad readings or a wrong unit"
        )
    if ended == at.SINGULAR or result[at.CONDITION] > CONDITION:
        told = f"; the others widen its standard deviation {result[at.CONDITION]:.3g} times" if result[at.CONDITION] > 0 else ""
        name = NAMES[int(result[at.WORST])]
        return Status.UNDETERMINED, f"the readings do not tell {name} from the others: turn the part further{told}"
    if ended == at.ENDLESS:
        return Status.UNDETERMINED, "the fit does not settle: turn the part further, or look for bad readings"
    return Status.OK, ""


def readings(angle: npt.ArrayLike, reading: npt.ArrayLike, turns: float | None = None) -> tuple[Floats, Floats]:
    """Return angles (rad) and readings (mm) as arrays of one length, checked (private to this package)."""
    # Copies: compiled code would be compiled anew for arrays that are read-only or strided.
    turned, line = checks.finite_array("angle", angle, "rad").copy(), checks.finite_array("reading", reading, "mm").copy()
    if turned.ndim != 1 or line.shape != turned.shape:
        raise ValueError(f"angle and reading must be one-dimensional of one length; got shapes {turned.shape} and {line.shape}")
    if turned.size < 3:
        raise checks.refuse("angle", "at least 3 angles", turned.size)
    span = float(turned.max() - turned.min())
    if turns is not None and span > 2 * pi * checks.positive("turns", turns, "1") * (1 + 1e-9):
        raise ValueError(f"angle must span at most {turns:g} turns, {2 * pi * turns:.6g} rad; got {span:.6g}: is it in degrees?")
    if turns is None and span > 4 * pi and 0.9 < span / (turned.size - 1) < 1.1:
        step = span / (turned.size - 1)
        raise ValueError(f"angle must be in rad; a mean step of {step:.4g} smells of degrees (units.deg), else give turns")
    return turned, line


def enough_angles(angle: Floats, wanted: int) -> None:
    """Refuse fewer different angles than `wanted` (private to this package)."""
    found = at.distinct(angle, wanted)
    if found < wanted:
        raise checks.refuse("angle", f"at least {wanted} different angles, with their readings", found)


def noise_of(noise_sd: float | None) -> float:
    """Checked noise, mm; NaN where it is not known (private to this package)."""
    return nan if noise_sd is None else checks.positive("noise_sd", noise_sd, "mm")


def radius_prior(prior: tuple[float, float] | None) -> tuple[float, float]:
    """Checked mean and sd of the radius, mm; an infinite sd where nothing is known (private to this package)."""
    if prior is None:
        return 0.0, inf
    try:
        mean, sd = prior
    except (TypeError, ValueError):
        raise TypeError(f"prior must be (mean, sd) of the radius (mm); got {checks.shown(prior)}") from None
    return checks.positive("prior mean", mean, "mm"), checks.positive("prior sd", sd, "mm")


def form_of(harmonics: Any) -> tuple[Floats, Floats, Floats]:
    """Undulations per revolution, amplitudes (mm) and phases (rad) of a known form (private to this package)."""
    if harmonics is None:
        return np.empty(0), np.empty(0), np.empty(0)
    if isinstance(harmonics, Mapping):
        upr = checks.finite_array("harmonics upr", list(harmonics), "1")
        pairs = checks.finite_array("harmonics", list(harmonics.values()), "mm, rad")
        if upr.size and pairs.shape != (upr.size, 2):
            raise checks.refuse("harmonics", "upr -> (amplitude, phase)", harmonics, "mm, rad")
        amplitude, phase = pairs.reshape(-1, 2).T
        return upr, amplitude, phase
    names = {"upr": "1", "amplitude": "mm", "phase": "rad"}
    if not all(hasattr(harmonics, name) for name in names):
        raise TypeError(f"harmonics must be a spectrum or upr -> (amplitude, phase); got {checks.shown(harmonics)}")
    upr, amplitude, phase = (checks.finite_array(name, getattr(harmonics, name), unit) for name, unit in names.items())
    return upr, amplitude, phase
