"""What the search of a placement and its proofs need to know: contacts, tool and robot."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._tool import headings, held_poses
from sdpgrind.finishing.path._samples import PathSamples

FEW = 30  # chosen (spec): poses that stand for the path while many placements are compared


class ToolHold(NamedTuple):
    """How the tool is held: contact angle (rad), lever arm (mm), heading and side; see `tool_poses`.

    `spins`: turns about its own axis, rad, of which each pose may take one; empty where it is held.
    """

    contact_angle: float
    lever_arm: float
    heading: str
    pushed: bool
    spins: tuple[float, ...] = ()

    @property
    def side(self) -> float:
        """1 for a pushed tool, -1 for a dragged one."""
        return 1.0 if self.pushed else -1.0


class PlacingTask(NamedTuple):
    """Contacts in the frame of the surface (m, 3), mm, the tool, and the robot that is to reach them."""

    robot: Robot
    point: Floats
    tangent: Floats
    normal: Floats
    hold: ToolHold

    @property
    def turns_freely(self) -> bool:
        """Whether the azimuth of the tool on the work is free; a tool along the feed has none."""
        return self.hold.heading == "fixed"

    def poses(self, azimuth: float) -> Floats:
        """Poses of the tool in the frame of the surface, (m, 4, 4), at an azimuth on the work, rad."""
        along = headings(self.normal, azimuth) if self.turns_freely else self.tangent
        hold = self.hold
        return held_poses(self.point, along, self.normal, hold.contact_angle, hold.lever_arm, hold.pushed)

    def spun(self, poses: Floats) -> Floats:
        """Poses (m s, 4, 4) in each of s turns of the tool about its own axis."""
        if not self.hold.spins:
            return poses
        turns = np.tile(np.eye(4), (len(self.hold.spins), 1, 1))
        for turn, spin in zip(turns, self.hold.spins, strict=True):
            c, s = math.cos(spin), math.sin(spin)
            turn[:2, :2] = [[c, -s], [s, c]]
        out: Floats = (poses[:, None] @ turns).reshape(-1, 4, 4)
        return out

    def at(self, index: npt.ArrayLike) -> "PlacingTask":
        """Return the task with some of the contacts."""
        some = np.asarray(index)
        return self._replace(point=self.point[some], tangent=self.tangent[some], normal=self.normal[some])


def task_of(robot: Robot, samples: PathSamples, hold: ToolHold) -> PlacingTask:
    """Return the task of a path, each contact once where the direction of feed does not matter."""
    rows = np.column_stack([samples.point, samples.normal])
    if hold.heading == "feed_aligned":
        rows = np.column_stack([rows, samples.tangent])
    once = np.sort(np.unique(rows, axis=0, return_index=True)[1])
    return PlacingTask(robot, samples.point, samples.tangent, samples.normal, hold).at(once)


def spread(task: PlacingTask, count: int = FEW) -> npt.NDArray[np.intp]:
    """Indices of contacts that are spread by the farthest point; the first is the farthest from the middle.

    The distance of two contacts is that of their points and, times the lever arm, of their normals.
    """
    places = np.column_stack([task.point, task.hold.lever_arm * task.normal])
    far = np.linalg.norm(places - places.mean(axis=0), axis=1)
    taken = [int(np.argmax(far))]
    nearest = np.full(len(places), math.inf)
    while len(taken) < min(count, len(places)):
        nearest = np.minimum(nearest, np.linalg.norm(places - places[taken[-1]], axis=1))
        if nearest.max() <= 0.0:
            break
        taken.append(int(np.argmax(nearest)))
    return np.array(taken)
