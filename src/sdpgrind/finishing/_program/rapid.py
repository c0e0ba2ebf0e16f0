"""Programs in RAPID: straight moves with zones, in the work object."""

from collections.abc import Iterator, Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.blocks import Blocks
from sdpgrind.finishing._program.form import (
    DEGREES,
    LENGTH,
    TextForm,
    commented,
    floored,
    shown_axes,
    told,
    vectors_of,
)

_TURNS = 8  # derived: decimals of a quaternion, the digits of single precision
_SLOW = "v50"  # mm/s, source: RAPID, predefined speeddata for moves by hand
MARKS = ("p_", "t_", "w_")  # chosen: before the name of a program: procedure, tool and work object
AXES_MAX, _NONE = 6, "9E9"  # source: RAPID, external axes a to f, and one that there is not
_ORIGIN = "[[0,0,0],[1,0,0,0]]"  # derived: a frame without shift and turn


def module(blocks: Blocks, form: TextForm, branch: int) -> str:
    """Write a module with one procedure."""
    procedure, tool, work = (f"{mark}{form.name}" for mark in MARKS)
    after = f"{tool}\\WObj:={work};"
    robot = len(form.start) - len(form.units)
    start = f"[{_list(np.degrees(form.start[:robot]), DEGREES)},{_extax(form.start[robot:], form)}]"
    moves = [f"MoveAbsJ {start}\\NoEOffs,{_SLOW},fine,{after}"]
    turns = _continued(blocks.turns)
    for k, point in enumerate(blocks.points):
        joints = blocks.joints[k]
        more = f"{_confdata(joints, branch)},{_extax(joints[robot:], form)}"
        target = f"[{_list(point, LENGTH)},{_turn(turns[k])},{more}]"
        feed, zone = floored(blocks.feeds[k], LENGTH), _zone(blocks.radii[k])
        moves.append(f"MoveL {target},v1000\\V:={feed},{zone},{after}")
    body = [
        f"PERS tooldata {tool}:=[TRUE,{frame(form.frames.tool)},[1,[0,0,1],[1,0,0,0],0,0,0]];",
        f"PERS wobjdata {work}:={_wobjdata(form)};",
        f"PROC {procedure}()",
        *(f"  ActUnit {unit};" for unit in form.names[-1:]),
        "  ConfL\\On;",
        *(f"  {move}" for move in moves),
        "  Stop;",
        "ENDPROC",
    ]
    lines = [*commented(form.head, "!"), f"MODULE {form.name}", *(f"  {line}" for line in body), "ENDMODULE"]
    return "\r\n".join(lines) + "\r\n"


def _wobjdata(form: TextForm) -> str:
    """Work object: in the base, or in the user frame of a unit that moves it, which the controller knows."""
    work = frame(form.frames.work)
    if form.names:
        return f'[FALSE,FALSE,"{form.names[-1]}",{_ORIGIN},{work}]'
    return f'[FALSE,TRUE,"",{work},{_ORIGIN}]'


def _extax(values: Floats, form: TextForm) -> str:
    """External axes in deg or mm."""
    told_axes = [each.replace(" ", "") for each in shown_axes(values, form.units)]
    return "[" + ",".join([*told_axes, *[_NONE] * (AXES_MAX - len(told_axes))]) + "]"


def _list(values: Floats, decimals: int) -> str:
    return f"[{told(values, decimals).replace(' ', '')}]"


def _turn(turn: Floats) -> str:
    """Quaternion, w first."""
    return _list(np.roll(turn, 1), _TURNS)


def frame(pose: Floats) -> str:
    """Return a rigid motion (4, 4), mm, as a pose: place in mm, quaternion w first."""
    point, turn = vectors_of(pose)
    return f"[{_list(point, LENGTH)},{_turn(turn)}]"


def _continued(turns: Floats) -> Floats:
    """Quaternions, each of the two signs that continues from the one before."""
    out = turns.copy()
    for k in range(1, len(out)):
        if out[k] @ out[k - 1] < 0.0:
            out[k] = -out[k]
    return out


def _confdata(joints: Floats, branch: int) -> str:
    """Quarters of a turn of axes 1, 4, 6; number of the branch: behind axis 1, behind the arm, axis 5 < 0."""
    quarters = np.floor(joints[[0, 3, 5]] / (0.5 * np.pi)).astype(int)
    shoulder, wrist, elbow = branch // 4, branch // 2 % 2, branch % 2
    return "[" + ",".join(map(str, [*quarters, 4 * shoulder + 2 * elbow + wrist])) + "]"


def _zone(radius: float) -> str:
    if radius == 0.0:
        return "fine"
    size = floored(radius, LENGTH)
    return f"[FALSE,{size},{size},{size},1,{size},1]"


def head(names: Sequence[str]) -> Iterator[str]:
    """Yield what the head says about time and frames; `names`: axes that carry the work."""
    yield "time is not kept: the controller's own law applies; V is the planned mean feed of each block"
    if names:
        letters = ", ".join(f"{name} is eax_{letter}" for name, letter in zip(names, "abcdef", strict=False))
        yield "frames: tooldata is the contact in tool0; wobjdata the work in the user frame of the"
        yield f"mechanical unit {names[-1]}, which moves it and is coordinated; its axes: {letters}"
    else:
        yield "frames: tooldata is the contact in tool0, wobjdata the work in the base"
    yield "mass and centre of gravity in tooldata are not those of your tool: set them"
    yield "units: mm, s; MoveAbsJ in deg; quaternions w first; confdata from the model's joints and branch"
