"""Posture of a robot over a motion, and its form in files."""

import json
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.warned import warn


@dataclass(frozen=True, eq=False)
class Posture(ByValue):
    """Posture of the robot over a motion.

    Attributes
    ----------
    branch : int
        Branch: of an arm 0 to 3, see `Arm.inverse`; of other robots, see its ``solutions``.
    placement : (float, float, float) or (float, float, float, float)
        Origin of the surface in the base frame with the table at zero, mm, and its turn about z, rad.
    free : mapping
        Name -> values of a redundant freedom in every row (m,): "spin", the turn of the tool about its own
        axis, rad; "wrist_radius" of an `Arm`, mm; each axis that carries the work, see `mounted`, rad or mm.
    """

    branch: int
    placement: tuple[float, ...]
    free: Mapping[str, Floats] = field(default_factory=dict, compare=False)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Posture):
            return NotImplemented
        same_free = self.free.keys() == other.free.keys() and all(
            np.array_equal(self.free[name], other.free[name]) for name in self.free
        )
        return super().__eq__(other) is True and same_free

    def __hash__(self) -> int:
        return super().__hash__()

    @property
    def wrist_radius(self) -> float:
        """Former place of the wrist radius of an arm, mm."""
        warn("Posture.wrist_radius is now Posture.free['wrist_radius'], a row each", DeprecationWarning)
        return float(self.free["wrist_radius"][0])


def written(posture: Posture, columns: Container[Any] = ()) -> str:
    """JSON of a posture, without freedoms among the columns; one that never changes is one number."""
    free = {
        name: float(values[0]) if np.all(values == values[0]) else values.tolist()
        for name, values in posture.free.items()
        if name not in columns
    }
    return json.dumps({"branch": posture.branch, "placement": posture.placement, "free": free})


def posture_of_file(told: Any, rows: int, columns: Mapping[str, Floats]) -> Posture:
    """Posture of a file, with freedoms in columns; version 0.1.0 wrote wrist radius, branch and placement."""
    if isinstance(told, list):
        radius, branch, place = told
        told = {"branch": branch, "placement": place, "free": {"wrist_radius": radius}}
    free = {
        name: lasting(np.broadcast_to(np.asarray(value, dtype=float), (rows,)))
        for name, value in told["free"].items()
    }
    return Posture(int(told["branch"]), tuple(told["placement"]), free | dict(columns))
