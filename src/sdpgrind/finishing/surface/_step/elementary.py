"""Elementary surfaces of a STEP file: parameters of places in closed form, exact patches over a box.

Angles of the patches are parameters of rational quadratic arcs: within an arc of half angle h amid m,
``tan((phi - m) / 2) = tan(h / 2) s`` with s from -1 to 1; its knots are the angles at its ends.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.placements import moved, placement, seen_from
from sdpgrind.finishing.surface._step.splines import SplineNet

TYPES = ("PLANE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SPHERICAL_SURFACE", "TOROIDAL_SURFACE")
QUARTER = np.pi / 2  # chosen: longest arc of one span
TURN = 2 * np.pi
SLANT = 0.002  # mm, chosen: below the chord error of 0.005 mm that a polygon may have
_ROUND = 1e-9  # of a turn, chosen: rounding of an angle of the box


class Pole(NamedTuple):
    """A side of a surface that is one place: `place` of the parameter u (axis 0) or v (1)."""

    axis: int
    place: float


class Arcs(NamedTuple):
    """Arcs from the first to the last of `angles` (n + 1,): nodes (2n + 1, 2) on a circle of radius 1."""

    angles: Floats
    nodes: Floats
    weights: Floats

    @property
    def knots(self) -> Floats:
        """Knots of degree 2, whose places are the angles."""
        return np.concatenate([self.angles[:1], np.repeat(self.angles, 2), self.angles[-1:]])

    def parameters(self, angle: Floats) -> Floats:
        """Return the parameters at angles."""
        k = np.clip(np.searchsorted(self.angles, angle, side="right") - 1, 0, len(self.angles) - 2)
        low, high = self.angles[k], self.angles[k + 1]
        middle, half = (low + high) / 2, (high - low) / 2
        return np.asarray(middle + half * np.tan((angle - middle) / 2) / np.tan(half / 2))

    def angle(self, parameters: Floats) -> Floats:
        """Return the angles at parameters."""
        k = np.clip(np.searchsorted(self.angles, parameters, side="right") - 1, 0, len(self.angles) - 2)
        low, high = self.angles[k], self.angles[k + 1]
        middle, half = (low + high) / 2, (high - low) / 2
        return np.asarray(middle + 2 * np.arctan((parameters - middle) / half * np.tan(half / 2)))


def arcs(low: float, high: float) -> Arcs:
    """Return the fewest arcs of at most a quarter between two angles."""
    count = max(1, int(np.ceil((high - low) / QUARTER - _ROUND)))
    angles = np.linspace(low, high, count + 1)
    half = (high - low) / count / 2
    every = np.linspace(low, high, 2 * count + 1)
    weights = np.where(np.arange(2 * count + 1) % 2, np.cos(half), 1.0)
    return Arcs(angles, np.stack([np.cos(every), np.sin(every)], axis=-1) / weights[:, None], weights)


RING = arcs(0.0, TURN)


class Meaning(NamedTuple):
    """What a parameter of the file is here: times a unit; an angle may be one of the arcs of `RING` then."""

    unit: float = 1.0
    arcs: bool = False

    def from_file(self, told: Floats) -> Floats:
        """Return the parameters here."""
        here = np.asarray(told * self.unit)
        turns = np.floor(here / TURN) * TURN
        return RING.parameters(here - turns) + turns if self.arcs else here

    def to_file(self, here: Floats) -> Floats:
        """Return the parameters of the file."""
        turns = np.floor(here / TURN) * TURN
        return np.asarray((RING.angle(here - turns) + turns if self.arcs else here) / self.unit)


AS_TOLD = Meaning()


@dataclass(frozen=True)
class FlatSurface:
    """A plane, over lengths along the axes of its frame."""

    frame: Floats
    periods: tuple[float | None, float | None] = (None, None)
    poles: tuple[Pole, ...] = ()
    longest_step: float = np.inf

    def uv(self, points: Floats) -> Floats:
        """Return the parameters (n, 2) of points (n, 3)."""
        return seen_from(self.frame, points)[:, :2]

    def points(self, uv: Floats) -> Floats:
        """Return the points (n, 3), mm."""
        return moved(self.frame, np.column_stack([uv, np.zeros(len(uv))]))

    def net(self, box: Floats) -> SplineNet:
        """Return the net over a box [[u0, v0], [u1, v1]]."""
        (u0, v0), (u1, v1) = box
        corners = np.array([[[u0, v0, 0.0], [u0, v1, 0.0]], [[u1, v0, 0.0], [u1, v1, 0.0]]])
        knots = np.array([u0, u0, u1, u1]), np.array([v0, v0, v1, v1])
        return SplineNet((1, 1), moved(self.frame, corners), None, knots)

    def parameters(self, uv: Floats, box: Floats) -> Floats:
        """Return the parameters of the patch over a box at those of the surface."""
        return uv

    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]:
        """Return what the file's parameters are: lengths."""
        return Meaning(units.length), Meaning(units.length)


@dataclass(frozen=True)
class TurnedSurface:
    """A surface of revolution: radius and height along its profile, u the angle around the z axis.

    A straight profile has the radius `radius` + v `slope` at the height v; a round one runs at the angle v
    around a centre `offset` away from the axis.
    """

    frame: Floats
    radius: float
    slope: float = 0.0
    offset: float = 0.0
    round: bool = False

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Periods of both parameters, None without."""
        return TURN, TURN if self.round and self.offset else None

    @property
    def poles(self) -> tuple[Pole, ...]:
        """Places v where the profile meets the axis."""
        if self.round:
            return () if self.offset else (Pole(1, -QUARTER), Pole(1, QUARTER))
        return (Pole(1, -self.radius / self.slope),) if self.slope else ()

    @property
    def longest_step(self) -> float:
        """Greatest angle, rad, over which a straight line in angles is one in the patch's parameters, too.

        Between two angles d apart they differ by 0.46 d^2 / 8 at most (second derivative of the parameter
        at the end of a quarter), times the radius in mm.
        """
        return float(np.sqrt(8 * SLANT / (0.46 * (self.radius + self.offset))))

    def profile(self, v: Floats) -> tuple[Floats, Floats]:
        """Return radius and height at v."""
        if self.round:
            return self.offset + self.radius * np.cos(v), self.radius * np.sin(v)
        return self.radius + self.slope * v, v

    def uv(self, points: Floats) -> Floats:
        """Return the parameters (n, 2) of points (n, 3)."""
        x, y, z = seen_from(self.frame, points).T
        around, away = np.arctan2(y, x), np.hypot(x, y)
        return np.stack([around, np.arctan2(z, away - self.offset) if self.round else z], axis=-1)

    def points(self, uv: Floats) -> Floats:
        """Return the points (n, 3), mm."""
        away, height = self.profile(uv[:, 1])
        return moved(
            self.frame, np.stack([away * np.cos(uv[:, 0]), away * np.sin(uv[:, 0]), height], axis=-1)
        )

    def net(self, box: Floats) -> SplineNet:
        """Return the net over a box [[u0, v0], [u1, v1]]."""
        (u0, v0), (u1, v1) = box
        around = arcs(u0, u1)
        if self.round:
            along = arcs(v0, v1)
            away, height = (self.offset + self.radius * along.nodes[:, 0], self.radius * along.nodes[:, 1])
            weights, knots, degree = along.weights, along.knots, 2
        else:
            away, height = self.profile(np.array([v0, v1]))
            weights, knots, degree = np.ones(2), np.array([v0, v0, v1, v1]), 1
        ring = around.nodes[:, None, :] * away[:, None]
        nodes = np.concatenate([ring, np.broadcast_to(height[:, None], (*ring.shape[:2], 1))], axis=-1)
        both = np.outer(around.weights, weights)
        return SplineNet((2, degree), moved(self.frame, nodes), both, (around.knots, knots))

    def parameters(self, uv: Floats, box: Floats) -> Floats:
        """Return the parameters of the patch over a box at those of the surface."""
        (u0, v0), (u1, v1) = box
        v = arcs(v0, v1).parameters(uv[:, 1]) if self.round else uv[:, 1]
        return np.stack([arcs(u0, u1).parameters(uv[:, 0]), v], axis=-1)

    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]:
        """Return what the file's parameters are: an angle, and an angle or a height."""
        return Meaning(units.angle), Meaning(units.angle if self.round else units.length)


def elementary(file: StepFile, row: StepRow, units: StepUnits) -> FlatSurface | TurnedSurface:
    """Return an elementary surface, mm."""
    frame, scale = placement(file, row.reference(1), units.length), units.length
    if row.type == "PLANE":
        return FlatSurface(frame)
    radius = row.number_at(2) * scale
    if row.type == "CONICAL_SURFACE":
        return _cone(row, frame, radius, units.angle)
    if not radius > 0:
        raise row.refused(f"must have a radius > 0; got {radius:g} mm")
    if row.type == "CYLINDRICAL_SURFACE":
        return TurnedSurface(frame, radius)
    if row.type == "SPHERICAL_SURFACE":
        return TurnedSurface(frame, radius, round=True)
    inner = row.number_at(3) * scale
    if not 0 < inner < radius:
        raise row.refused(f"must have radii 0 < minor < major; got {inner:g} and {radius:g} mm")
    return TurnedSurface(frame, inner, offset=radius, round=True)


def _cone(row: StepRow, frame: Floats, radius: float, unit: float) -> TurnedSurface:
    if np.isnan(unit):
        raise row.refused("has an angle, and the file names no unit of angles; a unit is never guessed")
    half = row.number_at(3) * unit
    if not (radius >= 0 and 0 < abs(half) < QUARTER):
        raise row.refused(f"must have a radius >= 0 and a half angle below a quarter turn; got {half:g} rad")
    return TurnedSurface(frame, radius, slope=float(np.tan(half)))
