"""What a path asks of the arm and its table, whatever the placement: room of the table, heights of the wrist.

Frame P of a contact c lies at p = c - R z, with the lever arm R and the tool axis z. The wrist is at the
radius r from the first axis, in the direction e = +-z_xy/|z_xy| of the first joint (+: tool forward), and d5
behind P along z. In the frame of the surface the table has to be at

    s = r e + (d5 + R) z_xy - c_xy

and the wrist at the height c_z - (R + d5) z_z, but for the placement: that turns all s about z, shifts them
together, and shifts all heights together. So the table needs the least room of all s (`least_room`), and the
wrist the extent of the heights, whatever turn and origin.
"""

import math
from itertools import product

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._inverse import SLACK
from sdpgrind.finishing.placement._azimuths import AzimuthRange, swept
from sdpgrind.finishing.placement._proof import Shortfall
from sdpgrind.finishing.placement._task import PlacingTask
from sdpgrind.finishing.placement._widths import least_room

SHARES = (0.5, 1.0)  # chosen: shares of the contacts, those that move least, on which a bound is tried
# unit 1 and rad, chosen: level part of a tool axis without azimuth, and more travel than limits leave; both
# far above rounding, and neither makes a proof false
LOOSE = 1e-8


def table_room(arm: Arm, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Room of the table that the path needs, mm; of the radius and the side of the tool that need least."""
    sides = tuple(
        high - low + 2 * SLACK for low, high in zip(arm.position_min[5:], arm.position_max[5:], strict=True)
    )
    found = []
    for radius, side in product(arm.wrist_radii, (1.0, -1.0)):
        places, off = table_places(arm, task, over, side * radius)
        shares = SHARES if off.any() else SHARES[-1:]
        found.append(max((_room(places, off, share, sides) for share in shares), key=lambda s: s.excess))
    return min(found, key=lambda shortfall: shortfall.excess)


def table_places(arm: Arm, task: PlacingTask, over: AzimuthRange, radius: float) -> tuple[Floats, Floats]:
    """Places s of the table (m, 2) in the frame of the surface, and their greatest error, mm.

    `radius` < 0: tool backward. The error leaves out a shift of all places together.
    """
    arms, off = arm_vectors(arm, task, over, radius)
    middle = arms.mean(axis=0)
    off = off + 2 * math.sin(over.half / 2) * np.linalg.norm(arms - middle, axis=1)
    c, s = math.cos(over.centre), math.sin(over.centre)
    return (arms - middle) @ np.array([[c, s], [-s, c]]) - task.point[:, :2], off


def arm_vectors(arm: Arm, task: PlacingTask, over: AzimuthRange, radius: float) -> tuple[Floats, Floats]:
    """Vectors r e + (d5 + R) z_xy (m, 2) in a frame that turns with the azimuth, and their error, mm."""
    axis, off = swept(task, over, np.array([0.0, 0.0, 1.0]))
    level, further = np.hypot(axis[:, 0], axis[:, 1]), arm.d5 + task.hold.lever_arm
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (off + LOOSE) / level  # sine of the greatest turn of e
        chord = 2 * np.sin(np.arcsin(share) / 2)
        out = (radius / level + further)[:, None] * axis[:, :2]
    known = share < 1  # else e may be any direction: the middle of all is 0
    out = np.where(known[:, None], out, further * axis[:, :2])
    error = further * off + abs(radius) * np.where(known, chord if over.half else 0.0, 1.0)
    return out, error


def _room(places: Floats, off: Floats, share: float, sides: tuple[float, ...]) -> Shortfall:
    """Bound by the contacts that move least."""
    most = np.partition(off, int(share * (len(off) - 1)))[int(share * (len(off) - 1))]
    room = least_room(places[off <= most], (sides[0], sides[1]))
    axis = int(np.argmax(np.array(room.needed) - sides))
    return Shortfall(room.needed[axis] - 2 * float(most), sides[axis], "XY"[axis])


def wrist_heights(arm: Arm, task: PlacingTask, over: AzimuthRange) -> tuple[Floats, Floats]:
    """Heights of the wrist above the origin of the surface, and their greatest error, mm, (m,)."""
    found = swept(task, over, np.array([0.0, 0.0, -(task.hold.lever_arm + arm.d5)]))
    return task.point[:, 2] + found.vectors[:, 2], found.off


def wrist_extent(arm: Arm, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Extent of the heights of the wrist, against the greatest that any radius has, mm."""
    heights, off = wrist_heights(arm, task, over)
    needed = float((heights - off).max() - (heights + off).min())
    return Shortfall(needed, max(high - low for low, high in wrist_travels(arm)), "z")


def wrist_travels(arm: Arm) -> list[tuple[float, float]]:
    """Least and greatest height of the wrist over the shoulder, mm, of each radius and elbow that has any.

    At the radius r, q2 and q3 leave one freedom, the height. It ends where the arm is stretched or folded, or
    one of both angles is at a limit: there are no other ends.
    """
    found = []
    for radius, elbow in product(arm.wrist_radii, (-1.0, 1.0)):
        heights = [each for each in _ends(arm, radius) if _allowed(arm, radius, each, elbow)]
        if heights:
            found.append((min(heights) - LOOSE * arm.a2, max(heights) + LOOSE * arm.a2))
    return found or [(-math.inf, math.inf)]


def _ends(arm: Arm, radius: float) -> list[float]:
    """Heights at which the wrist may come to an end of its travel, mm."""
    a2, a3, ends = arm.a2, arm.a3, []
    for q3 in (0.0, math.pi, arm.position_min[2], arm.position_max[2]):
        square = a2 * a2 + a3 * a3 + 2 * a2 * a3 * math.cos(q3) - radius * radius
        ends += [math.sqrt(square), -math.sqrt(square)] if square >= 0 else []
    for q2 in (arm.position_min[1], arm.position_max[1]):
        square = a3 * a3 - (radius - a2 * math.cos(q2)) ** 2
        height = a2 * math.sin(q2)
        ends += [height + math.sqrt(square), height - math.sqrt(square)] if square >= 0 else []
    return ends


def _allowed(arm: Arm, radius: float, height: float, elbow: float) -> bool:
    """Whether q2 and q3 are within their limits at a height of the wrist."""
    a2, a3 = arm.a2, arm.a3
    cosine = (radius * radius + height * height - a2 * a2 - a3 * a3) / (2 * a2 * a3)
    if abs(cosine) > 1 + LOOSE:
        return False
    q3 = elbow * math.acos(max(-1.0, min(1.0, cosine)))
    q2 = math.atan2(height, radius) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
    return all(
        any(low - LOOSE <= q + turn <= high + LOOSE for turn in (-2 * math.pi, 0.0, 2 * math.pi))
        for q, low, high in zip((q2, q3), arm.position_min[1:3], arm.position_max[1:3], strict=True)
    )
