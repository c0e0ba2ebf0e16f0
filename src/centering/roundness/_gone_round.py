"""Whether angles go round a ring, and whether the readings of one turn are like those of the next."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.angles import angle_headings
from sdpgrind.base.columns.read import opened
from sdpgrind.base.columns.taken import Rules
from sdpgrind.base.warned import warn

_TURN = 2 * np.pi
_ROUNDING = 1e-6  # chosen: of a turn; the first reading of the next may lie a digit before its end
_WHOLE = 0.75  # chosen: share of the turn below which a ring was not gone round, or the angle is another one
_OVERLAP = 0.25  # chosen: share of a turn that is there twice from which on the two are compared
_LIKE = 0.5  # chosen: correlation of two turns of one ring; noise alone has less, too
_SMOOTH = 0.5  # chosen: correlation of neighbours; the difference of two turns of one ring is noise


def refuse_unnamed_angle(data: Any, rules: Rules) -> None:
    """Refuse a file with a column of angles that was not named: its rows need not be one even turn."""
    for where, each in angle_headings(data, rules):
        raise ValueError(
            "angle must be named, and either reading or deviation, where a file has a column of"
            f' angles: angle="{each.name}"; {where} has {each.header!r}'
        )


def warn_of_sections(data: Any, rules: Rules, angle: Floats) -> None:
    """Warn where the angles (rad) of a table begin again and another column tells one turn from the next."""
    gone = np.abs(np.unwrap(angle) - angle[0]) / _TURN
    turns = np.floor(gone + _ROUNDING).astype(int)
    if not turns[-1]:
        return
    for sheet in opened(data, rules)[1]:
        for place, each in enumerate(sheet.headings):
            if _counts(sheet.words(place), turns):
                warn(
                    f"{sheet.where}: {each.header!r} is one word in each turn and another in the next: if"
                    f' these are sections of a part, say section=("{each.name}", ...) or Sections.read; they'
                    f" are read as {turns[-1] + 1} turns of one"
                )


def _counts(words: npt.NDArray[Any], turns: npt.NDArray[np.intp]) -> bool:
    """Whether each turn has one word, and no other turn has it."""
    if words.size != turns.size:
        return False
    found = [set(words[turns == turn].tolist()) for turn in range(turns[-1] + 1)]
    return all(len(each) == 1 for each in found) and len(set().union(*found)) == len(found)


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
    order = np.argsort(angle)
    angle, reading = angle[order], reading[order]
    if angle.size < 2 or angle[-1] - angle[0] < (1 + _OVERLAP) * _TURN:
        return
    again = angle >= angle[0] + _TURN
    first = np.interp(angle[again] - _TURN, angle, reading)
    like, apart = _correlation(first, reading[again]), reading[again] - first
    if like < _LIKE and _correlation(apart[1:], apart[:-1]) > _SMOOTH:
        turns = float(angle[-1] - angle[0] + np.median(np.diff(angle))) / _TURN
        raise ValueError(
            f"{file}: readings must repeat from turn to turn; at radius={radius:g} mm the arc goes round"
            f" {turns:.3g} times, which are not alike (correlation {like:.2g}): once at"
            f" radius={turns * radius:.6g} (plausible=False takes it as it is)"
        )


def _correlation(x: Floats, y: Floats) -> float:
    """Correlation; 1: one of them does not vary."""
    spread = float(np.std(x) * np.std(y))
    return float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread else 1.0
