"""Closed form of a robot's inverse, found from the axes of its joints: spherical wrist, or parallel axes."""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm import _serial_kernels as kernels
from sdpgrind.finishing.arm._links import row

# rad, mm; chosen: a robot that is off by less reaches a pose to 1e-6 mm at 1 m
CROOKED, APART = 1e-9, 1e-6
# rad, mm; chosen: what angles of four decimals (1.5708) leave at two joints and a link of 1 m; solutions are
# polished on the chain itself then
ROUNDED, SHIFTED = 2e-4, 0.2
# rad, mm; chosen: twice what calibrations by 2 mrad and 1 mm in each entry leave; solutions are numeric then
TILTED, MOVED = 5e-3, 5.0
WIDER = 30.0  # mm, chosen: thrice what calibrations by 2 mrad and 1 mm in each entry move an arm of 1 m
SHORTEST = 1e-3  # mm, chosen: a shorter link makes no elbow


class Screws(NamedTuple):
    """Axes of the joints at joints of zero: directions (n, 3), points on them (n, 3), mm; and the flange."""

    directions: Floats
    points: Floats
    flange: Floats


class ClosedForm(NamedTuple):
    """Constants of a closed form; see `_serial_kernels`.

    Angles are ``zeros + signs * joints``; `lengths` are a1, a2, a3, a4, e, d5, mm; a pose of the flange is
    ``before^-1 @ inner @ behind^-1``; `crooked` turns the frame of link 3 into that of the wrist. `near`: the
    axes keep the rules but for the rounding of a file, or, `calibrated`, but for a calibration, so the
    constants are those of a robot nearby.
    """

    wrist: bool
    before: Floats
    behind: Floats
    lengths: tuple[float, float, float, float, float, float]
    crooked: Floats
    zeros: Floats
    signs: Floats
    near: bool = False
    calibrated: bool = False

    @property
    def reach(self) -> float:
        """Length of both links of the arm, mm."""
        return self.lengths[1] + self.lengths[2]

    def solve(self, poses: Floats, middle: Floats) -> tuple[Floats, Floats]:
        """Joints of all branches (m, 8, 6) of poses of the flange, and mm out of reach (m, 8)."""
        out = np.empty((len(poses), kernels.BRANCHES, 6))
        beyond = np.empty((len(poses), kernels.BRANCHES))
        kernels.inverse(
            poses, self.wrist, self.before, self.behind, self.lengths, self.crooked, self.zeros, self.signs,
            middle, out, beyond,
        )  # fmt: skip
        return out, beyond

    def links(self) -> Floats:
        """Links (7, 4, 4) of the robot that has this form, mm; see `_serial_kernels` for its frames."""
        a1, a2, a3, a4, offset, d5 = self.lengths
        up = row(0.0, 0.0, 0.0, math.pi / 2)
        third = row(0.0, offset, a3, 0.0)
        if self.wrist:
            third[:3, :3] = self.crooked.T
        fourth = up if self.wrist else row(0.0, 0.0, a4, math.pi / 2) @ row(0.0, d5, 0.0, 0.0)
        after = [
            inverted(self.before), row(0.0, 0.0, a1, math.pi / 2), row(0.0, 0.0, a2, 0.0), third, fourth,
            up.T, inverted(self.behind),
        ]  # fmt: skip
        for k, (zero, sign) in enumerate(zip(self.zeros, self.signs, strict=True)):
            flip = np.diag([1.0, sign, sign, 1.0])  # Rz(zero + sign q) = Rz(zero) flip Rz(q) flip
            after[k], after[k + 1] = after[k] @ row(zero, 0.0, 0.0, 0.0) @ flip, flip @ after[k + 1]
        return np.stack(after)

    def farther(self) -> tuple[Self, Self]:
        """Forms that reach farther, out and in; in the second axis 2 is nearer to axis 1, too.

        So both elbows have a start, on their sides of the straight arm, where only the chain itself reaches.
        """
        a1, a2, a3, a4, offset, d5 = self.lengths
        apart = min(WIDER, abs(a2 - a3))  # the shorter link grows by this, and then both
        both = (WIDER - apart) / 2
        second, third = (apart, 0.0) if a2 < a3 else (0.0, apart)
        out = self._replace(lengths=(a1, a2 + both + second, a3 + both + third, a4, offset, d5))
        across = math.copysign(max(0.0, abs(offset) - WIDER), offset)
        return out, out._replace(lengths=(*out.lengths[:4], across, d5))

    def singularities(self, joints: Floats) -> dict[str, Floats]:
        """Factors of the determinant of the Jacobian, unit 1: rho over the reach, |sin 3|, |sin 5|."""
        angles = self.zeros + self.signs * joints
        second, third = angles[..., 1], angles[..., 1] + angles[..., 2]
        fourth = third + angles[..., 3]
        a1, a2, a3, a4, _, d5 = self.lengths
        rho = a1 + a2 * np.cos(second) + a3 * np.cos(third)
        if not self.wrist:
            rho = rho + a4 * np.cos(fourth) + d5 * np.sin(fourth)
        return {
            "shoulder": np.abs(rho) / self.reach,
            "elbow": np.abs(np.sin(angles[..., 2])),
            "wrist": np.abs(np.sin(angles[..., 4])),
        }


class _Rule(NamedTuple):
    """A rule for axes (numbers from 1), and its error; 0: kept."""

    axes: tuple[int, ...]
    words: str
    off: float
    unit: str
    exact: bool = False  # asked of robots nearby, too

    @property
    def kept(self) -> bool:
        return self.off <= (CROOKED if self.unit == "rad" else APART)

    def within(self, angle: float, length: float) -> bool:
        """Whether it is kept to an angle, rad, or a length, mm."""
        return self.kept or (not self.exact and self.off <= (angle if self.unit == "rad" else length))


def closed_form(screws: Screws) -> ClosedForm | str:
    """Return the closed form of six axes, or the sentence that tells what breaks both."""
    wrist, parallel = _wrist_rules(screws), _parallel_rules(screws)
    for angle, length in ((CROOKED, APART), (ROUNDED, SHIFTED), (TILTED, MOVED)):
        for rules, of in ((wrist, _of_wrist), (parallel, _of_parallel)):
            if all(rule.within(angle, length) for rule in rules):
                return of(screws)._replace(near=angle > CROOKED, calibrated=angle > ROUNDED)
    return f"a spherical wrist ({_told(wrist)}), or axes 2, 3, 4 parallel ({_told(parallel)})"


def _told(rules: Sequence[_Rule]) -> str:
    """Sentence on the rules that are broken by more than a calibration."""
    broken = [
        f"axes {', '.join(map(str, rule.axes))} must {rule.words}, off by {rule.off:.3g} {rule.unit}"
        for rule in rules
        if not rule.within(TILTED, MOVED)
    ]
    return "; ".join(broken)


def _wrist_rules(screws: Screws) -> list[_Rule]:
    w = screws.directions
    at, apart = _meeting(screws, 3, 4)
    further = np.linalg.norm(np.cross(at - screws.points[5], w[5]))
    return [
        _upright(w, 1, 2),
        _along(w, 2, 3),
        _upright(w, 4, 5),
        _upright(w, 5, 6),
        _Rule((4, 5, 6), "meet in a point", max(apart, float(further)), "mm"),
        _Rule((2, 3), "be apart", _too_near(screws, 1, screws.points[2]), "mm", True),
        _Rule((3, 4), "be apart where axis 5 crosses", _too_near(screws, 2, at), "mm", True),
    ]


def _parallel_rules(screws: Screws) -> list[_Rule]:
    w = screws.directions
    return [
        _upright(w, 1, 2),
        _along(w, 2, 3),
        _along(w, 3, 4),
        _upright(w, 4, 5),
        _upright(w, 5, 6),
        _Rule((5, 6), "meet in a point", _meeting(screws, 4, 5)[1], "mm"),
        _Rule((2, 3), "be apart", _too_near(screws, 1, screws.points[2]), "mm", True),
        _Rule((3, 4), "be apart", _too_near(screws, 2, screws.points[3]), "mm", True),
    ]


def _upright(w: Floats, one: int, other: int) -> _Rule:
    return _Rule((one, other), "be perpendicular", abs(float(w[one - 1] @ w[other - 1])), "rad")


def _along(w: Floats, one: int, other: int) -> _Rule:
    off = float(np.linalg.norm(np.cross(w[one - 1], w[other - 1])))
    return _Rule((one, other), "be parallel", off, "rad")


def _meeting(screws: Screws, one: int, other: int) -> tuple[Floats, float]:
    """Point of axis `one` nearest to axis `other` (indices), and their distance, mm; inf if parallel."""
    (p, q), (v, w) = screws.points[[one, other]], screws.directions[[one, other]]
    across = np.cross(v, w)
    size = float(across @ across)
    if size < CROOKED:
        return p, math.inf
    along = float(np.cross(q - p, w) @ across) / size
    return p + along * v, abs(float((q - p) @ across)) / math.sqrt(size)


def _too_near(screws: Screws, axis: int, point: Floats) -> float:
    """Length that a link from an axis (index) to a point lacks, mm; 0: long enough."""
    distance = np.linalg.norm(np.cross(point - screws.points[axis], screws.directions[axis]))
    return max(0.0, SHORTEST - float(distance))


class _Plane(NamedTuple):
    """Directions x_1, y_1, z_1 behind the first joint (rows), foot of axis 2 on axis 1, and on axis 2."""

    turn: Floats
    foot: Floats
    start: Floats


def _plane(screws: Screws) -> _Plane:
    first, second = screws.directions[0], screws.directions[1]
    across = _unit(second - (second @ first) * first)
    foot = _meeting(screws, 0, 1)[0]
    start = _meeting(screws, 1, 0)[0]
    return _Plane(np.stack([np.cross(first, across), first, across]), foot, start)


def _unit(vector: Floats) -> Floats:
    out: Floats = vector / np.linalg.norm(vector)
    return out


def _azimuth(plane: _Plane, way: Floats) -> tuple[float, float]:
    """Length of a way in the plane of the arm, mm, and its angle from x_1, rad."""
    x, y = float(plane.turn[0] @ way), float(plane.turn[1] @ way)
    return math.hypot(x, y), math.atan2(y, x)


def _frame(x: Floats, z: Floats, origin: Floats) -> Floats:
    """Frame (4, 4) of two directions and an origin, mm."""
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, np.cross(z, x), z, origin
    return out


def inverted(frame: Floats) -> Floats:
    """Return the inverse of a rigid motion (4, 4)."""
    out = np.eye(4)
    out[:3, :3] = frame[:3, :3].T
    out[:3, 3] = -frame[:3, :3].T @ frame[:3, 3]
    return out


def _of_wrist(screws: Screws) -> ClosedForm:
    """Constants of the spherical form: the second link ends where axes 4, 5, 6 meet."""
    plane, w = _plane(screws), screws.directions
    x1, up, z1 = plane.turn
    centre = _meeting(screws, 3, 4)[0]
    a2, second = _azimuth(plane, screws.points[2] - plane.start)
    a3, third = _azimuth(plane, centre - screws.points[2])
    # frame of link 3 with x towards the wrist; frames of the wrist with x_4 = z_3 x z_4 at joint 4 of 0
    link = np.stack(
        [math.cos(third) * x1 + math.sin(third) * up, math.cos(third) * up - math.sin(third) * x1, z1]
    )
    z3, z4 = w[3], _unit(w[4] - (w[4] @ w[3]) * w[3])
    x4 = np.cross(z3, z4)
    wrist = np.stack([x4, np.cross(z3, x4), z3])
    z5 = _unit(w[5] - (w[5] @ z4) * z4)
    x5 = np.cross(z5, z4)
    return ClosedForm(
        True,
        inverted(_frame(x1, plane.turn[1], plane.foot)),
        inverted(inverted(_frame(x5, z5, centre)) @ screws.flange),
        (_a1(plane), a2, a3, 0.0, float((centre - plane.foot) @ z1), 0.0),
        wrist @ link.T,
        np.array([0.0, second, third - second, 0.0, _turned(x4, x5, z4), 0.0]),
        np.array([1.0, 1.0, _side(w[2], z1), 1.0, 1.0, 1.0]),
    )


def _of_parallel(screws: Screws) -> ClosedForm:
    """Constants of the form with parallel axes: two links to axis 4, one along axis 5 to axis 6."""
    plane, w = _plane(screws), screws.directions
    x1, up, z1 = plane.turn
    centre = _meeting(screws, 4, 5)[0]
    a2, second = _azimuth(plane, screws.points[2] - plane.start)
    a3, third = _azimuth(plane, screws.points[3] - screws.points[2])
    z4 = _unit(w[4] - (w[4] @ z1) * z1)
    x4 = np.cross(z1, z4)
    fourth = math.atan2(x4 @ up, x4 @ x1)
    z5 = _unit(w[5] - (w[5] @ z4) * z4)
    x5 = np.cross(z5, z4)
    last = centre - screws.points[3]
    return ClosedForm(
        False,
        inverted(_frame(x1, plane.turn[1], plane.foot)),
        inverted(inverted(_frame(x5, z5, centre)) @ screws.flange),
        (_a1(plane), a2, a3, float(last @ x4), float((centre - plane.foot) @ z1), float(last @ z4)),
        np.eye(3),
        np.array([0.0, second, third - second, fourth - third, _turned(x4, x5, z4), 0.0]),
        np.array([1.0, 1.0, _side(w[2], z1), _side(w[3], z1), 1.0, 1.0]),
    )


def _a1(plane: _Plane) -> float:
    return float((plane.start - plane.foot) @ plane.turn[0])


def _side(direction: Floats, axis: Floats) -> float:
    return 1.0 if direction @ axis > 0 else -1.0


def _turned(start: Floats, end: Floats, axis: Floats) -> float:
    """Angle from one direction to another about an axis, rad."""
    return math.atan2(float(np.cross(start, end) @ axis), float(start @ end))
