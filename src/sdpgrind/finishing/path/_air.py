"""Moves of the tool through the air: arcs off and onto the work, straight lines between them.

An arc is the quintic with place, direction and curvature of the path at the contact, and the direction of the
straight line without curvature at its other end. The tool goes on turning there as on the work, and
settles: with the share x of the arc's length L behind, its rotation vector is ``w L f(x) + w' L^2 g(x)`` for
the angular velocity w and its rate w' (a mm) at the contact, f' = (1 - x)^2 (1 + 2 x), g' = x (1 - x)^2; so
that rate and acceleration of the turn are continuous at the contact, and 0 at the other end.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._arc_length import ArcLength, arc_length
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._samples import Ints

NEAR = 0.1  # mm, chosen: distance of the frames from which the turn at a contact is found
FEW = 8  # chosen: share of a run that four of these distances may take, at most a half
OFF = 1e-6  # mm, chosen: least clearance in the air; an arc begins along the surface, below its tangent plane
GAUSS = 16  # chosen: Gauss points for the length of a quintic


class ContactEnd(NamedTuple):
    """End of a run: place, frame (3, 3) with feed, y, normal in columns, curvature vector, turn (2, 3).

    `turn`: angular velocity and its rate over the length into the air, in the frame, rad/mm and rad/mm^2.
    `way`: 1 where the air follows the path, -1 where the path follows the air.
    """

    place: Floats
    frame: Floats
    curvature: Floats
    turn: Floats
    way: int


class AirSamples(NamedTuple):
    """Places (m, 3), frames (m, 3, 3), curvature vectors (m, 3), clearance (m,), mm."""

    point: Floats
    frame: Floats
    curvature: Floats
    clearance: Floats


@dataclass(frozen=True, eq=False)
class AirMove:
    """A move through the air: a polynomial (6, 3) in t from 0 to 1, with frames and clearance.

    Frames turn from `frame` by the rotation vector of `turn` (2, 3): evenly where not `settling`.
    """

    coefficients: Floats
    frame: Floats
    turn: Floats
    foot: Floats
    normal: Floats
    clearance: float | None = None
    settling: bool = False
    back: bool = False

    @cached_property
    def _arc(self) -> ArcLength:
        none, whole = np.zeros(1), np.ones(1)
        size = float(np.abs(self.coefficients).max())
        return arc_length(self._speed, np.zeros(1, dtype=np.intp), none, whole, GAUSS, size)

    def _speed(self, piece: Ints, t: Floats) -> Floats:
        return np.asarray(np.linalg.norm(self._derivative(t, 1), axis=1))

    def _derivative(self, t: Floats, order: int) -> Floats:
        polynomial = np.polynomial.polynomial.polyder(self.coefficients, order)
        return np.asarray(np.polynomial.polynomial.polyval(t, polynomial).T)

    @property
    def is_crossing(self) -> bool:
        """Whether it leads from one height to another one, not down or up."""
        return self.clearance is not None

    @property
    def length(self) -> float:
        """Length, mm."""
        return self._arc.total

    def at(self, length: Floats) -> AirSamples:
        """Return samples at lengths (m,) from the start, mm."""
        t = self._arc.places(np.clip(length, 0.0, self.length))[1]
        point, first, second = (self._derivative(t, order) for order in range(3))
        speed = np.linalg.norm(first, axis=1)[:, None]
        along = first / speed
        bend = (second - np.sum(second * along, axis=1)[:, None] * along) / speed**2
        frames = Rotation.from_matrix(self.frame) * Rotation.from_rotvec(self._turned(length / self.length))
        height = np.maximum((point - self.foot) @ self.normal, OFF)
        clear = np.full(len(t), self.clearance) if self.clearance is not None else height
        return AirSamples(point, frames.as_matrix(), bend, clear)

    def _turned(self, share: Floats) -> Floats:
        """Rotation vectors (m, 3) at shares of the length behind."""
        x = (1 - share if self.back else share)[:, None]
        if not self.settling:
            return np.asarray(x * self.turn[0])
        f = x - x**3 + 0.5 * x**4
        g = x**2 / 2 - 2 * x**3 / 3 + x**4 / 4
        return np.asarray(self.length * f * self.turn[0] + self.length**2 * g * self.turn[1])


def contact_end(path: Path, way: int) -> ContactEnd:
    """Return the end (`way` 1) or the start (-1) of a path."""
    total, runs = path.length, path.sample(per_leg=1)
    last = runs.length[runs.run == (runs.run[-1] if way > 0 else 0)]
    near = min(NEAR, float(last[-1] - last[0]) / FEW)
    end = total if way > 0 else 0.0
    at = path.at(np.clip(end - way * near * np.arange(5), 0.0, total))
    frames = np.stack([at.tangent, np.cross(at.normal, at.tangent), at.normal], axis=-1)
    vectors = Rotation.from_matrix(frames[0].T @ frames[1:]).as_rotvec()
    # through 0 and four places behind: a polynomial in the way into the air
    places = -near * np.arange(1, 5)
    powers = np.linalg.solve(places[:, None] ** np.arange(1, 5), vectors)
    turn = np.stack([powers[0], 2 * powers[1]])
    return ContactEnd(at.point[0], frames[0], at.curvature_vector[0], turn, way)


def lifted_off(end: ContactEnd, lift: Lift) -> tuple[AirMove, AirMove]:
    """Return arc and straight line from a contact into the air."""
    along, normal = end.way * end.frame[:, 0], end.frame[:, 2]
    c, s = np.cos(lift.angle), np.sin(lift.angle)
    way = c * along + s * normal
    top = end.place + lift.radius * (s * along + (1 - c) * normal)
    pace = lift.radius * lift.angle
    arc = _quintic(end.place, pace * along, pace**2 * end.curvature, top, pace * way)
    settled = AirMove(arc, end.frame, end.turn, end.place, normal, settling=True)
    frame = settled.at(np.array([settled.length])).frame[0]
    line = _line(top, top + (lift.height - lift.rise) / s * way)
    return settled, AirMove(line, frame, np.zeros((2, 3)), end.place, normal)


def put_down(end: ContactEnd, lift: Lift) -> tuple[AirMove, AirMove]:
    """Return straight line and arc from the air to a contact: the way off, backwards."""
    arc, line = lifted_off(end, lift)
    return _backwards(line), _backwards(arc)


def across(before: AirMove, after: AirMove, height: float) -> AirMove | None:
    """Return the straight line between two heights; None where they are one place."""
    first, last = before.at(np.array([before.length])), after.at(np.zeros(1))
    if np.linalg.norm(last.point - first.point) < NEAR:
        return None
    vector = Rotation.from_matrix(first.frame[0].T @ last.frame[0]).as_rotvec()
    line, turn = _line(first.point[0], last.point[0]), np.stack([vector, np.zeros(3)])
    return AirMove(line, first.frame[0], turn, first.point[0], first.frame[0][:, 2], clearance=height)


def straight_down(before: AirMove, line: AirMove) -> AirMove:
    """Return the straight line down, begun where the line before ends, near its own start."""
    first, last = before.at(np.array([before.length])), line.at(np.array([line.length]))
    vector = Rotation.from_matrix(last.frame[0].T @ first.frame[0]).as_rotvec()
    turn = np.stack([vector, np.zeros(3)])
    return replace(line, coefficients=_line(first.point[0], last.point[0]), frame=last.frame[0], turn=turn)


def _quintic(p: Floats, v: Floats, a: Floats, q: Floats, w: Floats) -> Floats:
    """Coefficients (6, 3) from place, velocity, acceleration to place and velocity without acceleration."""
    d, e, f = q - p - v - 0.5 * a, w - v - a, -a
    return np.stack([p, v, 0.5 * a, 10 * d - 4 * e + 0.5 * f, -15 * d + 7 * e - f, 6 * d - 3 * e + 0.5 * f])


def _line(start: Floats, end: Floats) -> Floats:
    out = np.zeros((6, 3))
    out[0], out[1] = start, end - start
    return out


def _backwards(move: AirMove) -> AirMove:
    """Return a move from its end to its start."""
    t = np.polynomial.Polynomial([1.0, -1.0])
    powers = [(t**k).coef for k in range(6)]
    out = np.zeros_like(move.coefficients)
    for row, power in zip(move.coefficients, powers, strict=True):
        out[: len(power)] += power[:, None] * row
    return replace(move, coefficients=out, back=True)
