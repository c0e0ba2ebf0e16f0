"""Profiles of one part in several setups: checks, and their harmonics about the part's centre."""

from collections.abc import Sequence

import numpy as np

from centering.roundness._form import form_of
from centering.roundness._harmonic_fit import even_harmonics
from centering.roundness._profile import Profile
from centering.roundness._sampling import is_even
from sdpgrind.base import checks
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Complex, Floats


def refuse_unlike(named: dict[str, Profile]) -> None:
    """Refuse profiles that are no even turns of one number of points, or of different tips or filters."""
    (first_name, first), *_ = named.items()
    for name, profile in named.items():
        size = checks.kind(name, profile, Profile).angle.size
        even = is_even(profile.part_angle) or is_even(profile.angle - profile.angle[0])
        if not even or size != first.angle.size:
            got = f"{size} points on {counted(profile.turns, 'turn')}{'' if even else ', not evenly'}"
            like = f", as many points as {first_name} ({first.angle.size})" if profile is not first else ""
            raise ValueError(f"{name} must be one even turn{like}: filter or resample first; got {got}")
        for word, mine, its in _settings(profile, first):
            if mine != its:
                raise ValueError(f"{name} must have the {word} of {first_name}, {its!r}; got {mine!r}")


def _settings(profile: Profile, first: Profile) -> list[tuple[str, object, object]]:
    """What profiles of one part share, by name: of a profile, and of the first."""
    return [
        ("tip radius (mm)", profile.tip_radius, first.tip_radius),
        ("side (internal)", profile.internal, first.internal),
        ("filter", profile._origin.filter, first._origin.filter),
    ]


def highest(profiles: Sequence[Profile]) -> int:
    """Highest harmonic of all profiles: below half of the points, or what a filter has left."""
    known = [len(each._origin.sd) - 1 for each in profiles if each._origin.sd]
    return min([(profiles[0].angle.size - 1) // 2, *known])


def amplitudes(profiles: Sequence[Profile], upr: Floats) -> Complex:
    """Complex amplitudes of all profiles about the part's centre, mm, (M, n).

    The spindle's error goes with the spindle angle, here with the part angle: they differ by up to offset
    over radius, which moves harmonic n of the spindle by n times that of its amplitude.
    """
    return np.array([2 * _harmonics(each, int(upr[-1]))[2:] for each in profiles])


def _harmonics(profile: Profile, degree: int) -> Complex:
    """Coefficients from 0 to degree."""
    if is_even(profile.part_angle):
        return even_harmonics(profile.deviation)[: degree + 1]
    return form_of(profile._samples, degree, "profiles").coef


def passed_noise(profiles: Sequence[Profile], upr: Floats) -> Floats:
    """Share of the readings' noise that is left in each harmonic: 1 unless filtered; infinite if unknown."""
    shares = [_share(each, int(upr[-1])) for each in profiles]
    return np.asarray(np.sqrt(np.mean(np.square(shares), axis=0)))


def _share(profile: Profile, degree: int) -> Floats:
    sd = np.array(profile._origin.sd[2 : degree + 1] or np.ones(degree - 1))
    if not np.all(np.isfinite(sd)):
        return np.full_like(sd, np.inf)  # of a robust filter
    return np.asarray(sd / sd.max() if sd.max() > 0 else np.ones_like(sd))
