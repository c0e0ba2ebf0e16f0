"""Programs in URScript: straight moves with blends, or joints every 8 ms."""

from collections.abc import Iterable, Iterator

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.blocks import Blocks
from sdpgrind.finishing._program.form import (
    ANGLE,
    LENGTH,
    MM_PER_M,
    SLOW,
    TextForm,
    commented,
    floored,
    told,
    turn_vectors,
    vectors_of,
)

_METRES = LENGTH + 3
PERIOD = 0.008  # s, source: URScript manual, period of servoj of CB series
_PACE = 5  # derived: decimals of rad/s; 1e-5 rad/s move a contact by less than 0.05 mm/s
_SLOWING = 2.0  # rad/s^2, chosen: a stream that ends at rest needs none


def script(blocks: Blocks, form: TextForm) -> str:
    """Write straight moves."""
    work = _pose(*vectors_of(form.frames.work))
    a, lines = form.acceleration / MM_PER_M, [_joint_move(form.start)]
    for point, vector, feed, radius in zip(
        blocks.points, turn_vectors(blocks.turns), blocks.feeds, blocks.radii, strict=True
    ):
        pose = f"p[{told(point / MM_PER_M, _METRES)}, {told(vector, ANGLE)}]"
        v, r = floored(feed / MM_PER_M, _METRES), floored(radius / MM_PER_M, _METRES)
        lines.append(f"movel(pose_trans(work, {pose}), a={a:.4f}, v={v}, r={r})")
    head = [f"set_tcp({_pose(*vectors_of(form.frames.tool))})", f"work = {work}"]
    return _whole(form, [*head, *lines, f"stopl({a:.4f})"])


def stream(
    time: Floats, joints: Floats, form: TextForm, end: Floats, paces: tuple[float, float] = (SLOW, SLOW)
) -> str:
    """Write joints for every 8 ms, from the first, to which a joint move leads, and off again to the end.

    `paces`: greatest speeds of the leading joint in these two moves, rad/s.
    """
    steps = (
        f"servoj([{told(row, ANGLE)}], t={step:.6f})"
        for step, row in zip(np.diff(time), joints[1:], strict=True)
    )
    moves = [_joint_move(form.start), _joint_move(joints[0], paces[0])]
    off = [f"stopj({_SLOWING})", _joint_move(end, paces[1]), f"stopj({_SLOWING})"]
    return _whole(form, [*moves, *steps, *off])


def _whole(form: TextForm, lines: Iterable[str]) -> str:
    body = [f"def {form.name}():", *(f"  {line}" for line in lines), "end", f"{form.name}()"]
    return "\n".join([*commented(form.head, "#"), *body]) + "\n"


def _joint_move(joints: Floats, pace: float = SLOW) -> str:
    v = f"{SLOW}" if pace >= SLOW else floored(pace, _PACE)
    return f"movej([{told(joints, ANGLE)}], a={2 * SLOW}, v={v})"


def _pose(point: Floats, turn: Floats) -> str:
    return f"p[{told(point / MM_PER_M, _METRES)}, {told(turn_vectors(turn[None])[0], ANGLE)}]"


def head(timing: bool) -> Iterator[str]:
    """Yield what the head says about time."""
    if timing:
        yield f"time is kept: joints every {1e3 * PERIOD:g} ms by servoj; joint moves lead there and away"
    else:
        yield "time is not kept: the controller's own law applies; v is the planned mean feed of each block"
        yield "frames: set_tcp is the contact in the flange; work is the work in the base of the robot"
    yield "units: m, s, rad; p[x, y, z, rx, ry, rz]"
