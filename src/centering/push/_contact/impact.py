"""Push speed from the energy balance, Mears (5.18) to (5.25); impacts and small pushes, (3.10) to (3.14)."""

from math import inf, log1p, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from centering._problem.model import GRAVITY, PushModel
from centering._problem.problem import CenteringProblem
from sdpgrind.base import checks

_SMALL = 0.1  # chosen: k_v v/F_k below which the closed form loses digits
_TERMS = 17  # derived: terms after which the series is exact to rounding up to _SMALL


class FreeSlide(NamedTuple):
    """Slide of a part that nothing pushes.

    Attributes
    ----------
    distance, time : float
        Until rest, mm, s.
    """

    distance: float
    time: float


def sliding_speed(model: PushModel, distance: float) -> float:
    """Return the speed from which a part slides a distance to rest, mm/s; Mears (5.19) for k_v = 0.

    Parameters
    ----------
    model : PushModel
        Mass and friction.
    distance : float
        Sliding distance, mm.

    Raises
    ------
    ValueError
        When the distance is < 0.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> dry = model.replace(viscous_coefficient=0.0)
    >>> round(sliding_speed(dry, 0.1), 5), round(sliding_speed(model, 0.1), 5)  # mm/s
    (17.15255, 17.50708)
    """
    checks.kind("model", model, PushModel)
    d = checks.nonnegative("distance", distance, "mm")
    coulomb = sqrt(2.0 * model.mu_kinetic * GRAVITY * d)
    if _viscous(model, coulomb).distance >= d:  # nothing viscous, or less than rounding
        return coulomb
    high = 2.0 * coulomb
    while _viscous(model, high).distance < d:
        high *= 2.0
    return float(
        brentq(lambda v: _viscous(model, v).distance - d, coulomb, high, xtol=1e-14 * high, rtol=1e-15)
    )


def free_slide(model: PushModel, speed: float) -> FreeSlide:
    """Return distance and time of a free slide with Coulomb and viscous friction.

    Distance (M/k_v)[v - (F_k/k_v) ln(1 + k_v v/F_k)], time (M/k_v) ln(1 + k_v v/F_k); for k_v -> 0 these are
    v^2/(2 mu_k g) and v/(mu_k g), Mears (5.18).

    Parameters
    ----------
    model : PushModel
        Mass and friction.
    speed : float
        Initial speed, mm/s.

    Raises
    ------
    ValueError
        When the speed is < 0.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> dry = model.replace(viscous_coefficient=0.0)
    >>> round(free_slide(model, 40.0).distance, 6), round(free_slide(dry, 40.0).distance, 6)  # mm
    (0.496718, 0.543829)
    """
    checks.kind("model", model, PushModel)
    return _viscous(model, checks.nonnegative("speed", speed, "mm/s"))


def energy_balance_speed(problem: CenteringProblem, distance: float, *, slide_mass: float = inf) -> float:
    """Return the slide speed whose impact makes a part slide a distance, mm/s, Mears (5.23) and (5.25).

    As in the source, without viscous friction, and limited to `CenteringLimits.push_speed_max`.

    Parameters
    ----------
    problem : CenteringProblem
        Friction, restitution, greatest speed of a push.
    distance : float
        Wanted sliding distance, mm.
    slide_mass : float
        Mass of the slide, kg; infinite: a driven slide, Mears (5.24).

    Raises
    ------
    ValueError
        When the distance is < 0 or the mass is not > 0.

    Examples
    --------
    >>> from centering import preset
    >>> round(energy_balance_speed(preset("printed"), 0.1) * 60, 2)  # mm/min; the source says 3700
    556.3
    """
    checks.kind("problem", problem, CenteringProblem)
    model, d = problem.model, checks.nonnegative("distance", distance, "mm")
    ratio = 0.0 if slide_mass == inf else model.part.mass / checks.positive("slide_mass", slide_mass, "kg")
    hit = sqrt(2.0 * model.mu_kinetic * GRAVITY * d) * (1.0 + ratio) / (1.0 + model.restitution)
    return min(hit, problem.limits.push_speed_max)


def restitution(*, slide_before: float, slide_after: float, part_after: float) -> float:
    """Return the coefficient of restitution of a slide that hits a resting part, unit 1, Mears (3.12).

    Parameters
    ----------
    slide_before, slide_after, part_after : float
        Speeds before and after the impact, mm/s.

    Raises
    ------
    ValueError
        When the result is not in [0, 1].

    Examples
    --------
    >>> round(restitution(slide_before=139.0, slide_after=104.0, part_after=222.0), 5)
    0.84892
    """
    before = checks.positive("slide_before", slide_before, "mm/s")
    part = checks.number("part_after", part_after, "mm/s")
    apart = part - checks.number("slide_after", slide_after, "mm/s")
    return checks.within("restitution", apart / before, 0.0, 1.0, "1")


def mass_ratio(*, slide_before: float, slide_after: float, part_after: float) -> float:
    """Return the mass of a part over that of the free slide that hit it, unit 1, by momentum, Mears (5.21).

    Parameters
    ----------
    slide_before, slide_after, part_after : float
        Speeds before and after the impact, mm/s.

    Raises
    ------
    ValueError
        When a speed is not finite or the part does not move forward.

    Examples
    --------
    >>> round(mass_ratio(slide_before=139.0, slide_after=104.0, part_after=222.0), 4)
    0.1577
    """
    before = checks.number("slide_before", slide_before, "mm/s")
    lost = before - checks.number("slide_after", slide_after, "mm/s")
    return lost / checks.positive("part_after", part_after, "mm/s")


def contact_stiffness(distance: npt.ArrayLike, force: npt.ArrayLike, *, method: str = "mean") -> float:
    """Return the contact stiffness from small pushes against a fixed stop, N/mm, Mears (3.10).

    Parameters
    ----------
    distance, force : array, (n,)
        Travel of the slide (mm, > 0) and force (N, > 0).
    method : {"mean", "least_squares"}
        Mean of the ratios, as the source, or least-squares line through the origin.

    Raises
    ------
    ValueError
        When lengths differ or a value is not > 0.

    Examples
    --------
    >>> distance, force = [0.010, 0.015, 0.020, 0.025, 0.030, 0.035], [10.7, 16.0, 22.4, 31.0, 37.4, 40.6]
    >>> [round(contact_stiffness(distance, force, method=each), 2) for each in ("mean", "least_squares")]
    [1150.56, 1183.6]
    """
    d, f = checks.finite_array("distance", distance, "mm"), checks.finite_array("force", force, "N")
    if d.shape != f.shape or d.ndim != 1 or d.size == 0:
        raise checks.refuse("distance and force", "of one length >= 1", (d.shape, f.shape))
    for name, values, unit in (("distance", d, "mm"), ("force", f, "N")):
        if np.any(values <= 0):
            raise checks.refuse(name, "> 0", float(values.min()), unit)
    if checks.one_of("method", method, ("mean", "least_squares")) == "mean":
        return float(np.mean(f / d))
    return float(f @ d / (d @ d))


def _viscous(model: PushModel, v: float) -> FreeSlide:
    """With u = k_v v/F_k: distance M v^2/F_k (u - ln(1 + u))/u^2, time M v/F_k ln(1 + u)/u."""
    scale = model.inertia * v / model.coulomb_force
    u = model.viscous_coefficient * v / model.coulomb_force
    return FreeSlide(scale * v * _above_log(u), scale * (log1p(u) / u if u else 1.0))


def _above_log(u: float) -> float:
    """(u - ln(1 + u))/u^2, for small u by its series, as digits would be lost."""
    if u > _SMALL:
        return (u - log1p(u)) / (u * u)
    return sum((-u) ** n / (n + 2) for n in range(_TERMS))
