"""Bead and disc as plain arrays for the compiled core of the force table."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.passes import PassProblem, TiltedDisc
from sdpgrind.weldbead.passes.kernels import Bead as Metal

# distance between nodes, mm; chosen: between them the tip dips by up to this times the slope of the disc
SPACING = 0.05
FINE = 0.01  # mm, with grinder inertia; chosen: larger dips make the grinder ring


@dataclass(frozen=True)
class GroundBead:
    """A contour on even nodes, and the parent metal below."""

    x: Floats
    z: Floats
    parent: Floats

    @classmethod
    def of(cls, problem: PassProblem, spacing: float = SPACING) -> Self:
        """Put the bead of a pass problem on even nodes."""
        bead, parent = problem.bead, problem.parent
        x = np.linspace(bead.x[0], bead.x[-1], 1 + max(10, round(bead.length / spacing)))
        return cls(x, bead.at(x), np.zeros(x.size) if parent is None else parent.at(x))

    @property
    def spacing(self) -> float:
        """Distance between nodes, mm."""
        return float(self.x[1] - self.x[0])

    @property
    def length(self) -> float:
        """Length, mm."""
        return float(self.x[-1] - self.x[0])

    def metal(self, z: Floats, width: float) -> Metal:
        """Metal for the compiled core, which changes `z` in place."""
        area = np.full(z.size, self.spacing * width)
        area[[0, -1]] *= 0.5
        return Metal(float(self.x[0]), self.spacing, z, area, np.maximum.accumulate(z[::-1])[::-1].copy())

    def mean(self, values: Floats) -> float:
        """Mean over the length of nodal values."""
        return float(np.trapezoid(values, self.x)) / self.length

    def height(self, z: Floats) -> float:
        """Mean height of a contour above the parent, mm."""
        return self.mean(z - self.parent)

    def overground(self, z: Floats) -> tuple[float, float]:
        """Mean and maximum depth below the parent, mm."""
        missing = np.maximum(self.parent - z, 0.0)
        return self.mean(missing), float(missing.max())


def reach(disc: TiltedDisc) -> float:
    """Distance along the bead from the tip to the centre of the relaxed disc, mm."""
    return float(disc.model.disk_radius * np.cos(disc.relaxed_angle))


def drop(disc: TiltedDisc) -> float:
    """Height of the centre of the relaxed disc above its tip, mm."""
    return float(disc.model.disk_radius * np.sin(disc.relaxed_angle))
