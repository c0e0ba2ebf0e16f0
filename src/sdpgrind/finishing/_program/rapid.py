"""Programs in RAPID: straight moves with zones, in the work object."""

from collections.abc import Iterator

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.blocks import Blocks
from sdpgrind.finishing._program.form import DEGREES, LENGTH, TextForm, commented, floored, told, vectors_of

_TURNS = 8  # derived: decimals of a quaternion, the digits of single precision
_SLOW = "v50"  # mm/s, source: RAPID, predefined speeddata for moves by hand
_NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"  # source: RAPID, no external axes


def module(blocks: Blocks, form: TextForm, branch: int) -> str:
    """Write a module with one procedure."""
    tool, work = f"t_{form.name}", f"w_{form.name}"
    after = f"{tool}\\WObj:={work};"
    start = f"[{_list(np.degrees(form.start), DEGREES)},{_NONE}]"
    moves = [f"MoveAbsJ {start}\\NoEOffs,{_SLOW},fine,{after}"]
    turns = _continued(blocks.turns)
    for k, point in enumerate(blocks.points):
        target = f"[{_list(point, LENGTH)},{_turn(turns[k])},{_confdata(blocks.joints[k], branch)},{_NONE}]"
        feed, zone = floored(blocks.feeds[k], LENGTH), _zone(blocks.radii[k])
        moves.append(f"MoveL {target},v1000\\V:={feed},{zone},{after}")
    body = [
        f"PERS tooldata {tool}:=[TRUE,{_frame(form.frames.tool)},[1,[0,0,1],[1,0,0,0],0,0,0]];",
        f'PERS wobjdata {work}:=[FALSE,TRUE,"",{_frame(form.frames.work)},[[0,0,0],[1,0,0,0]]];',
        f"PROC p_{form.name}()",
        "  ConfL\\On;",
        *(f"  {move}" for move in moves),
        "  Stop;",
        "ENDPROC",
    ]
    lines = [*commented(form.head, "!"), f"MODULE {form.name}", *(f"  {line}" for line in body), "ENDMODULE"]
    return "\r\n".join(lines) + "\r\n"


def _list(values: Floats, decimals: int) -> str:
    return f"[{told(values, decimals).replace(' ', '')}]"


def _turn(turn: Floats) -> str:
    """Quaternion, w first."""
    return _list(np.roll(turn, 1), _TURNS)


def _frame(pose: Floats) -> str:
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


def head() -> Iterator[str]:
    """Yield what the head says about time and frames."""
    yield "time is not kept: the controller's own law applies; V is the planned mean feed of each block"
    yield "frames: tooldata is the contact in tool0, wobjdata the work in the base"
    yield "mass and centre of gravity in tooldata are not those of your tool: set them"
    yield "units: mm, s; MoveAbsJ in deg; quaternions w first; confdata from the model's joints and branch"
