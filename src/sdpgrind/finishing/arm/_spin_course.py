"""Smooth turns of a tool along a path: a cubic spline near those of the sweep, with little motion of joints.

Least is the sum of the squares of dq/ds over the greatest speeds. With knots 10 mm apart the turn cannot
follow corners, whose change of direction the joints then take: measured on a sphere of 25 mm, laws of limited
jerk were up to 9 % slower than with a tool that is held, and are 1 to 12 % faster with knots 0.5 mm apart. A
sharp corner may be one of the turn, too, as the tool rests there.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack
from scipy.sparse.linalg import spsolve

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm import _serial_kernels as kernels
from sdpgrind.finishing.arm._inverse import SLACK
from sdpgrind.finishing.arm._robot import middle
from sdpgrind.finishing.arm._spin_states import SpinStates
from sdpgrind.finishing.arm._spin_sweep import SINGULAR, distance_of

SPACING = 0.5  # mm, measured: see above; two samples of a path or more
KINK = 1.0  # mm, chosen: least distance of corners of the turn, so that pieces have more samples than knots
STEPS = 12  # chosen: limit of the iteration; three to six are taken
_ROUNDS = 6  # chosen: of coefficients left out at the ends of their range; two or three are taken
_DONE = 1e-5  # chosen: relative gain of a step that is none
_TINY = 1e-4  # chosen: share of a freedom's range (of a turn) for differences; their error is some 1e-8
_INSIDE = 2e-4  # chosen: share of a range by which limits are approached from inside
_WEIGHTS = (
    1.0,
    30.0,
    1e3,
    3e4,
    1e6,
    1e8,
)  # chosen: of squared excess against motion, raised till it is gone
_RIDGE = 1e-9  # chosen: share of the normal matrix that leaves a solution where a freedom moves no joint


class SmoothCourse(NamedTuple):
    """Values of the freedoms as splines over arc length (f,), and joints (m, n) that follow from them."""

    splines: tuple[BSpline, ...]
    joints: Floats


class _TriedCourse(NamedTuple):
    """Coefficients (p, f) of the free values, joints (m, n), values (m, f), motion, and excess."""

    coefficients: Floats
    joints: Floats
    values: Floats
    motion: float
    excess: float


class CourseTask:
    """Splines over the length of a path for the freedoms of a robot, in one of its groups."""

    def __init__(self, states: SpinStates, poses: Floats, length: Floats, group: int) -> None:
        self.states, self.poses, self.length, self.group = states, poses, length, group
        robot = states.robot
        self.turns, self.middle = states.wound, middle(robot)
        self.low, self.high = (np.array(each, float) for each in (robot.position_min, robot.position_max))
        self.speed = np.array(robot.speed_max, dtype=float)
        self.least, self.most = states.values.min(axis=0), states.values.max(axis=0)
        self.free = np.flatnonzero(self.most > self.least)
        self.range = np.where(self.most > self.least, self.most - self.least, 1.0)
        turns = states.around
        self.least[turns], self.most[turns], self.range[turns] = -np.inf, np.inf, 2 * np.pi
        self.knots, self.basis = _basis(length)
        step = np.diff(length)
        self.moved = np.flatnonzero(step > 0)
        self.weight = 1.0 / np.sqrt(step[self.moved])

    def held(self, values: Floats) -> SmoothCourse | None:
        """Return the course at constant values (m, f); None: it leaves the limits between the stations."""
        found = self._tried(_fitted(self.basis, values))
        return self._course(found) if found.excess == 0.0 else None

    def smoothed(self, values: Floats) -> SmoothCourse | None:
        """Return the course near values (m, f), of little motion and within limits; None: there is none.

        Where the least motion leaves the limits, they count little at first, and more from round to round:
        held to them from the beginning, steps of the values stay.
        """
        start = self._tried(_fitted(self.basis, values))
        found = self._descended(start, 0.0)
        if not _kept(found):
            found = start
            for weight in _WEIGHTS:
                found = self._descended(found, weight)
                if _kept(found):
                    break
        kept = [each for each in (start, found) if _kept(each)]
        return self._course(min(kept, key=lambda each: each.motion)) if kept else None

    def _course(self, found: _TriedCourse) -> SmoothCourse:
        columns = found.coefficients.T
        return SmoothCourse(tuple(BSpline(self.knots, column, 3) for column in columns), found.joints)

    def _descended(self, start: _TriedCourse, weight: float) -> _TriedCourse:
        """Take damped Gauss-Newton steps."""
        if not self.free.size or not np.isfinite(start.motion):
            return start
        scale = max(start.motion, 1e-300)
        now = start
        for _ in range(STEPS):
            step = self._step(now, weight * scale)
            then = self._shorter(now, step, weight * scale)
            gain = self._merit(now, weight * scale) - self._merit(then, weight * scale)
            now = then
            if gain <= _DONE * scale:
                break
        return now

    def _merit(self, tried: _TriedCourse, weight: float) -> float:
        return tried.motion + weight * tried.excess

    def _shorter(self, now: _TriedCourse, step: Floats, weight: float) -> _TriedCourse:
        """The longest of some halved steps that gains."""
        least = self._merit(now, weight)
        for share in 0.5 ** np.arange(8):
            then = self._tried(now.coefficients + share * step)
            if self._merit(then, weight) < least:
                return then
        return now

    def _tried(self, coefficients: Floats) -> _TriedCourse:
        """Joints and their motion with coefficients (p, f), kept in their range: then values are, too."""
        coefficients = np.clip(coefficients, self.least, self.most)
        values = self.basis @ coefficients
        joints = self._joints(values)
        if np.isnan(joints).any():
            return _TriedCourse(coefficients, joints, values, np.inf, np.inf)
        kernels.follow(joints, self.turns, self.middle)
        motion = float((self._rates(joints) ** 2).sum())
        excess = sum(float((each**2).sum()) for each in self._excesses(joints))
        return _TriedCourse(coefficients, joints, values, motion, excess)

    def _joints(self, values: Floats) -> Floats:
        return np.ascontiguousarray(self.states.solved(self.poses, values)[:, self.group])

    def _rates(self, joints: Floats) -> Floats:
        """Changes of the joints over the root of the length, and over their greatest speeds."""
        out: Floats = np.diff(joints, axis=0)[self.moved] * self.weight[:, None] / self.speed
        return out

    def _excesses(self, joints: Floats, inside: float = 0.0) -> tuple[Floats, Floats]:
        """Shares by which joints (m, n) and the singular distance (m, 1) leave their ranges."""
        span, slack = self.high - self.low, SLACK / (self.high - self.low)
        of_joints = _beyond((joints - self.low) / span, -slack, 1.0 + slack, inside)
        of_pose = _beyond(distance_of(self.states.robot, joints)[:, None], SINGULAR, np.inf, inside)
        return of_joints, of_pose

    def _slopes(self, tried: _TriedCourse) -> tuple[Floats, Floats]:
        """Derivatives of joints (m, n, f) and of the singular distance (m, f) over the free values."""
        tiny, joints = _TINY * self.range, np.zeros((*tried.joints.shape, len(self.free)))
        pose = np.zeros((len(joints), len(self.free)))
        for k, which in enumerate(self.free):
            shift = np.zeros_like(self.range)
            shift[which] = tiny[which]
            after, before = (self._joints(tried.values + sign * shift) for sign in (1.0, -1.0))
            way = after - before
            way = np.where(self.turns, way - 2 * np.pi * np.round(way / (2 * np.pi)), way)
            joints[:, :, k] = np.nan_to_num(way) / (2 * tiny[which])
            ends = [distance_of(self.states.robot, np.nan_to_num(each)) for each in (after, before)]
            pose[:, k] = (ends[0] - ends[1]) / (2 * tiny[which])
        return joints, pose

    def _step(self, now: _TriedCourse, weight: float) -> Floats:
        """Gauss-Newton step of the coefficients (p, f)."""
        joints, pose = self._slopes(now)
        rows, left = [], []
        rates = self._rates(now.joints)
        for j in range(joints.shape[1]):
            moved = self._spread(joints[:, j])
            change = (moved[1:] - moved[:-1])[self.moved]
            rows.append(diags_array(self.weight / self.speed[j]) @ change)
            left.append(rates[:, j])
        if weight > 0.0:
            root = np.sqrt(weight)
            for slopes, excess in self._pushed(now, joints, pose):
                on = np.flatnonzero(excess)
                rows.append(root * self._spread(slopes)[on])
                left.append(root * excess[on])
        matrix, right = vstack(rows).tocsr(), np.concatenate(left)
        return self._solved(now, matrix.T @ matrix, -(matrix.T @ right))

    def _solved(self, now: _TriedCourse, normal: csr_array, right: Floats) -> Floats:
        """Step (p, f) of the normal equations, without coefficients that it would push out of their range."""
        given = now.coefficients[:, self.free]
        low, high = given <= self.least[self.free], given >= self.most[self.free]
        ridge = _RIDGE * max(float(normal.diagonal().max()), 1e-300)
        system = (normal + ridge * eye_array(normal.shape[0])).tocsr()
        open_, step = np.ones(right.size, dtype=bool), np.zeros(right.size)
        for _ in range(_ROUNDS):
            step[:] = 0.0
            step[open_] = spsolve(system[open_][:, open_].tocsc(), right[open_])
            out = step.reshape(len(self.free), -1).T
            pushed = ((low & (out < 0.0)) | (high & (out > 0.0))).T.ravel() & open_
            if not pushed.any():
                break
            open_ &= ~pushed
        whole = np.zeros_like(now.coefficients)
        whole[:, self.free] = step.reshape(len(self.free), -1).T
        return whole

    def _pushed(self, now: _TriedCourse, joints: Floats, pose: Floats) -> list[tuple[Floats, Floats]]:
        """Slopes (m, f) and signed excess (m,) of joints and singular distance, approached from inside."""
        of_joints, of_pose = self._excesses(now.joints, _INSIDE)
        span = self.high - self.low
        found = [(joints[:, j] / span[j], of_joints[:, j]) for j in range(joints.shape[1])]
        return [*found, (pose, of_pose[:, 0])]

    def _spread(self, slopes: Floats) -> csr_array:
        """Slopes (m, f) over values as rows over the coefficients of all free values."""
        return hstack([diags_array(column) @ self.basis for column in slopes.T]).tocsr()


def _kept(tried: _TriedCourse) -> bool:
    """Whether a course keeps the limits."""
    return tried.excess == 0.0 and bool(np.isfinite(tried.motion))


def _beyond(value: Floats, low: Floats | float, high: Floats | float, inside: float) -> Floats:
    """Signed excess of a value beyond its range: negative below."""
    out: Floats = np.maximum(value - high + inside, 0.0) + np.minimum(value - low - inside, 0.0)
    return out


def _basis(length: Floats) -> tuple[Floats, csr_array]:
    """Knots of a cubic spline over a path with its corners, and its basis at the samples (m, p)."""
    knots: Floats = np.concatenate([[length[0]] * 4, *_inner(length), [length[-1]]])
    return knots, csr_array(BSpline.design_matrix(length, knots, 3))


def _inner(length: Floats) -> Iterator[list[float]]:
    """Knots of each piece between corners, `SPACING` or more apart; three at its end let the turn bend."""
    ends = [float(length[0])]
    for corner in length[:-1][np.diff(length) <= 0]:
        if corner - ends[-1] >= KINK and length[-1] - corner >= KINK:
            ends.append(float(corner))
    for start, end in pairwise([*ends, float(length[-1])]):
        pieces = max(1, int((end - start) / SPACING))
        yield [*np.linspace(start, end, pieces + 1)[1:-1].tolist(), end, end, end]


def _fitted(basis: csr_array, values: Floats) -> Floats:
    """Coefficients (p, f) of least squares through values (m, f)."""
    normal = basis.T @ basis
    ridge = _RIDGE * float(normal.diagonal().max())
    system = (normal + ridge * eye_array(normal.shape[0])).tocsc()
    shift = values[:1]  # so that a constant is met exactly
    return np.column_stack([spsolve(system, basis.T @ column) for column in (values - shift).T]) + shift
