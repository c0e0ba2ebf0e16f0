"""Reader of KRL: system variables, PTP and LIN, without the writer."""

import re
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.statements import NUMBER, Moves, misread, single

_PAIR = re.compile(rf"\s*([A-Z]\d?)\s+({NUMBER})\s*")
_FORMS = (
    ("name", re.compile(r"DEF ([A-Za-z]\w*)\(\)")),
    ("call", re.compile(r"([A-Za-z]\w*)\(\)")),
    ("skip", re.compile(r"BAS\(#(?:INITMOV,0|VEL_PTP,\d+)\)|\$ORI_TYPE=#VAR|HALT")),
    ("acceleration", re.compile(rf"\$ACC\.CP=({NUMBER})")),
    ("frame", re.compile(r"\$(TOOL|BASE)=\{(.*)\}")),
    (
        "coupled",
        re.compile(r"\$(BASE)=EK\(MACHINE_DEF\[(\d+)\]\.ROOT,MACHINE_DEF\[(\d+)\]\.MECH_TYPE,\{(.*)\}\)"),
    ),
    ("feed", re.compile(rf"\$VEL\.CP=({NUMBER})")),
    ("distance", re.compile(rf"\$APO\.CDIS=({NUMBER})")),
    ("joints", re.compile(r"PTP \{(.*)\}")),
    ("line", re.compile(r"LIN \{(.*)\}( C_DIS)?")),
    ("end", re.compile(r"END")),
)
_METRE = 1000.0  # mm, derived
LONGEST = 140  # characters, source: KUKA System Software, editor of programs


def read_krl(text: str) -> ProgramPath:
    """Return the moves of a program.

    Raises
    ------
    ValueError
        For a line that means something else, with its number.
    """
    moves, values = Moves("krl"), {"feed": 0.0, "distance": 0.0}
    programs = _programs(text)
    _follow(programs, next(iter(programs), ""), moves, values)
    return moves.path()


def _programs(text: str) -> dict[str, list[tuple[int, str]]]:
    """Programs of a text by name: their numbered lines behind DEF, without END."""
    found: dict[str, list[tuple[int, str]]] = {}
    inside = ""
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > LONGEST:
            raise misread(f"KRL with lines of at most {LONGEST} characters", number, line)
        bare = line.partition(";")[0].strip()
        kind, groups = _statement(bare, number) if bare else ("", ())
        if kind == "name" and not inside and groups[0] not in found:
            inside, found[groups[0]] = groups[0], []
        elif kind == "end" and inside:
            inside = ""
        elif kind and (kind in ("name", "end") or not inside):
            raise misread("KRL", number, line)
        elif kind:
            found[inside].append((number, bare))
    if inside or not found:
        raise ValueError("text must be a whole program, to END; its last line is another")
    return found


def _follow(
    programs: dict[str, list[tuple[int, str]]], name: str, moves: Moves, values: dict[str, float]
) -> None:
    """Take the statements of a program, and those of programs that it calls; each is called once."""
    moves.name = moves.name or name
    for number, line in programs.pop(name):
        kind, groups = _statement(line, number)
        if kind == "call" and groups[0] not in programs:
            raise ValueError(f"text must hold the program {groups[0]}, which line {number} calls once")
        if kind == "call":
            _follow(programs, groups[0], moves, values)
        else:
            _take(moves, values, kind, groups, line, number)


def called(text: str) -> list[str]:
    """Names of programs that a text calls and does not hold."""
    held = re.findall(r"(?m)^DEF (\w+)\(\)", text)
    return [name for name in re.findall(r"(?m)^(\w+)\(\)\s*$", text) if name not in held]


def _statement(line: str, number: int) -> tuple[str, tuple[Any, ...]]:
    for kind, form in _FORMS:
        found = form.fullmatch(line)
        if found:
            return kind, found.groups()
    raise misread("KRL", number, line)


def _take(
    moves: Moves, values: dict[str, float], kind: str, groups: tuple[Any, ...], line: str, number: int
) -> None:
    if kind in ("frame", "coupled"):
        _take_frame(moves, groups, line, number)
    elif kind in values:
        values[kind] = single([float(groups[0])])[0]
    elif kind == "joints":
        found, axes = _with_axes(moves, groups[0], line, number, [f"A{k}" for k in range(1, 7)])
        moves.begun.append(axes)
        moves.turn_joints(np.radians(list(found.values())))
    elif kind == "line":
        found, axes = _with_axes(moves, groups[0], line, number, "XYZABCST")
        radius = values["distance"] if groups[1] else 0.0
        bits = int(found["S"]), int(found["T"])
        moves.line(_pose(found), _METRE * values["feed"], radius, bits, axes)


def _take_frame(moves: Moves, groups: tuple[Any, ...], line: str, number: int) -> None:
    """Take $TOOL, or $BASE: at rest, or coupled to a unit that is named twice."""
    variable, *units, text = groups
    if moves.poses:
        raise ValueError(
            f"text must set ${variable} before its straight moves, which all count in one; line {number}"
            " sets it again"
        )
    if len(set(units)) > 1:
        raise misread("KRL with one external kinematic", number, line)
    moves.unit = units[0] if units else moves.unit
    setattr(moves, {"TOOL": "tool", "BASE": "work"}[variable], _pose(_pairs(text, line, number, "XYZABC")))


def _with_axes(
    moves: Moves, text: str, line: str, number: int, wanted: Any
) -> tuple[dict[str, float], list[float]]:
    """Names and numbers of an aggregate, those of external axes apart, which only a moved work has."""
    count = len(re.findall(r"\bE\d ", text))
    if bool(count) != bool(moves.unit):
        raise misread("KRL with external axes where $BASE is coupled by EK, and only there", number, line)
    names = [f"E{k}" for k in range(1, count + 1)]
    found = _pairs(text, line, number, [*wanted, *names])
    return found, [found.pop(name) for name in names]


def _pairs(text: str, line: str, number: int, wanted: Any) -> dict[str, float]:
    """Names and numbers of an aggregate."""
    found = [_PAIR.fullmatch(pair) for pair in text.split(",")]
    named = {pair[1]: single([float(pair[2])])[0] for pair in found if pair}
    if not all(found) or len(named) != len(found) or list(named) != list(wanted):
        raise misread("KRL", number, line)
    return named


def _pose(found: dict[str, float]) -> Floats:
    """Rigid motion Rz(A) Ry(B) Rx(C) of degrees, written out."""
    a, b, c = (np.radians(found[name]) for name in "ABC")
    (ca, sa), (cb, sb), (cc, sc) = ((np.cos(angle), np.sin(angle)) for angle in (a, b, c))
    out = np.eye(4)
    out[:3, 0] = ca * cb, sa * cb, -sb
    out[:3, 1] = ca * sb * sc - sa * cc, sa * sb * sc + ca * cc, cb * sc
    out[:3, 2] = ca * sb * cc + sa * sc, sa * sb * cc - ca * sc, cb * cc
    out[:3, 3] = found["X"], found["Y"], found["Z"]
    return out
