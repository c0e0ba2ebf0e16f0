"""Reader of URScript: a grammar of its own, without the writer."""

import re
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.statements import NUMBER, Moves, misread, numbers

_SIX = rf"\[((?:\s*{NUMBER}\s*,){{5}}\s*{NUMBER}\s*)\]"
_FORMS = {
    "name": re.compile(r"def ([A-Za-z]\w*)\(\):"),
    "tool": re.compile(rf"set_tcp\(p{_SIX}\)"),
    "work": re.compile(rf"work = p{_SIX}"),
    "movej": re.compile(rf"movej\({_SIX}, a=({NUMBER}), v=({NUMBER})\)"),
    "movel": re.compile(rf"movel\(pose_trans\(work, p{_SIX}\), a=({NUMBER}), v=({NUMBER}), r=({NUMBER})\)"),
    "servoj": re.compile(rf"servoj\({_SIX}, t=({NUMBER})\)"),
    "stop": re.compile(rf"stop[jl]\(({NUMBER})\)"),
    "end": re.compile(r"end"),
    "call": re.compile(r"([A-Za-z]\w*)\(\)"),
}
_METRE = 1000.0  # mm, derived


def read_urscript(text: str) -> ProgramPath:
    """Return the moves of a program; metres become mm.

    Raises
    ------
    ValueError
        For a line that means something else, with its number.
    """
    moves = Moves("urscript")
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0].strip()
        if bare:
            kind, groups = _statement(bare, number)
            _take(moves, kind, groups, number)
    if not moves.ended:
        raise ValueError("text must be a whole program, to its end; its last line is another")
    return moves.path()


def _statement(line: str, number: int) -> tuple[str, tuple[Any, ...]]:
    for kind, form in _FORMS.items():
        found = form.fullmatch(line)
        if found:
            return kind, found.groups()
    raise misread("URScript", number, line)


def _take(moves: Moves, kind: str, groups: tuple[Any, ...], number: int) -> None:
    if kind == "name":
        moves.name = groups[0]
    elif kind == "tool":
        moves.tool = _pose(groups[0])
    elif kind == "work":
        moves.work = _pose(groups[0])
    elif kind == "movej":
        moves.turn_joints(np.array(numbers(groups[0])), float(groups[2]))
    elif kind == "movel":
        pose = _pose(groups[0])
        moves.line(pose, _METRE * float(groups[2]), _METRE * float(groups[3]), ())
    elif kind == "servoj":
        moves.stream(np.array(numbers(groups[0])), float(groups[1]), number)
    elif kind == "call":
        moves.ended = groups[0] == moves.name


def _pose(words: str) -> Floats:
    values = numbers(words)
    out = np.eye(4)
    out[:3, :3] = Rotation.from_rotvec(values[3:]).as_matrix()
    out[:3, 3] = [_METRE * value for value in values[:3]]
    return out
