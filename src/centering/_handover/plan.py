"""From a measured profile to the changeover of the grinder."""

import warnings
from math import hypot, isfinite

import numpy as np

from centering._handover.changeover import Changeover
from centering._handover.stock import Stock
from centering._roundness.profile import Profile
from sdpgrind.base import checks


def plan_changeover(
    profile: Profile,
    stock: Stock,
    *,
    finish_radius: float,
    gap: float,
    approach_rate: float,
    combine: str = "linear",
    internal: bool = False,
    eccentricity: float | None = None,
    upr: float = 50.0,
    radius_sd: float | None = None,
    sigmas: float | None = None,
    crash_time: float | None = None,
) -> Changeover:
    """Say where rapid feed may end for a part that was measured, and what that saves against the rule of the population.

    The part's maximum material is its largest radius about the axis that it is ground about (not about its own centre), Mears'
    rapid-feed protection. To the largest sample is added what a form of `upr` undulations may rise to between samples.

    Parameters
    ----------
    profile : Profile
        Of this part; not filtered, as a filter takes peaks off. The runout of the probe's roller should be removed.
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
    internal : bool
        Whether a bore is ground: then all is mirrored, and the smallest radius counts.
    eccentricity : float, optional
        Where the part is centred before it is ground: how far its centre may then lie from the grinder's axis, mm. The largest
        radius is that of the minimum circumscribed circle (of a bore the maximum inscribed one) plus this. By default the part is
        ground as it lies, about the axis of the spindle.
    upr : float
        Highest undulation that the form holds, upr.
    radius_sd : float, optional
        Standard deviation of that radius, mm; by default the noise of the profile, and with `eccentricity` that of the centre as
        well. Give it where the zero of the gauge is not as sure.
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
        When a length is negative or a rate not > 0; when the samples do not bound the form between them, or tell no noise.

    Warns
    -----
    UserWarning
        When the part lies outside the population, has nothing to grind, or the profile is filtered.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import units
    >>> rng, angle = np.random.default_rng(1), np.arange(720) * 2 * np.pi / 360
    >>> reading = 62.05 + 0.004 * np.cos(2 * angle) + 0.002 * np.cos(angle) + 1e-4 * rng.standard_normal(720)
    >>> stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
    >>> plan_changeover(Profile(angle, reading), stock, finish_radius=61.9, gap=0.010, approach_rate=units.mm_per_min(1.56))
    Changeover(rapid feed to 62.0668 mm, 75.17 um beyond the population's 62.1420 mm: 2.89 s of air saved)
    """
    checks.kind("profile", profile, Profile, " (see centering.Profile)")
    centred = None if eccentricity is None else checks.nonnegative("eccentricity", eccentricity, "mm")
    change = Changeover(
        checks.kind("stock", stock, Stock),
        finish_radius=finish_radius, gap=gap, approach_rate=approach_rate, combine=combine, internal=internal,
        largest_radius=_most_material(profile, internal, centred, upr),
        radius_sd=_radius_sd(profile, centred is not None) if radius_sd is None else radius_sd,
        sigmas=sigmas, crash_time=crash_time,
    )  # fmt: skip
    _warn(change, profile, centred)
    return change


def _most_material(profile: Profile, internal: bool, eccentricity: float | None, upr: float) -> float:
    """Largest radius about the axis of grinding, of a bore the smallest, mm."""
    axis = (0.0, 0.0)
    if eccentricity is not None:
        axis = tuple(profile.roundness("MIC" if internal else "MCC").center.tolist())
    largest, more = profile.largest_radius(axis, upr=upr), eccentricity or 0.0
    if not internal:
        return largest + more
    distance = np.hypot(*(profile.points - np.array(axis)).T) - profile.tip_radius
    return float(distance.min() + distance.max()) - largest - more  # as far below the lowest sample as above the highest


def _radius_sd(profile: Profile, centred: bool) -> float:
    """Noise of one reading; where the part is centred by what was measured, the centre's as well. Form is no noise of either."""
    noise = profile.noise_sd
    if not isfinite(noise):
        raise ValueError(
            f"radius_sd must be given (mm) where the profile tells no noise: {profile.angle.size} samples are too few"
        )
    if not centred:
        return noise
    circle = profile.circle
    return hypot(noise, circle.center_sd * min(1.0, noise / circle.noise_sd if circle.noise_sd > 0 else 1.0))


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
        _say(f"{name} of {change.largest_radius:.7g} mm leaves nothing to grind to {change.finish_radius:.7g} mm")


def _say(text: str) -> None:
    warnings.warn(text, UserWarning, stacklevel=4)
