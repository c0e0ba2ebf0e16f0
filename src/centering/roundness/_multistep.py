"""Separation of part and spindle by readings of the part at several turns (multistep)."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from centering.roundness._profile import Profile
from centering.roundness._separable import amplitudes, highest, passed_noise, refuse_unlike
from centering.roundness._separation import Separation, separation_of
from centering.roundness._setups import Setups, Split, split
from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.units import UM
from sdpgrind.base.warned import warn

_LEAST = 3  # derived: steps that leave residuals, from which the noise is known
_SAME = 1e-6  # chosen: rad; steps nearer than an index plate is true are one
_APART = 10.0  # chosen: residuals of a harmonic over those of most; of 7 steps noise alone gives up to 4
_STILL = 1e-3  # chosen: residuals over the greatest amplitude that do not matter
_HELD = 0.1  # chosen: share of the noise in a harmonic below which a filter has taken it
_AGAINST = 0.5  # chosen: residuals over those of steps against the turn; noise alone leaves equal ones


def multistep(profiles: Sequence[Profile], angles: npt.ArrayLike) -> Separation:
    """Separate part and spindle by readings of the part, turned against the spindle from step to step.

    At step k the profile is p(theta - a_k) + s(theta), after the part's eccentricity is taken off by the
    exact model. Each harmonic is solved by least squares; one that the steps do not tell apart (singular
    value below 0.3) is left out of both, listed as `lost`, and its amplitude is in the standard deviations.
    The noise is that of the residuals, taken as white. 1 upr is never separated.

    Parameters
    ----------
    profiles : sequence of Profile
        At least 3 profiles of one part: even turns of one number of points, alike in tip and filter.
    angles : array_like, shape (m,)
        Turn of the part on the spindle at each step, in the sense in which the profile's angle counts, rad;
        see `step_angles`.

    Returns
    -------
    Separation
        Part and spindle, mm, the part at turn 0.

    Raises
    ------
    ValueError, TypeError
        For fewer than 3 steps, repeated angles or more than one turn of them, profiles that are no even turn
        of one number of points; for angles that count against the turn.

    Warns
    -----
    UserWarning
        Where the steps do not agree; `Separation.disagreement` and the pages of the part keep the sentence.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile, multistep
    >>> angle, steps = np.linspace(0.0, 2 * np.pi, 360, endpoint=False), np.arange(4) * np.pi / 2
    >>> read = [30.0 + 3e-4 * np.cos(3 * (angle - step)) + 1e-4 * np.cos(5 * angle) for step in steps]
    >>> found = multistep([Profile(angle, each) for each in read], steps)
    >>> found.lost[:3].tolist(), round(found.spindle.range, 6), round(found.part.roundness().ron_t, 6)
    ([4, 8, 12], 0.0002, 0.0006)
    """
    turns = _turns(profiles, angles)
    refuse_unlike({f"profiles[{k}]": each for k, each in enumerate(profiles)})
    upr = np.arange(2.0, highest(profiles) + 1)
    setups = Setups(turns, np.ones(turns.size))
    read, passed = amplitudes(profiles, upr), passed_noise(profiles, upr)
    found = split(read, setups, upr)
    _refuse_against(read, found, setups, upr)
    told = _disagreement(read, found, passed, upr)
    if told:
        warn(told)
    noise = found.noise(passed)
    return separation_of(profiles, setups, upr, found, noise, f"{turns.size} steps", told)


def _turns(profiles: Sequence[Profile], angles: npt.ArrayLike) -> Floats:
    """Angles of the steps, checked against the number of profiles."""
    if (count := len(profiles)) < _LEAST:
        raise ValueError(f"profiles must be at least {_LEAST}, one for each step; got {count}")
    turns = checks.finite_array("angles", angles, "rad")
    if turns.shape != (count,):
        raise ValueError(f"angles must be one for each of {count} profiles (rad); got shape {turns.shape}")
    if np.ptp(turns) > 2 * np.pi:
        hint = "within one turn; units.deg(...) for degrees"
        raise checks.refuse("angles", f"in rad, {hint}", float(np.ptp(turns)))
    places = np.sort(np.mod(turns, 2 * np.pi))
    if np.diff(places, append=places[0] + 2 * np.pi).min() < _SAME:
        raise checks.refuse("angles", "different from each other in the turn", turns.tolist(), "rad")
    return turns


def _refuse_against(read: Complex, found: Split, setups: Setups, upr: Floats) -> None:
    """Refuse steps whose residuals fall by half or more if the part was turned the other way."""
    other = split(read, Setups(-setups.turns, setups.senses), upr)
    mine, its = (float(np.linalg.norm(each.left)) for each in (found, other))
    if its < _AGAINST * mine:
        raise ValueError(
            "angles must count in the sense of the profile's angle (rad): with the opposite sign the"
            f" residuals fall from {mine:.3g} to {its:.3g} mm; got {checks.shown(setups.turns.tolist())}"
        )


def _disagreement(read: Complex, found: Split, passed: Floats, upr: Floats) -> str:
    """Sentence where one harmonic leaves far more than the noise that most of them show; else empty."""
    known = np.flatnonzero(passed > _HELD * passed.max())
    if not known.size:  # behind a robust filter the noise is not known
        return ""
    left = np.sqrt(np.mean(np.abs(found.left[:, known]) ** 2, axis=0)) / passed[known]
    usual = max(float(np.median(left)), _STILL * float(np.abs(read).max()))
    worst = int(np.argmax(left))
    if left[worst] <= _APART * usual:
        return ""
    return (
        f"the steps do not agree: at {upr[known[worst]]:g} upr they leave {UM * left[worst]:.2g} µm,"
        f" {left[worst] / usual:.2g} times what is usual: angles or files exchanged, a part that moved on"
        " the table, or a spindle that does not repeat"
    )
