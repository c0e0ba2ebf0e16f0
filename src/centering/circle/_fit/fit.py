"""A circle fitted to a batch of readings: the exact curve, by least squares or robustly."""

from functools import lru_cache
from math import inf, isfinite, pi
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.circle._fit import fit_kernels as at
from centering.circle._fit.angles import smell_of_degrees
from centering.circle._fit.door import radius_and_sd
from centering.circle._fit.estimate import NAMES, CircleEstimate
from centering.circle._fit.fit_noise import Seen, seen_noise, step_noise, travel_of
from centering.circle._fit.form import known_harmonics
from centering.circle._fit.robust_kernels import HUBER, SOFT_L1, fit_robust
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status

CONDITION = 1e8
LOSSES = {"linear": 0, "huber": HUBER, "soft_l1": SOFT_L1}
ROBUST = 6
"""Fewest readings of a robust fit: chosen."""
TRIPLES = 50
"""Of each kind. Three readings are good with probability 0.34 where 30 % are off: all 50 fail once in 1e9."""
ROUNDS = 10
"""Fits in which the part's known form is laid about the centre found."""
WEIGHINGS, ALIKE = 4, 1e-3
"""Fits in which a radius prior is weighed with noise as it shows, and how near the last two noises come."""


def fit_circle(
    angle: npt.ArrayLike,
    reading: npt.ArrayLike,
    *,
    tip_radius: float = 0.0,
    loss: str = "linear",
    radius_prior: tuple[float, float] | None = None,
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
    radius_prior : (mean, sd), optional
        Radius and its standard deviation, mm, both > 0, where they are known.
    noise_sd : float, optional
        Least standard deviation of one reading, mm, > 0: the covariance is never made of less. By default what the fit leaves,
        and that of the probe's steps (step/sqrt(12)) where many readings share few values; a probe whose steps hide the noise
        wholly wants it told.
    harmonics : Spectrum or mapping, optional
        The part's known form, which adds to its radius: an object with arrays upr, amplitude (mm) and phase (rad), or a mapping
        upr -> (amplitude, phase); amplitude cos(upr beta - phase) at the polar angle beta about the part's centre. Whole upr from
        2 on.
    turns : float, optional
        Turns that the readings span at most, unit 1; guards against angles in degrees.
    throw : bool
        Raise when the data do not determine the circle; else the status says so.

    Returns
    -------
    CircleEstimate
        Radius and centre, mm, with the covariance s^2 (J'J)^-1, s inflated where noise is correlated; of a robust fit that of
        Huber, which counts what the weights cost. Its `down_weighted` readings count for less than half. `freedom` is inf where
        the noise is that which was given. One turn hardly tells noise that is correlated by 0.95 and more from reading to
        reading (1 degree apart): of joint bands for 0.99 then 2 to 4 % miss the centre.

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
    mean, sd = (0.0, inf) if radius_prior is None else radius_and_sd(radius_prior, tip)
    enough_angles(turned, 4 - (known > 0) - isfinite(sd))
    kind = LOSSES[checks.one_of("loss", loss, LOSSES)]
    if kind and line.size < ROBUST:
        raise checks.refuse("reading", f"at least {ROBUST} readings for loss {loss!r}", line.size)
    form = form_of(harmonics, float(line.min()) + tip)
    robust = () if kind == 0 else (kind, triples(turned))
    ended, result, seen = _weighed((turned, line + tip), (mean, sd, known), robust, form)
    result[at.RADIUS] -= tip
    circle = _estimate(ended, result, seen, samples=line.size, tip_radius=tip)
    if throw and not circle.ok:
        raise ValueError(circle.message)
    return circle


def _weighed(
    data: tuple[Floats, Floats], known: Any, robust: Any, form: Floats
) -> tuple[int, Floats, tuple[Seen, float]]:
    """How the fit ended, its slots, the noise and the angle covered; a radius prior is weighed with all of the noise."""
    mean, sd, noise_sd = known
    travel, step = travel_of(data[0]), step_noise(data[1])
    told = sd
    for _ in range(1 if sd == inf else WEIGHINGS):
        ended, result, left = _fitted(data, (mean, told, noise_sd, *robust), form)
        shown = float(result[at.SEEN]), float(result[at.NOISE]), float(result[at.FREEDOM])
        seen = seen_noise(travel, data, result[:3], left, shown, noise_sd, step)
        before, told = (
            told,
            sd * float(result[at.UNIT]) / seen.scale if seen.scale > 0 and result[at.UNIT] > 0 else sd,
        )
        if ended != at.FITTED or abs(told - before) <= ALIKE * before:
            break
    return ended, result, (seen, travel.swept)


def _fitted(
    data: tuple[Floats, Floats], options: tuple[Any, ...], form: Floats
) -> tuple[int, Floats, Floats]:
    """How the fit ended, its slots, and residuals; the known form is laid about the centre found until that stays."""
    angle, reading = data
    result, added, left = np.zeros(at.RESULT), np.zeros(angle.size), np.zeros(angle.size + 1)
    fit = at.fit_exact if len(options) == 3 else fit_robust
    ended = fit(angle, reading, added, *options, left, result)
    for _ in range(ROUNDS if len(form) else 0):
        before = result[:3].copy()
        added = formed(angle, reading, before, form)
        ended = fit(angle, reading, added, *options, left, result)
        if ended != at.FITTED or np.abs(result[:3] - before).max() <= 1e-13 * before[0]:
            break
    return ended, result, left[:-1]


def formed(angle: Floats, reading: Floats, circle: Floats, form: Floats) -> Floats:
    """What the part's form adds to its radius where it was read (private to this package)."""
    part_angle = np.arctan2(reading * np.sin(angle) - circle[2], reading * np.cos(angle) - circle[1])
    upr, cosine, sine = form.T
    turned = np.outer(upr, part_angle)
    return np.asarray(cosine @ np.cos(turned) + sine @ np.sin(turned))


def _estimate(ended: int, result: Floats, found: tuple[Seen, float], **told: Any) -> CircleEstimate:
    """The estimate in words and numbers."""
    status, message = _judged(ended, result)
    seen, covered = found
    covariance, freedom = seen.scale**2 * result[at.INVERSE :].reshape(3, 3), seen.freedom
    if status is not Status.OK:
        covariance, freedom = np.diag([inf, inf, inf]), 1.0
    return CircleEstimate(
        result[:3],
        covariance,
        status,
        message,
        freedom=freedom,
        noise_sd=seen.noise_sd,
        inflation=seen.inflation,
        form_bound=seen.form_bound,
        down_weighted=int(result[at.AWAY]),
        swept=covered,
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
        told = (
            f"; the others widen its standard deviation {result[at.CONDITION]:.3g} times"
            if result[at.CONDITION] > 0
            else ""
        )
        name = NAMES[int(result[at.WORST])]
        return (
            Status.UNDETERMINED,
            f"the readings do not tell {name} from the others: turn the part further{told}",
        )
    if ended == at.ENDLESS:
        return Status.UNDETERMINED, "the fit does not settle: turn the part further, or look for bad readings"
    return Status.OK, ""


def readings(
    angle: npt.ArrayLike, reading: npt.ArrayLike, turns: float | None = None
) -> tuple[Floats, Floats]:
    """Return angles (rad) and readings (mm) as arrays of one length, checked (private to this package)."""
    # Copies: compiled code would be compiled anew for arrays that are read-only or strided.
    turned, line = (
        _real(name, given, unit)
        for name, given, unit in (("angle", angle, "rad"), ("reading", reading, "mm"))
    )
    if turned.ndim != 1 or line.shape != turned.shape:
        raise ValueError(
            f"angle and reading must be one-dimensional of one length; got shapes {turned.shape} and {line.shape}"
        )
    if turned.size < 3:
        raise checks.refuse("angle", "at least 3 angles", turned.size)
    span = float(turned.max() - turned.min())
    if turns is not None and span > 2 * pi * checks.positive("turns", turns, "1") * (1 + 1e-9):
        raise ValueError(
            f"angle must span at most {turns:g} turns, {2 * pi * turns:.6g} rad; got {span:.6g}: is it in degrees?"
        )
    smell = "" if turns is not None else smell_of_degrees(turned, line)
    if smell:
        raise ValueError(
            f"angle must be in rad; {smell} smells of degrees: give units.deg(angle), or say how many turns"
        )
    return turned, line


def _real(name: str, given: npt.ArrayLike, unit: str) -> Floats:
    """A new array of finite real numbers."""
    if np.iscomplexobj(given):
        raise TypeError(f"{name} must be real numbers ({unit}); got complex ones")
    return checks.finite_array(name, given, unit).copy()


def enough_angles(angle: Floats, wanted: int) -> None:
    """Refuse fewer different angles than `wanted` (private to this package)."""
    found = at.distinct(angle, wanted)
    if found < wanted:
        raise checks.refuse("angle", f"at least {wanted} different angles, with their readings", found)


def noise_of(noise_sd: float | None) -> float:
    """Checked least noise, mm; 0 where it is not known (private to this package)."""
    return 0.0 if noise_sd is None else checks.positive("noise_sd", noise_sd, "mm")


def form_of(harmonics: Any, least: float) -> Floats:
    """Rows of upr, cosine and sine (mm) of a known form, less than the least reading (private to this package)."""
    form = known_harmonics(harmonics)
    largest = float(np.hypot(form[:, 1], form[:, 2]).max(initial=0.0))
    if largest >= least:
        raise checks.refuse("harmonics amplitude", f"< {least:.6g}, the least reading", largest, "mm")
    return form


def triples(angle: Floats) -> Any:
    """Rows of three readings each: half of them from one third of the sorted directions each, half anywhere; always the same."""
    order = np.argsort(angle % (2 * np.pi), kind="stable")
    return order[_places(angle.size)]


@lru_cache(maxsize=64)
def _places(size: int) -> Any:
    """Places in a sorted list of that size."""
    rng = np.random.default_rng(20060501)
    apart = np.floor((np.arange(3) + rng.random((TRIPLES, 3))) * size / 3).astype(np.int64)
    anywhere = np.array([rng.choice(size, 3, replace=False) for _ in range(TRIPLES)])
    return np.concatenate([apart, anywhere])
