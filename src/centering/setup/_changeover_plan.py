"""From a measured profile to the changeover of the grinder."""

import warnings
from math import hypot, inf, isfinite

from centering.roundness._profile import Profile
from centering.setup._changeover import Changeover
from centering.setup._material import Material, most_material
from centering.setup._stock import MICROMETRES, Stock
from sdpgrind.base import checks

_FAR = 10.0  # mm: no part that was centred lies as far off


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
    """Say where rapid feed may end for a part that was measured, and what that saves against the rule of the population.

    The part's maximum material is its largest radius about the axis that it is ground about (not about its own centre), Mears'
    rapid-feed protection. It is that of the form, fitted by harmonics over all turns, between samples too. A single sample that
    stands out of the form (a burr, dust) by more than noise makes one in a thousand profiles, and reaches farther, counts as it
    was read, with what may lie between samples.

    What noise does to the form at its highest place is the standard deviation of the radius. Noise that makes another place the
    highest only adds, so that the part reaches beyond what was allowed for at most as often as its `contact_probability` says:
    just as often where one place is highest by far (a part off its axis), clearly less often where many are alike.

    Parameters
    ----------
    profile : Profile
        Of this part, or of a bore (``internal=True``: all is mirrored then, and the smallest radius counts); not filtered, as a
        filter takes peaks off. The runout of the probe's roller should be removed.
    stock : Stock
        The population of parts, mm.
    finish_radius : float
        Of the finished part, mm.
    gap : float
        Kept for what is not counted here, mm: heat, wear of the wheel, the servo.
    approach_rate : float
        Controlled feed in air, mm/s; with a sensor that ends the air (gap elimination) its rate until contact.
    combine : {"linear", "rss"}
        How the population's two scatters are put together, see `Stock.allowance`.
    eccentricity : float, optional
        Where the part is centred before it is ground: how far its centre may then lie from the grinder's axis, mm. The largest
        radius is that of the minimum circumscribed circle (of a bore the maximum inscribed one) plus this. By default the part is
        ground as it lies, about the axis of the spindle.
    upr : float
        Highest undulation that the form holds, upr; it holds more where more are seen.
    radius_sd : float, optional
        Standard deviation of that radius, mm; by default that of the form at its highest place, at least that of rounding to the
        smallest step of the readings, and with `eccentricity` that of the centre as well. Give it where the zero of the gauge is
        not as sure.
    sigmas : float, optional
        Standard deviations of the radius that are allowed for, unit 1; 3 by default.
    crash_time : float, optional
        What a crash costs, s: `sigmas` are then those of least cost, see `best_allowance`.

    Returns
    -------
    Changeover
        Positions in mm, time saved in s, probabilities.

    Raises
    ------
    ValueError
        When a length is negative or smells of micrometres, or a rate is not > 0; when the samples do not bound the form between
        them, or tell no noise.

    Warns
    -----
    UserWarning
        When the part lies outside the population, has nothing to grind, or the profile is filtered.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import units
    >>> rng, angle = np.random.default_rng(2), np.arange(720) * 2 * np.pi / 360
    >>> reading = 62.05 + 0.004 * np.cos(2 * angle) + 0.002 * np.cos(angle) + 1e-4 * rng.standard_normal(720)
    >>> stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
    >>> plan_changeover(Profile(angle, reading), stock, finish_radius=61.9, gap=0.010, approach_rate=units.mm_per_min(1.56))
    Changeover(rapid feed to 62.0661 mm, 75.88 µm beyond the population's 62.1420 mm: 2.92 s of air saved)
    """
    checks.kind("profile", profile, Profile, " (see centering.Profile)")
    centred = None if eccentricity is None else _eccentricity(eccentricity)
    found = _found(profile, centred, checks.nonnegative("upr", upr, "upr"))
    radius_sd = _radius_sd(profile, found.sd, centred is not None) if radius_sd is None else radius_sd
    change = Changeover(
        checks.kind("stock", stock, Stock),
        finish_radius=finish_radius, gap=gap, approach_rate=approach_rate, combine=combine, internal=profile.internal,
        largest_radius=found.radius, radius_sd=radius_sd, sigmas=sigmas, crash_time=crash_time,
    )  # fmt: skip
    _warn(change, profile, centred)
    return change


def _found(profile: Profile, eccentricity: float | None, upr: float) -> Material:
    """The most material about the axis of grinding."""
    if eccentricity is None:
        return most_material(profile, (0.0, 0.0), upr)
    x, y = profile.roundness("MIC" if profile.internal else "MCC").center.tolist()
    found = most_material(profile, (x, y), upr)
    return found._replace(radius=found.radius + (-eccentricity if profile.internal else eccentricity))


def _radius_sd(profile: Profile, sd: float, centred: bool) -> float:
    """As found; where the part is centred by what was measured, with the centre's. Form is no noise of either."""
    noise = profile.noise_sd
    if not isfinite(noise):
        raise ValueError(
            f"radius_sd must be given (mm) where the profile tells no noise: {profile.angle.size} samples are too few"
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
        _say(f"profile should not be filtered, as that takes peaks off: it is {profile._origin.filter}")
    name = "smallest_radius" if change.internal else "largest_radius"
    if change.outside_population:
        off = profile.circle.offset
        advice = f", or not centred: it lies {off:.4g} mm off the spindle, eccentricity tells how near it will be when ground"
        _say(
            f"{name} of {change.largest_radius:.7g} mm lies beyond the changeover of the population at"
            f" {change.population_position:.7g} mm: the part is outside the population{advice if eccentricity is None else ''}"
        )
    if (change.largest_radius - change.finish_radius) * (-1 if change.internal else 1) <= 0:
        _say(
            f"{name} of {change.largest_radius:.7g} mm leaves nothing to grind to {change.finish_radius:.7g} mm"
        )


def _say(text: str) -> None:
    warnings.warn(text, UserWarning, stacklevel=4)


def _eccentricity(value: object) -> float:
    """A checked eccentricity, mm."""
    length = checks.nonnegative("eccentricity", value, "mm")
    if length >= _FAR:
        raise checks.refuse("eccentricity", f"< {_FAR:g}{MICROMETRES}", length, "mm")
    return length
