"""A circle fitted to a batch of readings: the exact curve, by least squares or robustly."""

from functools import lru_cache
from math import inf, isfinite
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.circle._fit import fit_kernels as at
from centering.circle._fit.arguments import enough_angles, form_of, noise_of, radius_and_sd, readings
from centering.circle._fit.estimate import NAMES, CircleEstimate
from centering.circle._fit.fit_noise import Seen, seen_noise, step_noise, travel_of
from centering.circle._fit.robust_kernels import HUBER, SOFT_L1, fit_robust
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status

CONDITION = 1e8  # chosen: widening of an sd by the other quantities, about 1/sqrt(rounding unit)
LOSSES = {"linear": 0, "huber": HUBER, "soft_l1": SOFT_L1}
ROBUST = 6  # chosen: fewest readings of a robust fit
TRIPLES = 50  # derived: of each kind; with 30 % outliers all 50 triples are bad once in 1e9
ROUNDS = 10  # chosen: fits, at most, that update the place of a known form
WEIGHINGS, ALIKE = 4, 1e-3
"""Fits, at most, that update the noise in the weight of a radius prior, and relative change that ends them;
chosen: more fits only cost time, the change is far below the uncertainty of the noise."""


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

    A linear form of the curve, exact without noise, gives the start; Gauss-Newton steps lead to the
    maximum-likelihood estimate for independent noise. Angles may repeat, lie in any order, leave gaps, and
    span several turns.

    Parameters
    ----------
    angle, reading : array_like, shape (m,)
        Spindle angle, rad, and radial position of the probe's contact, mm, > 0.
    tip_radius : float
        Radius of the probe's tip, mm, >= 0.
    loss : {"linear", "huber", "soft_l1"}
        "linear": squares; the others grow linearly beyond 1.345 scales, for up to 30 % of outliers. Their
        start is that of 100 circles through three readings (always the same) with the least median residual;
        readings beyond 6 scales, from the median absolute residual, are left out.
    radius_prior : (mean, sd), optional
        Known radius and its standard deviation, mm, both > 0.
    noise_sd : float, optional
        Least standard deviation of one reading assumed in the covariance, mm, > 0. Default: that of the
        residuals or, where many readings share few values, of the probe's steps (step/sqrt(12)). Give it
        where the steps hide the noise completely.
    harmonics : Harmonics or mapping, optional
        Known form added to the radius: an object with arrays upr, amplitude (mm) and phase (rad), or a
        mapping upr -> (amplitude, phase); amplitude cos(upr beta - phase) at the polar angle beta about the
        part's centre. Whole upr >= 2.
    turns : float, optional
        Greatest number of turns of the readings, unit 1; guards against angles in degrees.
    throw : bool
        Raise when the data do not determine the circle; else the status says so.

    Returns
    -------
    CircleEstimate
        Radius and centre, mm, with the covariance s^2 (J'J)^-1, s inflated for correlated noise; of a robust
        fit Huber's covariance. `freedom` is inf where the given noise applies. One turn hardly shows noise
        correlated by 0.95 or more between successive readings (1 degree apart): joint bands for 0.99 then
        miss the centre in 2 to 4 %.

    Raises
    ------
    ValueError, TypeError
        For unequal lengths, values that are not finite, readings <= 0, too few different angles (3, or 4 with
        unknown noise; one less with a prior), angles that suggest degrees; with `throw` when the axis lies
        outside of the circle, or the data do not determine it.

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
    """Outcome, slots, noise and covered angle of a fit; noise and weight of the prior are iterated."""
    mean, sd, noise_sd = known
    travel, step = travel_of(data[0]), step_noise(data[1])
    weighing_sd = sd
    for _ in range(1 if sd == inf else WEIGHINGS):
        ended, result, left = _fitted(data, (mean, weighing_sd, noise_sd, *robust), form)
        shown = float(result[at.SEEN]), float(result[at.NOISE]), float(result[at.FREEDOM])
        seen = seen_noise(travel, data, result[:3], left, shown, noise_sd, step)
        unit, before = float(result[at.UNIT]), weighing_sd
        weighing_sd = sd * unit / seen.scale if seen.scale > 0 and unit > 0 else sd
        if ended != at.FITTED or abs(weighing_sd - before) <= ALIKE * before:
            break
    return ended, result, (seen, travel.swept)


def _fitted(
    data: tuple[Floats, Floats], options: tuple[Any, ...], form: Floats
) -> tuple[int, Floats, Floats]:
    """Outcome, slots and residuals of a fit; centre and place of a known form are iterated."""
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
    """Contribution of the known form to the radius at each reading, mm."""
    part_angle = np.arctan2(reading * np.sin(angle) - circle[2], reading * np.cos(angle) - circle[1])
    upr, cosine, sine = form.T
    turned = np.outer(upr, part_angle)
    return np.asarray(cosine @ np.cos(turned) + sine @ np.sin(turned))


def _estimate(ended: int, result: Floats, found: tuple[Seen, float], **fields: Any) -> CircleEstimate:
    """Estimate from the slots of a fit."""
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
        **fields,
    )


def _judged(ended: int, result: Floats) -> tuple[Status, str]:
    """Status, and the sentence of a fit that is not OK."""
    offset = float(np.hypot(result[at.X], result[at.Y]))
    if ended == at.OUTSIDE or (ended == at.FITTED and offset >= result[at.RADIUS]):
        return Status.IMPOSSIBLE, (
            "offset must be < radius (mm), as the spindle's axis lies in the part;"
            f" the readings lead to {offset:.6g} and {result[at.RADIUS]:.6g}:"
            " turn the part further, or look for bad readings or a wrong unit"
        )
    if ended == at.SINGULAR or result[at.CONDITION] > CONDITION:
        widened = (
            f"; the others widen its standard deviation {result[at.CONDITION]:.3g} times"
            if result[at.CONDITION] > 0
            else ""
        )
        name = NAMES[int(result[at.WORST])]
        return (
            Status.UNDETERMINED,
            f"the readings do not tell {name} from the others: turn the part further{widened}",
        )
    if ended == at.ENDLESS:
        return Status.UNDETERMINED, "the fit does not settle: turn the part further, or look for bad readings"
    return Status.OK, ""


def triples(angle: Floats) -> Any:
    """Rows of three places each, always the same: half from three thirds of the directions, half anywhere."""
    order = np.argsort(angle % (2 * np.pi), kind="stable")
    return order[_places(angle.size)]


@lru_cache(maxsize=64)
def _places(size: int) -> Any:
    """Rows of three places in a sorted list of `size` entries."""
    rng = np.random.default_rng(20060501)
    apart = np.floor((np.arange(3) + rng.random((TRIPLES, 3))) * size / 3).astype(np.int64)
    anywhere = np.array([rng.choice(size, 3, replace=False) for _ in range(TRIPLES)])
    return np.concatenate([apart, anywhere])
