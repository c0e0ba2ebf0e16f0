"""Form of the text of a program: name, frames, joints of the start, head; numbers of fixed decimals."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.course import RobotFrames
from sdpgrind.finishing._program.turns import turns_of

MM_PER_M = 1000.0  # derived
LENGTH, ANGLE = 4, 7  # derived: decimals of mm and rad; at 1.4 m reach 5 decimals of rad give 7 um a joint
DEGREES = 6  # derived: decimals of degrees for 1e-7 rad
SLOW = 0.25  # rad/s, chosen: joint moves to the start, at the pace of a robot in hand


class TextForm(NamedTuple):
    """Name of the program, lines of its head, frames, joints (rad) above the start, acceleration (mm/s^2).

    Names and units of axes that carry the work: `frames.work` is then the work in the frame of their unit.
    """

    name: str
    head: list[str]
    frames: RobotFrames
    start: Floats
    acceleration: float
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()


def shown_axes(values: Floats, units: Iterable[str]) -> list[str]:
    """Return positions of external axes, rad or mm, as numbers in deg or mm."""
    each = zip(values, units, strict=True)
    return [told([np.degrees(q)], DEGREES) if unit == "rad" else told([q], LENGTH) for q, unit in each]


def told(values: Iterable[float], decimals: int) -> str:
    """Return numbers of fixed decimals, parted by commas; no minus before 0."""
    scale = 10.0**decimals
    numbers = np.asarray(values, dtype=float).tolist()
    return ", ".join(f"{round(value * scale) / scale:.{decimals}f}" for value in numbers)


def floored(value: float, decimals: int) -> str:
    """Return a number that is rounded down, for feeds and blends."""
    scale = 10.0**decimals
    return f"{np.floor(value * scale) / scale:.{decimals}f}"


def turn_vectors(turns: Floats) -> Floats:
    """Return rotation vectors (k, 3), rad, each of the two of a turn that continues from the one before."""
    found: Floats = Rotation.from_quat(turns).as_rotvec()
    for k in range(1, len(found)):
        size = float(np.linalg.norm(found[k]))
        other = found[k] * (1.0 - 2.0 * np.pi / size) if size > 0.0 else found[k]
        if np.linalg.norm(other - found[k - 1]) < np.linalg.norm(found[k] - found[k - 1]):
            found[k] = other
    return found


def vectors_of(pose: Floats) -> tuple[Floats, Floats]:
    """Return position (3,), mm, and quaternion (4,), x y z w, of a rigid motion."""
    return pose[:3, 3], turns_of(pose[None])[0]


def commented(lines: Iterable[str], mark: str) -> Iterator[str]:
    """Yield lines of a comment."""
    for line in lines:
        yield f"{mark} {line}"
