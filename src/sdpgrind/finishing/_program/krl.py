"""Programs in KRL: straight moves with approximation by distance, in $BASE."""

import hashlib
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.blocks import Blocks
from sdpgrind.finishing._program.form import (
    DEGREES,
    LENGTH,
    MM_PER_M,
    TextForm,
    commented,
    floored,
    told,
    vectors_of,
)

MARK = 4  # digits of the digest in the names of parts, chosen: two versions in a folder differ in it
_SLOW = 10  # percent, chosen: joint moves by hand
_LEVEL = 1e-7  # rad, chosen: B nearer to +-90 deg leaves only the sum or difference of A and C


def source(parts: Sequence[Blocks], form: TextForm, branch: int) -> str:
    """Write one program; of several parts one that calls a program each, and these behind it."""
    bodies = [_moves(blocks, branch) for blocks in parts]
    if len(bodies) == 1:
        return _program(form.name, [*_begun(form), *bodies[0], "HALT"])
    # Names change with the moves: a file that calls others never calls those of another version.
    mark = hashlib.sha256("\n".join(map("\n".join, bodies)).encode()).hexdigest()[:MARK]
    names = [f"{form.name}_{mark}_{k}" for k in range(1, len(bodies) + 1)]
    main = _program(form.name, [*_begun(form), *(f"{name}()" for name in names), "HALT"])
    return main + "".join(map(_program, names, bodies))


def _program(name: str, lines: Sequence[str]) -> str:
    return "\r\n".join([f"DEF {name}()", *lines, "END", ""])


def _begun(form: TextForm) -> list[str]:
    """Lines up to the joints above the start."""
    start = ",".join(f"A{k} {told([q], DEGREES)}" for k, q in enumerate(np.degrees(form.start), 1))
    return [
        *commented(form.head, ";"),
        "BAS(#INITMOV,0)",
        f"BAS(#VEL_PTP,{_SLOW})",
        f"$TOOL={{{_of(form.frames.tool)}}}",
        f"$BASE={{{_of(form.frames.work)}}}",
        "$ORI_TYPE=#VAR",
        f"$ACC.CP={form.acceleration / MM_PER_M:.4f}",
        f"PTP {{{start}}}",
    ]


def _moves(blocks: Blocks, branch: int) -> list[str]:
    """Lines of straight moves."""
    angles = euler_angles(blocks.turns)
    moves: list[str] = []
    distance = feed = ""
    for k, point in enumerate(blocks.points):
        v, r = floored(blocks.feeds[k] / MM_PER_M, LENGTH + 3), floored(blocks.radii[k], LENGTH)
        if v != feed:
            moves.append(f"$VEL.CP={v}")
        if blocks.radii[k] and r != distance:
            moves.append(f"$APO.CDIS={r}")
            distance = r
        feed, near = v, " C_DIS" if blocks.radii[k] else ""
        bits = f"S {_status(branch)},T {_turn_bits(blocks.joints[k])}"
        moves.append(f"LIN {{{_frame(point, angles[k])},{bits}}}{near}")
    return moves


def _frame(point: Floats, angles: Floats) -> str:
    lengths = zip("XYZ", point, [LENGTH] * 3, strict=True)
    turns = zip("ABC", np.degrees(angles), [DEGREES] * 3, strict=True)
    return ",".join(f"{axis} {told([value], decimals)}" for axis, value, decimals in (*lengths, *turns))


def _of(pose: Floats) -> str:
    point, turn = vectors_of(pose)
    return _frame(point, euler_angles(turn[None])[0])


def euler_angles(turns: Floats) -> Floats:
    """Return A about z, B about y', C about x'', (k, 3), rad; at B = +-90 deg A stays, C takes the rest."""
    matrices = Rotation.from_quat(turns).as_matrix()
    level = np.hypot(matrices[:, 0, 0], matrices[:, 1, 0])
    out = np.empty((len(matrices), 3))
    out[:, 0] = np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0])
    for k in np.flatnonzero(level < _LEVEL):
        out[k, 0] = out[k - 1, 0] if k else 0.0
    c, s = np.cos(out[:, 0]), np.sin(out[:, 0])
    out[:, 1] = np.arctan2(-matrices[:, 2, 0], c * matrices[:, 0, 0] + s * matrices[:, 1, 0])
    # of Rz(-A) R: its second row is (0, cos C, -sin C), whatever B is
    rows = c[:, None] * matrices[:, 1] - s[:, None] * matrices[:, 0]
    out[:, 2] = np.arctan2(-rows[:, 2], rows[:, 1])
    return out


def _status(branch: int) -> int:
    """Bits of the branch: wrist behind axis 1, elbow."""
    return branch // 4 + 2 * (branch % 2)


def _turn_bits(joints: Floats) -> int:
    """Bits of axes below 0."""
    return int(sum(1 << k for k, q in enumerate(joints) if q < 0.0))


def head() -> Iterator[str]:
    """Yield what the head says about time and frames."""
    yield "time is not kept: the controller's own law applies; $VEL.CP is the planned mean feed of a block"
    yield "frames: $TOOL is the contact in the flange, $BASE the work in the base of the robot"
    yield "units: mm, deg, s; $VEL.CP in m/s; S and T from the model's branch and joints"
