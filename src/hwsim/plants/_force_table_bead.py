"""Bead and disc as plain arrays for the compiled core of the force table."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats

_SPACING = 0.1  # mm; coarser contours are interpolated


@dataclass(frozen=True)
class Bead:
    """A contour on an even grid, and what it stands on."""

    x: Floats
    z: Floats
    parent: Floats

    @classmethod
    def of(cls, problem: Any) -> "Bead":
        """Put the bead of a pass problem on an even grid."""
        given = problem.bead
        x, z = np.asarray(given.x, dtype=float), np.asarray(given.z, dtype=float)
        even = np.linspace(x[0], x[-1], 1 + max(2, round((x[-1] - x[0]) / _SPACING)))
        parent = getattr(problem, "parent", None)
        ground = np.zeros(even.size) if parent is None else np.interp(even, parent.x, parent.z)
        return cls(even, np.interp(even, x, z), ground)

    @property
    def spacing(self) -> float:
        """Distance of the nodes, mm."""
        return float(self.x[1] - self.x[0])

    @property
    def length(self) -> float:
        """Length, mm."""
        return float(self.x[-1] - self.x[0])

    def mean(self, values: Floats) -> float:
        """Mean over the length of values at the nodes."""
        return float(np.trapezoid(values, self.x)) / self.length

    def height(self, z: Floats) -> float:
        """Mean height of a contour above the parent, mm."""
        return self.mean(z - self.parent)

    def overground(self, z: Floats) -> tuple[float, float]:
        """Mean over the length and greatest depth of what is missing below the parent, mm."""
        missing = np.maximum(self.parent - z, 0.0)
        return self.mean(missing), float(missing.max())


@dataclass(frozen=True)
class Disc:
    """A disc on its compliance."""

    radius: float
    relaxed_angle: float
    angles: Floats  # rad; wind-up
    torques: Floats  # N mm

    @classmethod
    def of(cls, disc: Any) -> "Disc":
        """Read a tilted disc: a table of torques against wind-up, or one stiffness."""
        table = getattr(disc, "compliance", None)
        if table is None:
            angles, torques = np.array([0.0, 1.0]), np.array([0.0, float(disc.rotational_stiffness)])
        else:
            angles, torques = (np.ascontiguousarray(each, dtype=float) for each in table)
        return cls(float(disc.model.disk_radius), float(disc.relaxed_angle), angles, torques)

    @property
    def stiffness(self) -> float:
        """Contact stiffness of the relaxed disc, N/mm (Brown (7.1b))."""
        return float(self.torques[1] / self.angles[1]) / self.radius**2
