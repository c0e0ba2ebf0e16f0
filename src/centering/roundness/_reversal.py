"""Separation of part and spindle by reversal (Donaldson 1972)."""

import numpy as np

from centering.roundness._alignment import best_turn, likeness, tops
from centering.roundness._profile import Profile
from centering.roundness._reading_noise import harmonic_sd
from centering.roundness._separable import amplitudes, highest, refuse_unlike
from centering.roundness._separation import Separation, separation_of
from centering.roundness._setups import Setups, split
from sdpgrind.base.checks import Complex, Floats

_FINE = 15  # chosen: upr; a spindle repeats little above it, so that what two profiles share is the part's
_SHARE = 0.01  # chosen: fine form over the whole form from which it aligns; less may be the model's rounding
_ALIKE = 0.5  # chosen: correlation of the fine forms of one part; noise alone has 0.2
_NEAR = 0.05  # chosen: rad; error of half a turn made by hand at a mark
_SAME = 0.25  # chosen: difference of two eccentricities over the larger; two centrings agree so in 1 of 20
_ECCENTRIC = 0.1  # chosen: eccentricity over the height of the form from which it shows


def reverse(first: Profile, second: Profile) -> Separation:
    """Separate part and spindle by reversal (Donaldson): part half a turn on, probe on the other side.

    The first profile is m1 = p + s, the second m2 = p - s, both over the spindle angle from one mark, so that
    p = (m1 + m2)/2 and s = (m1 - m2)/2, after the eccentricity of each is taken off by the exact model. Where
    the part has form above 15 upr, the second is aligned by it within 3 degrees: the spindle is taken to have
    none there. The noise is that of both profiles. 1 upr is never separated.

    Parameters
    ----------
    first, second : Profile
        Even turns of one number of points, alike in tip and filter.

    Returns
    -------
    Separation
        Part and spindle, mm, at the angle of the first profile.

    Raises
    ------
    ValueError, TypeError
        For profiles that are no even turn of one number of points; for a second profile that shows the part
        at another angle, or with the eccentricity of the first, which changes its sign with the probe's side.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile, reverse
    >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
    >>> part, spindle = 3e-4 * np.cos(3 * angle), 1e-4 * np.cos(2 * angle)
    >>> found = reverse(Profile(angle, 30.0 + part + spindle), Profile(angle, 30.0 + part - spindle))
    >>> found
    Separation(2 setups: part 0.6 µm, spindle 0.2 µm from peak to valley; nothing lost)
    """
    refuse_unlike({"first": first, "second": second})
    _refuse_same_side(first, second)
    upr = np.arange(2.0, highest((first, second)) + 1)
    read = amplitudes((first, second), upr)
    turn = misplacement(read, upr)
    setups = Setups(np.array([0.0, turn]), np.array([1.0, -1.0]))
    noise = np.hypot(*(harmonic_sd(each, upr.size + 2)[2:] for each in (first, second))) / np.sqrt(2)
    how = f"reversal, the second aligned by {np.degrees(turn):.2g} degrees" if turn else "reversal"
    return separation_of((first, second), setups, upr, split(read, setups, upr), noise, how)


def _refuse_same_side(first: Profile, second: Profile) -> None:
    """Refuse one eccentricity in both: the sum has twice as much, where a moved probe takes it off.

    A part that was centred anew has another eccentricity, which says nothing.
    """
    one, other = first.circle.value[1:], second.circle.value[1:]
    larger = max(float(np.hypot(*one)), float(np.hypot(*other)))
    visible = larger > _ECCENTRIC * float(np.ptp(first.deviation))
    if visible and np.hypot(*(one - other)) < _SAME * larger:
        sizes = " and ".join(f"{float(np.hypot(*each)):.4g}" for each in (one, other))
        raise ValueError(
            "second must have less 1 upr in its sum with first: from the other side a part off the axis is"
            f" seen with the opposite sign; got {sizes} mm in one direction: was the probe moved?"
        )


def misplacement(read: Complex, upr: Floats) -> float:
    """Angle by which the fine form of the second profile lies behind that of the first, rad.

    0 where there is too little of it, or waves of one length, which fit at many angles: they may be the
    spindle's. Raises where it fits elsewhere in the turn.
    """
    fine = upr > _FINE
    shared = np.where(fine, read[0] * read[1].conj(), 0.0)
    sizes = np.linalg.norm(read[:, fine], axis=1)
    alike = likeness(shared, upr)
    if sizes.min() < _SHARE * np.linalg.norm(read) or alike.max() < _ALIKE * sizes.prod():
        return 0.0
    if tops(alike) > 1:
        return 0.0
    turn = best_turn(alike, shared, upr)
    if abs(turn) > _NEAR:
        raise ValueError(
            "second must show the part at the spindle angles of first; its form above"
            f" {_FINE} upr fits {abs(np.degrees(turn)):.4g} degrees away: was the probe moved?"
        )
    return turn
