"""Whether angles go round a ring, and whether the readings of one turn are like those of the next."""

from typing import Any

import numpy as np
import numpy.typing as npt

from centering.circle._fit.identify import unlike_turns
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.angles import angle_headings
from sdpgrind.base.columns.read import opened
from sdpgrind.base.columns.taken import Rules
from sdpgrind.base.warned import warn

_TURN = 2 * np.pi
_WHOLE = 0.75  # chosen: share of the turn below which a ring was not gone round, or the angle is another one
_OVERLAP = 0.25  # chosen: share of a turn that is there twice from which on the two are compared
_LIKE = 0.5  # chosen: correlation of two turns of one ring; noise alone has less, too
_SMOOTH = 0.5  # chosen: correlation of neighbours; the difference of two turns of one ring is noise
_FAR = 36  # chosen: so many of a turn; noise that resembles its neighbours is another one there


def refuse_unnamed_angle(data: Any, rules: Rules) -> None:
    """Refuse a file with a column of angles that was not named: its rows need not be one even turn."""
    for where, each in angle_headings(data, rules):
        raise ValueError(
            "angle must be named, and either reading or deviation, where a file has a column of"
            f' angles: angle="{each.name}"; {where} has {each.header!r}'
        )


def warn_of_sections(data: Any, rules: Rules, angle: Floats) -> None:
    """Warn where a column keeps one word while the angle (rad) goes round, then another for the next turn."""
    known = np.isfinite(angle)
    gone = np.unwrap(angle[known])
    if gone.size < 2 or np.ptp(gone) < _TURN:
        return
    for sheet in opened(data, rules)[1]:
        for place, each in enumerate(sheet.headings):
            words = sheet.words(place)
            if words.size == angle.size and _tells_turns(words[known], gone):
                warn(
                    f"{sheet.where}: {each.header!r} is one word in each turn and another in the next: if"
                    f' these are sections of a part, say section=("{each.name}", ...) or Sections.read; they'
                    " are read as turns of one"
                )


def _tells_turns(words: npt.NDArray[Any], angle: Floats) -> bool:
    """Whether words stay for a whole turn of the unwrapped angle (rad), or nearly, and never come back."""
    begins = np.append(0, 1 + np.flatnonzero(words[1:] != words[:-1]))
    if not 1 < begins.size == np.unique(words[begins].astype(str)).size:
        return False
    return all(np.ptp(run) > _WHOLE * _TURN for run in np.split(angle, begins[1:]))


def refuse_part_of_a_turn(angle: Floats, file: str, meant: str) -> None:
    """Refuse angles (rad) that leave more than a quarter of the turn without a reading."""
    if angle.size < 2:
        return
    around = np.sort(angle % _TURN)
    covered = 1 - float(np.diff(around, append=around[0] + _TURN).max()) / _TURN
    if covered < _WHOLE:
        raise ValueError(
            f"{file}: angles must go round the ring; got {covered:.2g} of a turn: {meant}"
            " (plausible=False takes an arc)"
        )


def refuse_unlike_turns(angle: Floats, reading: Floats, radius: float, file: str) -> None:
    """Refuse a radius (mm) at which an arc goes round more than once and the next turn is another ring.

    Two turns differ by noise; of an arc that was taken for too many turns they are two pieces of one.
    """
    like = _likeness(angle, reading)
    if like is not None:
        turns = float(np.ptp(angle) + np.median(np.diff(np.sort(angle)))) / _TURN
        raise ValueError(
            f"{file}: readings must repeat from turn to turn; at radius={radius:g} mm the arc goes round"
            f" {turns:.3g} times, which are not alike (correlation {like:.2g}): once at"
            f" radius={turns * radius:.6g} (plausible=False takes it as it is)"
        )


def unlike(angle: Floats, reading: Floats) -> str:
    """Sentence on turns (rad, mm) of unlike circles, or whose readings do not repeat; "": they are alike."""
    if told := unlike_turns(angle, reading):
        return told
    like = _likeness(angle, reading, 1 / _FAR)
    if like is None:
        return ""
    return (
        f"the readings do not repeat from turn to turn (correlation {like:.2g}): is the angle in another"
        " unit, does the part slip, or has the roller waves of its own?"
    )


def _likeness(angle: Floats, reading: Floats, apart_by: float = 0.0) -> float | None:
    """Correlation of two turns (rad, mm) that differ by more than noise; None: one turn, or they are alike.

    What differs is no noise where it stays for a reading, and for a share `apart_by` of a turn (unit 1).
    """
    order = np.argsort(angle)
    angle, reading = angle[order], reading[order]
    if angle.size < 2 or angle[-1] - angle[0] < (1 + _OVERLAP) * _TURN:
        return None
    again = angle >= angle[0] + _TURN
    first = np.interp(angle[again] - _TURN, angle, reading)
    like, apart = _correlation(first, reading[again]), reading[again] - first
    later = max(round(apart_by * angle.size * _TURN / (angle[-1] - angle[0])), 1)
    return like if like < _LIKE and _correlation(apart[later:], apart[:-later]) > _SMOOTH else None


def _correlation(x: Floats, y: Floats) -> float:
    """Correlation; 1: one of them does not vary."""
    spread = float(np.std(x) * np.std(y))
    return float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread else 1.0
