"""Comparison of a part before and after grinding: rotation, harmonics, chance that RONt fell."""

from math import pi
from typing import Protocol

import numpy as np
from scipy.special import ndtr, ndtri

from centering.roundness._alignment import best_turn, likeness, tops
from centering.roundness._form_change import FormChange
from centering.roundness._harmonics import Harmonics
from centering.roundness._origin import Origin
from centering.roundness._roundness import Roundness
from centering.roundness._roundness_interval import RoundnessInterval
from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.warned import warn

_FADED = 1e-3  # chosen: amplitude over the largest before; the table ends at the last harmonic above it
_ALIKE = 0.5  # chosen: correlation below which two forms hardly tell a rotation
_PLACES = 4000  # derived: quantiles of RONt; the chance is then right to 1e-6


class Filtered(Protocol):
    """A filtered profile."""

    @property
    def internal(self) -> bool: ...
    @property
    def _origin(self) -> Origin: ...
    def harmonics(self) -> Harmonics: ...
    def roundness(self) -> Roundness: ...


def compared(before: Filtered, after: Filtered, rotation: float | None) -> FormChange:
    """Compare two filtered profiles of one part."""
    if before.internal != after.internal:
        raise checks.refuse("before", f"of one side, internal={after.internal}", before.internal)
    first, second = _common(before.harmonics(), after.harmonics())
    turn, alike = _rotation(first, second, rotation)
    circles = before.roundness(), after.roundness()
    earlier, later = (None if each.why_no_interval else each.interval() for each in circles)
    return FormChange(
        first,
        second.replace(phase=second.phase - second.upr * turn),
        turn,
        alike,
        circles[0].ron_t,
        circles[1].ron_t,
        earlier,
        later,
        None if earlier is None or later is None else chance_below(later, earlier),
        before._origin.filter,
        circles[0].origin,
        circles[1].origin,
    )


def _common(before: Harmonics, after: Harmonics) -> tuple[Harmonics, Harmonics]:
    """Harmonics from 2 upr on that both have, up to the last one that counts."""
    most = int(min(before.upr[-1], after.upr[-1]))
    size = np.maximum(before.amplitude[:most], after.amplitude[:most])
    counted = np.flatnonzero(size > _FADED * before.amplitude.max())
    kept = slice(1, max(int(counted.max(initial=1)) + 1, 2))
    first, second = (
        each.replace(**{name: getattr(each, name)[kept] for name in ("upr", "amplitude", "phase", "sd")})
        for each in (before, after)
    )
    return first, second


def _rotation(before: Harmonics, after: Harmonics, given: float | None) -> tuple[float, float]:
    """Rotation of the part on the spindle between both (rad), and the correlation of the forms there."""
    first, second = _complex(before), _complex(after)
    shared, sizes = first * second.conj(), float(np.linalg.norm(first) * np.linalg.norm(second))
    if given is None and sizes > 0:
        alike = likeness(shared, before.upr)
        turn = best_turn(alike, shared, before.upr)
        _warn_of_doubt(tops(alike), float(alike.max()) / sizes)
    else:
        turn = 0.0 if given is None else checks.number("rotation", given, "rad")
        if abs(turn) > 2 * pi:
            raise checks.refuse("rotation", "within a turn; units.deg(...) for degrees", turn, "rad")
    found = float(np.sum(shared * np.exp(-1j * before.upr * turn)).real)
    if given is not None and found < 0:
        told = f"their correlation is {found / sizes:.2g}"
        warn(f"the forms contradict each other, turned by {turn:.4g} rad: {told}")
    return turn, found / sizes if sizes > 0 else 0.0


def _complex(harmonics: Harmonics) -> Complex:
    return np.asarray(harmonics.amplitude * np.exp(-1j * harmonics.phase))


def _warn_of_doubt(count: int, alike: float) -> None:
    """Warn where forms do not tell the rotation."""
    if count > 1 or alike < _ALIKE:
        why = f"{count} rotations fit alike" if count > 1 else f"the best correlation is {alike:.2g}"
        warn(
            f"the forms hardly tell how the part was turned between the measurements: {why}; rotation= of an"
            " indexed part makes the removed form sure"
        )


def chance_below(one: RoundnessInterval, other: RoundnessInterval) -> float:
    """Chance that the first RONt is the lower one, each normal on both sides of its value."""
    places = (np.arange(_PLACES) + 0.5) / _PLACES
    scores = ndtri(places)
    heights = one.value + scores * np.where(scores < 0, *_sides(one))
    return float(np.mean(_above(heights, other)))


def _sides(ends: RoundnessInterval) -> tuple[float, float]:
    """Standard deviations below and above the value, mm."""
    sd = float(ndtri(0.5 * (1 + ends.confidence)))
    return (ends.value - ends.low) / sd, (ends.high - ends.value) / sd


def _above(heights: Floats, ends: RoundnessInterval) -> Floats:
    """Chance that a RONt is above each of some heights (mm); a half where it is known to be that high."""
    below, above = _sides(ends)
    with np.errstate(divide="ignore", invalid="ignore"):
        score = (ends.value - heights) / np.where(heights < ends.value, below, above)
    return np.asarray(np.where(np.isnan(score), 0.5, ndtr(score)))
