"""Changeover of the grinder from a measured profile."""

import warnings
from math import hypot, inf, isfinite

from centering.roundness._profile import Profile
from centering.setup._changeover import Changeover
from centering.setup._material import Material, most_material
from centering.setup._stock import MICROMETRES, Stock
from sdpgrind.base import checks

_FAR = 10.0  # chosen: eccentricity of no centred part, mm; larger values are probably in micrometres


def plan_changeover(
    profile: Profile,
    stock: Stock,
    *,
    finish_radius: float,
    gap: float,
    approach_rate: float,
    combine: str = "linear",
    eccentricity: float | None = None,
    upr: float = 50.0,
    radius_sd: float | None = None,
    sigmas: float | None = None,
    crash_time: float | None = None,
) -> Changeover:
    """Plan the end of rapid feed for a measured part, and the time saved against the rule of the population.

    The maximum material is the largest radius about the axis of grinding (not the part's own centre), Mears'
    rapid-feed protection: that of the form, fitted by harmonics over all turns, between samples too. A single
    sample beyond the form (a burr, dust) by more than noise in 999 of 1000 profiles, and larger than the
    form's maximum, counts as read, plus the rise possible between samples.

    `radius_sd` is the standard deviation of the form at its highest place; see
    `Changeover.contact_probability` for its bound.

    Parameters
    ----------
    profile : Profile
        Profile of this part or, with ``internal=True``, bore; unfiltered, as filters take peaks off, and with
        the runout of the probe's roller removed.
    stock : Stock
        Population of parts, mm.
    finish_radius, gap, approach_rate, combine, crash_time
        See `Changeover`; mm, mm/s, s.
    eccentricity : float, optional
        Greatest distance from the grinder's axis of the centre of a part that is centred before grinding, mm.
        The largest radius is then that of the minimum circumscribed circle (of a bore the maximum inscribed
        one) plus this. Default: the part is ground about the axis of the spindle.
    upr : float
        Highest undulation of the form, upr; higher ones that exceed the noise are added.
    radius_sd : float, optional
        Standard deviation of the largest radius, mm. Default: that of the form at its highest place, at least
        that of rounding to the smallest step of the readings, with `eccentricity` also that of the centre.
        Give it where the zero of the gauge is less certain.
    sigmas : float, optional
        Allowance in multiples of `radius_sd`, unit 1. Default: 3.

    Returns
    -------
    Changeover
        Positions in mm, time saved in s, probabilities.

    Raises
    ------
    ValueError
        If a length is negative or probably in micrometres, a rate is not > 0, the samples do not bound the
        form between them, or contain no noise.

    Warns
    -----
    UserWarning
        If the part lies outside the population, has nothing to grind, or the profile is filtered.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import units
    >>> rng, angle = np.random.default_rng(2), np.arange(720) * 2 * np.pi / 360
    >>> reading = 62.05 + 0.004 * np.cos(2 * angle) + 0.002 * np.cos(angle) + 1e-4 * rng.standard_normal(720)
    >>> stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
    >>> machine = {"finish_radius": 61.9, "gap": 0.010, "approach_rate": units.mm_per_min(1.56)}
    >>> plan_changeover(Profile(angle, reading), stock, **machine)
    Changeover(rapid feed to 62.0661 mm, 75.88 µm beyond the population's 62.1420 mm: 2.92 s of air saved)
    """
    checks.kind("profile", profile, Profile, " (see centering.Profile)")
    profile._need_radius("profile")
    centred = None if eccentricity is None else _eccentricity(eccentricity)
    found = _found(profile, centred, checks.nonnegative("upr", upr, "upr"))
    radius_sd = _radius_sd(profile, found.sd, centred is not None) if radius_sd is None else radius_sd
    change = Changeover(
        checks.kind("stock", stock, Stock),
        finish_radius=finish_radius, gap=gap, approach_rate=approach_rate, combine=combine,
        internal=profile.internal, largest_radius=found.radius, radius_sd=radius_sd, sigmas=sigmas,
        crash_time=crash_time,
    )  # fmt: skip
    _warn(change, profile, centred)
    return change


def _found(profile: Profile, eccentricity: float | None, upr: float) -> Material:
    """Most material about the axis of grinding."""
    if eccentricity is None:
        return most_material(profile, (0.0, 0.0), upr)
    x, y = profile.roundness("MIC" if profile.internal else "MCC").center.tolist()
    found = most_material(profile, (x, y), upr)
    return found._replace(radius=found.radius + (-eccentricity if profile.internal else eccentricity))


def _radius_sd(profile: Profile, sd: float, centred: bool) -> float:
    """Standard deviation of the radius, with that of the centre where the part is centred by this profile."""
    noise = profile.noise_sd
    if not isfinite(noise):
        raise ValueError(
            "radius_sd must be given (mm) where the profile tells no noise:"
            f" {profile.angle.size} samples are too few"
        )
    if sd == inf:
        raise ValueError(
            "radius_sd must be given (mm) where readings are all alike: they tell neither noise nor rounding"
        )
    if not centred:
        return sd
    circle = profile.circle
    return hypot(sd, circle.center_sd * min(1.0, noise / circle.noise_sd if circle.noise_sd > 0 else 1.0))


def _warn(change: Changeover, profile: Profile, eccentricity: float | None) -> None:
    if profile._origin.filter:
        _warning(f"profile should not be filtered, as that takes peaks off: it is {profile._origin.filter}")
    name = "smallest_radius" if change.internal else "largest_radius"
    if change.outside_population:
        off = profile.circle.offset
        advice = (
            f", or not centred: it lies {off:.4g} mm off the spindle,"
            " eccentricity tells how near it will be when ground"
        )
        _warning(
            f"{name} of {change.largest_radius:.7g} mm lies beyond the changeover of the population at"
            f" {change.population_position:.7g} mm: the part is outside the population"
            f"{advice if eccentricity is None else ''}"
        )
    if (change.largest_radius - change.finish_radius) * (-1 if change.internal else 1) <= 0:
        _warning(
            f"{name} of {change.largest_radius:.7g} mm leaves nothing to grind to"
            f" {change.finish_radius:.7g} mm"
        )


def _warning(text: str) -> None:
    warnings.warn(text, UserWarning, stacklevel=4)


def _eccentricity(value: object) -> float:
    """Checked eccentricity, mm."""
    length = checks.nonnegative("eccentricity", value, "mm")
    if length >= _FAR:
        raise checks.refuse("eccentricity", f"< {_FAR:g}{MICROMETRES}", length, "mm")
    return length
