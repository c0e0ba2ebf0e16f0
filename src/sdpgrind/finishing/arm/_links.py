"""Chains of links: from Denavit-Hartenberg rows, and from frames with any axis of a joint."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

TURN = 2 * math.pi


def shown_angle(name: str, value: float) -> None:
    """Refuse an angle beyond a turn."""
    if abs(value) > TURN:
        raise checks.refuse(name, "within a turn; units.deg(90) for degrees", value, "rad")


def of_rows(rows: npt.ArrayLike) -> Floats:
    """Links (n + 1, 4, 4) of standard rows (n, 4): theta offset, d, a, alpha; rad, mm."""
    array = checks.finite_array("rows", rows, "rad, mm")
    if array.ndim != 2 or array.shape[1] != 4 or not len(array):
        raise ValueError(
            f"rows must be of shape (n, 4): offset of theta (rad), d, a (mm), alpha (rad); got {array.shape}"
        )
    for k, (theta, _, _, alpha) in enumerate(array.tolist()):
        shown_angle(f"offset of theta in rows[{k}]", theta)
        shown_angle(f"alpha in rows[{k}]", alpha)
    return np.stack([np.eye(4), *(row(*each) for each in array.tolist())])


def row(theta: float, d: float, a: float, alpha: float) -> Floats:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    c, s, ca, sa = _cosine(theta), _sine(theta), _cosine(alpha), _sine(alpha)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d], [0.0, 0.0, 0.0, 1.0]]
    )


def _cosine(angle: float) -> float:
    """Cosine, exact for quarters of a turn: axes meant to be perpendicular are so."""
    return _quarter(angle, (1.0, 0.0, -1.0, 0.0), math.cos)


def _sine(angle: float) -> float:
    return _quarter(angle, (0.0, 1.0, 0.0, -1.0), math.sin)


def _quarter(angle: float, values: Sequence[float], function: object) -> float:
    quarters = angle / (math.pi / 2)
    whole = round(quarters)
    if abs(quarters - whole) < 1e-15 * max(1, abs(whole)):  # chosen: rounding of a quarter of a turn
        return values[whole % 4]
    assert callable(function)
    return float(function(angle))


def rotation(rpy: Sequence[float]) -> Floats:
    """Rotation Rz(yaw) Ry(pitch) Rx(roll), (3, 3), of angles in rad."""
    (cr, cp, cy), (sr, sp, sy) = [_cosine(a) for a in rpy], [_sine(a) for a in rpy]
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def of_frames(frames: Sequence[Floats], axes: Sequence[Floats], flange: Floats) -> Floats:
    """Links (n + 1, 4, 4) between joints about z, of frames (4, 4) before joints about any unit axis."""
    turns = [_towards(axis) for axis in axes]
    before = [np.eye(4), *(turn.T for turn in turns)]
    behind = [*frames, flange]
    after = [*turns, np.eye(4)]
    return np.stack([b @ frame @ a for b, frame, a in zip(before, behind, after, strict=True)])


def _towards(axis: Floats) -> Floats:
    """Rotation (4, 4) whose z axis is `axis`; the identity for z itself."""
    out = np.eye(4)
    if axis[2] == 1.0:
        return out
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(axis)))] = 1.0
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    out[:3, 0], out[:3, 1], out[:3, 2] = x, np.cross(axis, x), axis
    return out
