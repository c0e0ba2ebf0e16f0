"""Work that is carried by axes: the positions that a search compares, and where they bring a box.

The origin of the work lies in the box with all axes at zero. A table that slides shifts it; a turntable
whose axis is along z turns it about that, and the work with it, whose turn is free in every proof. So what
holds for every origin in the box that the axes sweep, at every turn, holds wherever the axes are, at each
contact alone. Of a turntable that is tilted nothing is proved.
"""

import math
from typing import Any

import numpy as np

from sdpgrind.finishing.arm._carriers import LinearTable, Turntable
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.placement._worth import Sides

COMPARED = 8  # chosen: positions of axes that are compared, as turns of the tool; `plan` takes all of them
_UPRIGHT = 1e-9  # chosen: tilt of a turntable that is upright


def compared(robot: Any) -> Any:
    """Return a robot with some of the candidates of axes that carry the work: `COMPARED` or so together."""
    if not isinstance(robot, MountedRobot):
        return robot
    most = math.ceil(COMPARED ** (1 / len(robot.axes)))
    return robot.replace(axes=tuple(_fewer(axis, most) for axis in robot.axes))


def _fewer(axis: Turntable | LinearTable, most: int) -> Turntable | LinearTable:
    """An axis with at most so many candidates."""
    name = "angles" if isinstance(axis, Turntable) else "positions"
    values = getattr(axis, name)
    if isinstance(values, int):
        return axis.replace(**{name: min(values, most)})
    return axis.replace(**{name: values[:: math.ceil(len(values) / most)]})


def swept_sides(robot: Any, sides: Sides) -> Sides | None:
    """Return a box (mm) around all places to which the axes bring an origin in a box; None: not known."""
    if not isinstance(robot, MountedRobot):
        return sides
    found: Sides | None = sides
    for axis in reversed(robot.axes):
        if found is None:
            return None
        found = _shifted(axis, found) if isinstance(axis, LinearTable) else _turned(axis, found)
    return found


def _shifted(table: LinearTable, sides: Sides) -> Sides:
    ends = np.outer(np.array(table.direction), table.travel)
    x, y, z = (
        (low + float(min(way)), high + float(max(way))) for (low, high), way in zip(sides, ends, strict=True)
    )
    return x, y, z


def _turned(table: Turntable, sides: Sides) -> Sides | None:
    if abs(table.axis[2]) < 1 - _UPRIGHT:
        return None
    far = [
        max(abs(low - at), abs(high - at)) for (low, high), at in zip(sides[:2], table.origin, strict=False)
    ]
    x, y = ((at - math.hypot(*far), at + math.hypot(*far)) for at in table.origin[:2])
    return x, y, sides[2]
