"""Reader of RAPID: aggregates by a grammar of their own, without the writer."""

import re
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.statements import Moves, misread, single

_TOKEN = re.compile(r'\s*(\[|\]|,|TRUE|FALSE|"[^"]*"|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)')
_OUTSIDE, _AXES = 9e9, 6  # source: RAPID, value of an external axis that there is not; their number
_HEADS = (
    ("name", re.compile(r"MODULE ([A-Za-z]\w*)")),
    ("tool", re.compile(r"PERS tooldata (\w+):=(.*);")),
    ("work", re.compile(r"PERS wobjdata (\w+):=(.*);")),
    ("proc", re.compile(r"PROC (\w+)\(\)")),
    ("joints", re.compile(r"MoveAbsJ (\[.*\])\\NoEOffs,(\w+),(fine),(\w+)\\WObj:=(\w+);")),
    ("line", re.compile(r"MoveL (\[.*\]),v1000\\V:=([\d.]+),(fine|\[FALSE.*\]),(\w+)\\WObj:=(\w+);")),
    ("unit", re.compile(r"ActUnit ([A-Za-z]\w*);")),
    ("skip", re.compile(r"ConfL\\On;|Stop;|ENDPROC")),
    ("end", re.compile(r"ENDMODULE")),
)


def read_rapid(text: str) -> ProgramPath:
    """Return the moves of a module.

    Raises
    ------
    ValueError
        For a line that means something else, with its number.
    """
    moves, names = Moves("rapid"), dict[str, str]()
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("!")[0].strip()
        if bare:
            kind, groups = _statement(bare, number)
            _take(moves, names, kind, groups, bare, number)
    if not moves.ended:
        raise ValueError("text must be a whole module, to ENDMODULE; its last line is another")
    return moves.path()


def _statement(line: str, number: int) -> tuple[str, tuple[Any, ...]]:
    for kind, form in _HEADS:
        found = form.fullmatch(line)
        if found:
            return kind, found.groups()
    raise misread("RAPID", number, line)


def _take(
    moves: Moves, names: dict[str, str], kind: str, groups: tuple[Any, ...], line: str, number: int
) -> None:
    if kind == "name":
        moves.name = groups[0]
    elif kind == "tool":
        names[kind], data = groups[0], _aggregate(groups[1], line, number)
        if not data[0]:
            raise misread("RAPID with the tool on the robot", number, line)
        moves.tool = _frame(data[1], line, number)
    elif kind == "work":
        names[kind] = groups[0]
        _take_work(moves, _aggregate(groups[1], line, number), line, number)
    elif kind == "unit":
        names[kind] = groups[0]
    elif kind in ("joints", "line"):
        if (names.get("tool"), names.get("work")) != groups[-2:]:
            raise misread("RAPID with one tool and one work object", number, line)
        if moves.unit != names.get("unit", ""):
            raise misread("RAPID in which the unit that moves the work is active, and no other", number, line)
        _move(moves, kind, groups, line, number)
    elif kind == "end":
        moves.ended = True


def _take_work(moves: Moves, data: Any, line: str, number: int) -> None:
    """Take a work object: at rest, or in the user frame of a unit, which the controller then sets."""
    held, fixed, moves.unit = data[:3]
    frames = [_frame(each, line, number) for each in data[3:5]]
    still = frames[0 if moves.unit else 1]
    if held or fixed is bool(moves.unit) or still.tolist() != np.eye(4).tolist():
        raise misread("RAPID with the work at rest or on a unit, and one frame of it", number, line)
    moves.work = frames[1 if moves.unit else 0]


def _move(moves: Moves, kind: str, groups: tuple[Any, ...], line: str, number: int) -> None:
    data = _aggregate(groups[0], line, number)
    axes = single([value for value in data[-1] if value != _OUTSIDE])
    if len(data[-1]) != _AXES or any(value == _OUTSIDE for value in data[-1][: len(axes)]):
        raise misread("RAPID with six external axes, those that are not there last", number, line)
    if bool(axes) != bool(moves.unit):
        raise misread("RAPID with external axes where a unit moves the work, and only there", number, line)
    if kind == "joints":
        moves.begun.append(axes)
        moves.turn_joints(np.radians(single(data[0])))
        return
    zone = 0.0 if groups[2] == "fine" else single([_aggregate(groups[2], line, number)[1]])[0]
    feed, configuration = single([float(groups[1])])[0], tuple(int(value) for value in data[2])
    moves.line(_frame(data[:2], line, number), feed, zone, configuration, axes)


def _frame(data: Any, line: str, number: int) -> Floats:
    """Rigid motion of a position and a quaternion, w first."""
    try:
        place, (w, x, y, z) = single(data[0]), single(data[1])
        out = np.eye(4)
        out[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
        out[:3, 3] = place
    except (TypeError, ValueError):
        raise misread("RAPID", number, line) from None
    if abs(w * w + x * x + y * y + z * z - 1.0) > 1e-5:  # source: RAPID refuses quaternions off by more
        raise misread("RAPID with quaternions of length 1", number, line)
    return out


def _aggregate(text: str, line: str, number: int) -> Any:
    """Nested list of a text in brackets."""
    waiting: list[list[Any]] = [[]]
    place = 0
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            raise misread("RAPID", number, line)
        word, place = found[1], found.end()
        if word == "[":
            waiting.append([])
        elif word == "]":
            done = waiting.pop()
            if not waiting:
                raise misread("RAPID", number, line)
            waiting[-1].append(done)
        elif word != ",":
            waiting[-1].append(_word(word))
    if len(waiting) != 1 or len(waiting[0]) != 1:
        raise misread("RAPID", number, line)
    return waiting[0][0]


def _word(word: str) -> Any:
    if word in ("TRUE", "FALSE"):
        return word == "TRUE"
    return word.strip('"') if word.startswith('"') else float(word)
