"""Programs of an axis read back: what a control would make of the text. Shares nothing with the writer."""

import re
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats

_COMMENT = re.compile(r"\([^()]*\)|;.*")
_WORDS = re.compile(r"(?:[A-Z][-+]?(?:\d+\.?\d*|\.\d+)\s*)*")
_WORD = re.compile(r"([A-Z])([-+]?[\d.]+)")
_MODES = {"G21", "G90", "G94"}  # millimetres, absolute positions, feed per minute


class AxisPath(NamedTuple):
    """Positions (mm) that straight lines join, over time (s)."""

    time: Floats
    position: Floats


def read_ngc(text: str, axis: str) -> AxisPath:
    """Follow a program of RS274NGC from position 0: G1 and G4 in G21 G90 G94, to M2.

    Raises
    ------
    ValueError
        For a line that means something else, with its number.
    """
    time, position, feed, modes = [0.0], [0.0], 0.0, set[str]()
    for number, line in enumerate(text.splitlines(), 1):
        words = _words(line, number)
        codes = [f"{letter}{value:g}" for letter, value in words if letter in "GM"]
        values = {letter: value for letter, value in words if letter not in "GM"}
        if codes == ["M2"]:
            return AxisPath(np.array(time), np.array(position))
        if codes == ["G4"] and set(values) == {"P"}:
            time.append(time[-1] + values["P"])
            position.append(position[-1])
        elif codes == ["G1"] and axis in values and modes == _MODES and values.get("F", feed) > 0.0:
            feed = values.get("F", feed)
            time.append(time[-1] + 60.0 * abs(values[axis] - position[-1]) / feed)
            position.append(values[axis])
        elif codes and set(codes) <= _MODES and not values:
            modes |= set(codes)
        elif words:
            raise ValueError(
                f"text must be a program of G21 G90 G94, G1, G4 and M2; line {number} is {line!r}"
            )
    raise ValueError("text must be a program that ends by M2; its last line is another")


def _words(line: str, number: int) -> list[tuple[str, float]]:
    """Letters and numbers of a line without its comments."""
    bare = _COMMENT.sub("", line).strip()
    if not _WORDS.fullmatch(bare):
        raise ValueError(f"text must be words of a letter and a number; line {number} is {line!r}")
    return [(letter, float(value)) for letter, value in _WORD.findall(bare)]


def read_csv(text: str) -> AxisPath:
    """Read a table with one line of names: time (s) and position (mm)."""
    table = np.loadtxt(text.splitlines()[1:], delimiter=",", ndmin=2)
    return AxisPath(table[:, 0], table[:, 1])
