"""Surfaces of a STEP file that a profile sweeps along a line or around an axis.

Both parameters are those of rational B-spline curves, the profile and a circle of four arcs or a line, so a
patch over a box is the product of a piece of each: exact, with the parameters of the whole surface.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.elementary import TURN, Meaning, Pole
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.placements import direction, frame, moved, point, seen_from
from sdpgrind.finishing.surface._step.profiles import profile
from sdpgrind.finishing.surface._step.rational import LEVEL, RationalCurve, nearest, ring
from sdpgrind.finishing.surface._step.splines import SplineNet

TYPES = ("SURFACE_OF_LINEAR_EXTRUSION", "SURFACE_OF_REVOLUTION")
AT_AXIS = 1e-7  # of the profile's extent, chosen: a place of it is on the axis, as for sides that are a pole
LOOKS = 33  # chosen: places in each span of a profile where it may cross the axis


@dataclass(frozen=True)
class ExtrudedSurface:
    """A profile moved along a direction (3,) of length 1; v in mm, in the file in `length` of its units."""

    profile: RationalCurve
    along: Floats
    length: float
    poles: tuple[Pole, ...] = ()
    longest_step: float = np.inf

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Periods of both parameters, None without."""
        return self.profile.period, None

    @property
    def domain(self) -> Floats:
        """Domain [[u0, v0], [u1, v1]], infinite where only loops bound it."""
        low, high = self.profile.ends
        return np.array([[low, -np.inf], [high, np.inf]])

    def uv(self, points: Floats) -> Floats:
        """Return the parameters (n, 2) of points (n, 3)."""
        u = nearest(self.profile, points, self._seen)
        return np.stack([u, (points - self.profile.points(u)) @ self.along], axis=-1)

    def _seen(self, places: Floats, rates: Floats) -> tuple[Floats, Floats]:
        """Places and derivatives as seen along the direction."""
        flat = np.eye(3) - np.outer(self.along, self.along)
        return places @ flat, rates @ flat

    def points(self, uv: Floats) -> Floats:
        """Return the points (n, 3), mm."""
        return self.profile.points(uv[:, 0]) + uv[:, 1:] * self.along

    def net(self, box: Floats) -> SplineNet:
        """Return the net over a box [[u0, v0], [u1, v1]]."""
        (u0, v0), (u1, v1) = box
        piece = self.profile.piece(u0, u1)
        weights = piece.nodes[:, 3:]
        points = (piece.nodes[:, :3] / weights)[:, None] + np.outer([v0, v1], self.along)
        return _net(
            (piece.degree, 1), points, weights * np.ones(2), (piece.knots, np.array([v0, v0, v1, v1])), box
        )

    def parameters(self, uv: Floats, box: Floats) -> Floats:
        """Return the parameters of the patch: those of the surface."""
        return uv

    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]:
        """Return what the file's parameters are."""
        return self.profile.meaning, Meaning(self.length * units.length)


@dataclass(frozen=True)
class RevolvedSurface:
    """A profile in the frame (4, 4) of its axis, turned around z; u is the parameter of `ring`."""

    frame: Floats
    profile: RationalCurve
    longest_step: float = np.inf

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Periods of both parameters, None without."""
        return TURN, self.profile.period

    @property
    def domain(self) -> Floats:
        """Domain [[u0, v0], [u1, v1]], infinite where only loops bound it."""
        low, high = self.profile.ends
        return np.array([[0.0, low], [TURN, high]])

    @cached_property
    def poles(self) -> tuple[Pole, ...]:
        """Places v where the profile meets the axis."""
        ends = np.array(self.profile.ends)
        if self.profile.endless:
            start, way = (each[0, :2] for each in self.profile.places(np.zeros(1)))
            ends = np.array([-(start @ way) / max(float(way @ way), 1e-300)])
        away = np.hypot(*self.profile.points(ends)[:, :2].T)
        return tuple(Pole(1, float(v)) for v, r in zip(ends, away, strict=True) if r <= self.at_axis)

    @property
    def at_axis(self) -> float:
        """Greatest distance from the axis, mm, of a place on it."""
        places = self.profile.nodes[:, :3] / self.profile.nodes[:, 3:]
        return AT_AXIS * float(np.linalg.norm(np.ptp(places, axis=0)))

    def uv(self, points: Floats) -> Floats:
        """Return the parameters (n, 2) of points (n, 3)."""
        there = seen_from(self.frame, points)
        v = nearest(self.profile, there, _meridian)
        turn = _angle(there) - _angle(self.profile.points(v))
        return np.stack([AROUND.meaning.from_file(turn), v], axis=-1)

    def points(self, uv: Floats) -> Floats:
        """Return the points (n, 3), mm."""
        turn, place = AROUND.points(uv[:, 0]), self.profile.points(uv[:, 1])
        return moved(self.frame, _turned(turn, place))

    def net(self, box: Floats) -> SplineNet:
        """Return the net over a box [[u0, v0], [u1, v1]]."""
        (u0, v0), (u1, v1) = box
        turn, piece = AROUND.piece(u0, u1), self.profile.piece(v0, v1)
        around, along = turn.nodes[:, 3:], piece.nodes[:, 3]
        places = _turned((turn.nodes / around)[:, None, :3], piece.nodes[None, :, :3] / along[:, None])
        return _net(
            (2, piece.degree), moved(self.frame, places), around * along, (turn.knots, piece.knots), box
        )

    def parameters(self, uv: Floats, box: Floats) -> Floats:
        """Return the parameters of the patch: those of the surface."""
        return uv

    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]:
        """Return what the file's parameters are."""
        return Meaning(units.angle, arcs=True), self.profile.meaning


AROUND = ring(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 1.0)


def _angle(places: Floats) -> Floats:
    return np.asarray(np.arctan2(places[:, 1], places[:, 0]))


def _turned(turn: Floats, place: Floats) -> Floats:
    """Places (..., 3) turned about z from x to `turn`; linear in both, so of control points, too."""
    (c, s), (x, y, z) = (turn[..., k] for k in (0, 1)), (place[..., k] for k in (0, 1, 2))
    return np.stack(np.broadcast_arrays(c * x - s * y, s * x + c * y, z), axis=-1)


def _meridian(places: Floats, rates: Floats) -> tuple[Floats, Floats]:
    """Distance from the z axis and height, with their derivatives; at the axis it is that away from it."""
    away = np.hypot(places[:, 0], places[:, 1])
    radial = np.sum(places[:, :2] * rates[:, :2], axis=1)
    at_axis = np.hypot(rates[:, 0], rates[:, 1])
    rate = np.divide(radial, away, out=at_axis, where=away > 0)
    return np.stack([away, places[:, 2]], axis=-1), np.stack([rate, rates[:, 2]], axis=-1)


def _net(
    degree: tuple[int, int], points: Floats, weights: Floats, knots: tuple[Floats, Floats], box: Floats
) -> SplineNet:
    """Net over a box, whose ends the knots have to the last bit."""
    ends = [
        np.where(k == k[0], low, np.where(k == k[-1], high, k))
        for k, low, high in zip(knots, *box, strict=True)
    ]
    return SplineNet(degree, points, None if np.all(weights == 1.0) else weights, (ends[0], ends[1]))


def swept(file: StepFile, row: StepRow, units: StepUnits) -> ExtrudedSurface | RevolvedSurface:
    """Return a surface of linear extrusion or of revolution, mm."""
    told = profile(file, row.reference(1), units)
    if row.type == TYPES[1]:
        return _revolved(file, row, told, units.length)
    way = file.row(row.reference(2), "VECTOR")
    along = direction(file, way.reference(1))
    if told.endless and np.linalg.norm(np.cross(told.places(np.zeros(1))[1][0], along)) < LEVEL:
        raise row.refused("must move its line aside, not along itself")
    return ExtrudedSurface(told, along, way.number_at(2))


def _revolved(file: StepFile, row: StepRow, told: RationalCurve, scale: float) -> RevolvedSurface:
    axis = file.row(row.reference(2), "AXIS1_PLACEMENT")
    number = axis.optional_reference(2)
    z = np.array([0.0, 0.0, 1.0]) if number is None else direction(file, number)
    beside = np.eye(3)[np.argmin(np.abs(z))]
    axes = frame(axis, point(file, axis.reference(1), scale), z, beside)
    places = seen_from(axes, told.nodes[:, :3] / told.nodes[:, 3:])
    nodes = np.column_stack([places, np.ones(len(places))]) * told.nodes[:, 3:]
    found = RevolvedSurface(axes, replace(told, nodes=nodes))
    _refuse_crossing(row, found)
    return found


def _refuse_crossing(row: StepRow, surface: RevolvedSurface) -> None:
    """Refuse a profile on both sides of its axis: it sweeps places twice, and no face tells by which side."""
    line = surface.profile
    if line.endless:
        crossing = abs(line.places(np.zeros(1))[1][0, 2]) < LEVEL
    else:
        t = np.unique(np.linspace(line.breaks[:-1], line.breaks[1:], LOOKS))
        side = line.points(t)[:, :2]
        side = side[np.hypot(*side.T) > surface.at_axis]
        crossing = bool(np.any(np.sum(side[1:] * side[:-1], axis=1) < 0))
    if crossing:
        raise row.refused("must have a profile on one side of its axis; trim the profile there")
