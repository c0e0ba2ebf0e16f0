"""Which closed form serves a chain of joints, and why none does."""

from typing import Protocol

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._closed_form import MOVED, TILTED, ClosedForm, Screws, closed_form
from sdpgrind.finishing.arm._robot import Robot, numeric_jacobian


class SerialChain(Robot, Protocol):
    """A robot whose joints are links in series."""

    @property
    def links(self) -> Floats:
        """Rigid motions between the joints, the last one to the flange, (n + 1, 4, 4), mm."""

    @property
    def sliding(self) -> tuple[bool, ...]:
        """Whether each joint slides, (n,)."""


def form_of(robot: SerialChain) -> ClosedForm | str:
    """Closed form of the inverse, or the sentence that says why there is none."""
    if len(robot.names) != 6 or any(robot.sliding):
        return _other_joints(robot)
    here, directions, points = robot.links[0], [], []
    for link in robot.links[1:]:
        directions.append(here[:3, 2])
        points.append(here[:3, 3])
        here = here @ link
    found = closed_form(Screws(np.array(directions), np.array(points), here))
    if isinstance(found, ClosedForm):
        return found
    return f"robot must have, to {TILTED:g} rad and {MOVED:g} mm, {found}"


def _other_joints(robot: SerialChain) -> str:
    """Sentence about joints that are not six that turn."""
    count = len(robot.names)
    if count < 6:
        rank = _rank(robot)
        return (
            f"robot must have six joints for a pose; got {count}, whose Jacobian has rank {rank}:"
            f" {6 - rank} of the six freedoms are missing"
        )
    slides = [name for name, slides in zip(robot.names, robot.sliding, strict=True) if slides]
    got = f"{', '.join(slides)} that slides" if slides else f"{count} joints"
    return f"robot must have six turning joints for an inverse in closed form; got {got}"


def _rank(robot: SerialChain) -> int:
    """Rank of the Jacobian at joints that are not special."""
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    share = np.modf(np.arange(1, len(low) + 1) * 0.6180339887)[0]  # golden ratio: spread, never equal
    slopes = numeric_jacobian(robot, low + (0.1 + 0.8 * share) * (high - low))
    slopes[:3] /= max(1.0, float(np.abs(slopes[:3]).max()))
    return int(np.linalg.matrix_rank(slopes, tol=1e-6))
