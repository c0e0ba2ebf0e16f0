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
    shown_axes,
    told,
    vectors_of,
)

AXES_MAX = 2  # derived: external axes of which a line of 140 characters tells all digits
MACHINE = 2  # chosen: index of the only external kinematic in MACHINE_DEF, behind the robot
MARK = 4  # digits of the digest in the names of parts, chosen: two versions in a folder differ in it
_SLOW = 10  # percent, chosen: joint moves by hand
_JOINTS = 6  # source: KRL, axes that T tells
_LEVEL = 1e-7  # rad, chosen: B nearer to +-90 deg leaves only the sum or difference of A and C


def source(parts: Sequence[Blocks], form: TextForm, branch: int) -> str:
    """Write one program; of several parts one that calls a program each, and these behind it."""
    bodies = [_moves(blocks, form, branch) for blocks in parts]
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
    robot = len(form.start) - len(form.units)
    start = ",".join(f"A{k} {told([q], DEGREES)}" for k, q in enumerate(np.degrees(form.start[:robot]), 1))
    start += _external(form.start[robot:], form)
    return [
        *commented(form.head, ";"),
        "BAS(#INITMOV,0)",
        f"BAS(#VEL_PTP,{_SLOW})",
        f"$TOOL={aggregate(form.frames.tool)}",
        f"$BASE={_base(form)}",
        "$ORI_TYPE=#VAR",
        f"$ACC.CP={form.acceleration / MM_PER_M:.4f}",
        f"PTP {{{start}}}",
    ]


def _base(form: TextForm) -> str:
    """Work in the base, or coupled to the external kinematic that moves it, where the controller knows it."""
    work = aggregate(form.frames.work)
    unit = f"MACHINE_DEF[{MACHINE}]"
    return f"EK({unit}.ROOT,{unit}.MECH_TYPE,{work})" if form.names else work


def _external(values: Floats, form: TextForm) -> str:
    """External axes E1 and E2 in deg or mm, behind a comma."""
    return "".join(f",E{k} {each}" for k, each in enumerate(shown_axes(values, form.units), 1))


def _moves(blocks: Blocks, form: TextForm, branch: int) -> list[str]:
    """Lines of straight moves."""
    angles, robot = euler_angles(blocks.turns), blocks.joints.shape[1] - len(form.units)
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
        joints = blocks.joints[k]
        more = f"S {_status(branch)},T {_turn_bits(joints)}{_external(joints[robot:], form)}"
        moves.append(f"LIN {{{_frame(point, angles[k])},{more}}}{near}")
    return moves


def _frame(point: Floats, angles: Floats) -> str:
    lengths = zip("XYZ", point, [LENGTH] * 3, strict=True)
    turns = zip("ABC", np.degrees(angles), [DEGREES] * 3, strict=True)
    return ",".join(f"{axis} {told([value], decimals)}" for axis, value, decimals in (*lengths, *turns))


def aggregate(pose: Floats) -> str:
    """Return a rigid motion (4, 4), mm, as a frame: X, Y, Z in mm, A, B, C in deg."""
    point, turn = vectors_of(pose)
    return f"{{{_frame(point, euler_angles(turn[None])[0])}}}"


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
    """Bits of axes below 0, the external ones left out."""
    return int(sum(1 << k for k, q in enumerate(joints[:_JOINTS]) if q < 0.0))


def head(names: Sequence[str]) -> Iterator[str]:
    """Yield what the head says about time and frames; `names`: axes that carry the work."""
    yield "time is not kept: the controller's own law applies; $VEL.CP is the planned mean feed of a block"
    if names:
        axes = ", ".join(f"{name} is E{k}" for k, name in enumerate(names, 1))
        yield "frames: $TOOL is the contact in the flange; $BASE moves with the external kinematic in"
        yield f"MACHINE_DEF[{MACHINE}], coupled by EK (change the index if yours is another)"
        yield f"its axes, synchronous ones: {axes}"
        yield "ROOT is told in WORLD, which is the base of the robot where $ROBROOT is zero"
    else:
        yield "frames: $TOOL is the contact in the flange, $BASE the work in the base of the robot"
    yield "units: mm, deg, s; $VEL.CP in m/s; S and T from the model's branch and joints"
