"""Axes that carry the work: a turntable, and a table that slides."""

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY
from typing import Any, Protocol

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.finishing.arm._chain_checks import check_away, check_range

MOST = 720  # chosen: candidates of half a degree; more are beyond what is smoothed afterwards
_SAME = 1e-9  # rad or mm, chosen: candidates nearer than this are one
_ROUNDING = 1e-15  # derived: of a length of 1
_SHORTEST = 5.0  # mm, chosen: a travel below is in metres


class WorkAxis(Protocol):
    """What a robot asks of an axis that carries the work: rad or mm, s."""

    @property
    def unit(self) -> str: ...
    @property
    def position_min(self) -> float: ...
    @property
    def position_max(self) -> float: ...
    @property
    def speed_max(self) -> float: ...
    @property
    def acceleration_max(self) -> float: ...
    @property
    def jerk_max(self) -> float | None: ...
    @property
    def candidates(self) -> tuple[float, ...]: ...
    @property
    def around(self) -> bool: ...
    @property
    def frame(self) -> Floats: ...
    def motions(self, values: Floats) -> Floats: ...
    def drift(self, poses: Floats) -> Floats: ...


@described("finishing.turntable")
class Turntable(Described):
    """A turntable that carries the work of a robot; see `mounted`.

    Parameters
    ----------
    origin : (float, float, float)
        A point on its axis in the base of the robot, mm; on what carries the turntable, with that at zero.
    axis : (float, float, float)
        Direction of its axis in the base, of any length; turned about it by the right hand.
    position_min, position_max : float
        Limits of its angle, rad; at most two turns.
    speed_max, acceleration_max, jerk_max : float
        In rad/s, rad/s^2, rad/s^3. jerk_max None: no limit.
    angles : int or tuple of float
        Angles that the planner chooses from: their number over a turn, or between the limits where these
        leave less; or the angles themselves, rad, between which it stays. One: it is held there.

    Raises
    ------
    ValueError
        When the axis has no length, limits cross, one is not > 0 or in another unit, or an angle is beyond a
        limit.

    Examples
    --------
    >>> from sdpgrind import finishing, units
    >>> table = finishing.arm.Turntable((800.0, 0.0, 100.0), speed_max=units.rpm(20), acceleration_max=4.0)
    >>> table.motions(np.pi / 2)[:3, 3].round(9).tolist()  # mm: where the origin of the base gets
    [800.0, -800.0, 0.0]
    """

    origin: tuple[float, ...] = custom(lambda name, value: _place(name, value), "mm")
    axis: tuple[float, ...] = custom(lambda name, value: _direction(name, value), default=(0.0, 0.0, 1.0))
    _: KW_ONLY
    position_min: float = quantity("rad", default=-2 * math.pi)
    position_max: float = quantity("rad", default=2 * math.pi)
    speed_max: float = quantity("rad/s", above=0, usual=(1e-3, 30.0), typical=2)
    acceleration_max: float = quantity("rad/s^2", above=0, usual=(1e-3, 1e3), typical=5)
    jerk_max: float | None = quantity("rad/s^3", above=0, default=None)
    angles: int | tuple[float, ...] = custom(lambda name, value: _values(name, value, "rad"), default=24)

    def _check(self) -> None:
        _check_axis(self, "angles", self.angles)

    @property
    def unit(self) -> str:
        """Unit of its position, "rad"."""
        return "rad"

    @property
    def around(self) -> bool:
        """Whether it may turn to any angle: angles are a number of them, and the limits leave 2 pi (rad)."""
        return isinstance(self.angles, int) and self._turn

    @property
    def _turn(self) -> bool:
        return self.position_max - self.position_min >= 2 * math.pi - _SAME

    @property
    def candidates(self) -> tuple[float, ...]:
        """Angles that the planner chooses from, rad."""
        if isinstance(self.angles, tuple):
            return self.angles
        if not self._turn:
            return _spread(self, self.angles)
        middle, count = 0.5 * (self.position_min + self.position_max), self.angles
        return tuple(middle + 2 * math.pi / count * (k - count // 2) for k in range(count))

    @property
    def frame(self) -> Floats:
        """Frame (4, 4) in the base with all axes at zero: `origin`, z along the axis; mm."""
        return _upright(self.origin, self.axis)

    def motions(self, values: Any) -> Floats:
        """Return the rigid motions of the work from its place at zero, (..., 4, 4), mm.

        Parameters
        ----------
        values : float or array (...)
            Angles, rad.
        """
        turn, axis, origin = np.asarray(values, dtype=float), np.array(self.axis), np.array(self.origin)
        c, s = np.cos(turn)[..., None, None], np.sin(turn)[..., None, None]
        out = np.zeros((*turn.shape, 4, 4))
        out[..., :3, :3] = c * np.eye(3) + s * _crossed(axis) + (1 - c) * np.outer(axis, axis)
        out[..., :3, 3] = origin - out[..., :3, :3] @ origin
        out[..., 3, 3] = 1.0
        return out

    def drift(self, poses: Floats) -> Floats:
        """Return the velocity of poses (mm) as the work sees it, in the axes of the base, (..., 6) per rad/s.

        Parameters
        ----------
        poses : array (..., 4, 4)
            Poses in the base, mm.
        """
        axis, out = np.array(self.axis), np.empty((*poses.shape[:-2], 6))
        out[..., :3] = -np.cross(axis, poses[..., :3, 3] - np.array(self.origin))
        out[..., 3:] = -axis
        return out


@described("finishing.linear_table")
class LinearTable(Described):
    """A table that slides along a line and carries the work of a robot; see `mounted`.

    Parameters
    ----------
    direction : (float, float, float)
        Direction of its travel in the base of the robot, of any length.
    travel : (float, float)
        Least and greatest position, mm.
    speed_max, acceleration_max, jerk_max : float
        In mm/s, mm/s^2, mm/s^3. jerk_max None: no limit.
    positions : int or tuple of float
        Positions that the planner chooses from: their number over the travel, or themselves, mm, between
        which it stays. One: it is held there, in the middle of the travel where it is a number.

    Raises
    ------
    ValueError
        When the direction has no length, the travel is crossed, a limit is not > 0 or in another unit, or a
        position is beyond the travel.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> rail = finishing.arm.LinearTable((0, 2, 0), (-500.0, 500.0), speed_max=400.0, acceleration_max=2000.0)
    >>> rail.direction, rail.motions(30.0)[:3, 3].tolist()  # mm
    ((0.0, 1.0, 0.0), [0.0, 30.0, 0.0])
    """

    direction: tuple[float, ...] = custom(lambda name, value: _direction(name, value))
    travel: tuple[float, ...] = custom(lambda name, value: _travel(name, value), "mm")
    _: KW_ONLY
    speed_max: float = quantity("mm/s", above=0, usual=(0.5, 1e4), typical=300)
    acceleration_max: float = quantity("mm/s^2", above=0, usual=(1.0, 1e6), typical=2000)
    jerk_max: float | None = quantity("mm/s^3", above=0, default=None)
    positions: int | tuple[float, ...] = custom(lambda name, value: _values(name, value, "mm"), default=17)

    def _check(self) -> None:
        _check_axis(self, "positions", self.positions)

    @property
    def unit(self) -> str:
        """Unit of its position, "mm"."""
        return "mm"

    @property
    def position_min(self) -> float:
        """Least position, mm."""
        return self.travel[0]

    @property
    def position_max(self) -> float:
        """Greatest position, mm."""
        return self.travel[1]

    @property
    def around(self) -> bool:
        """Whether its position (mm) comes round again: it does not."""
        return False

    @property
    def candidates(self) -> tuple[float, ...]:
        """Positions that the planner chooses from, mm."""
        return self.positions if isinstance(self.positions, tuple) else _spread(self, self.positions)

    @property
    def frame(self) -> Floats:
        """Frame (4, 4) in the base with all axes at zero: that of the base, z along the direction; mm."""
        return _upright((0.0, 0.0, 0.0), self.direction)

    def motions(self, values: Any) -> Floats:
        """Return the rigid motions of the work from its place at zero, (..., 4, 4), mm.

        Parameters
        ----------
        values : float or array (...)
            Positions, mm.
        """
        way = np.asarray(values, dtype=float)
        out = np.tile(np.eye(4), (*way.shape, 1, 1))
        out[..., :3, 3] = way[..., None] * np.array(self.direction)
        return out

    def drift(self, poses: Floats) -> Floats:
        """Return the velocity of poses (mm) as the work sees it, in the axes of the base, (..., 6) per mm/s.

        Parameters
        ----------
        poses : array (..., 4, 4)
            Poses in the base, mm.
        """
        out = np.zeros((*poses.shape[:-2], 6))
        out[..., :3] = -np.array(self.direction)
        return out


def _upright(origin: tuple[float, ...], axis: tuple[float, ...]) -> Floats:
    """Frame at a place, z along an axis: the base by the shortest turn; one below is turned about x first."""
    up = math.copysign(1.0, axis[2])
    x, y, z = (up * value for value in axis)
    skew, out = _crossed(np.array([-y, x, 0.0])), np.eye(4)
    out[:3, :3] = (np.eye(3) + skew + skew @ skew / (1.0 + z)) @ np.diag([1.0, up, up])
    out[:3, 3] = origin
    return out


def _crossed(axis: Floats) -> Floats:
    """Matrix of the cross product with a vector."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _three(name: str, value: Any, unit: str = "") -> Floats:
    found = checks.finite_array(name, value, unit)
    if found.shape != (3,):
        raise checks.refuse(name, "three numbers, x, y, z", value, unit)
    return found


def _place(name: str, value: Any) -> tuple[float, ...]:
    place = _three(name, value, "mm")
    check_away(name, value)
    return tuple(place.tolist())


def _direction(name: str, value: Any) -> tuple[float, ...]:
    """Check a direction, and make its length 1."""
    found = _three(name, value)
    size = float(np.linalg.norm(found))
    if size == 0.0:
        raise checks.refuse(name, "a direction, with a length above 0", value)
    return tuple((found / size).tolist()) if abs(size - 1.0) > _ROUNDING else tuple(found.tolist())


def _travel(name: str, value: Any) -> tuple[float, ...]:
    found = checks.finite_array(name, value, "mm")
    if found.shape != (2,):
        raise checks.refuse(name, "its least and greatest position", value, "mm")
    low, high = found.tolist()
    if low >= high:
        raise checks.refuse(name, "its least position, then a greater one", value, "mm")
    if high - low < _SHORTEST:
        raise checks.refuse(name, "in mm, some 1000 long; metres? units.m(...)", value)
    return low, high


def _values(name: str, value: Any, unit: str) -> int | tuple[float, ...]:
    """Check candidates: their number, or themselves."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return checks.count(name, value, 1, MOST)
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str):
        raise TypeError(f"{name} must be a number of them, or a tuple ({unit}); got {checks.shown(value)}")
    found = checks.finite_array(name, value, unit)
    if found.ndim != 1 or not 1 <= found.size <= MOST:
        raise checks.refuse(name, f"one to {MOST} numbers", value, unit)
    if (np.diff(np.sort(found)) < _SAME).any():
        raise checks.refuse(name, "numbers that differ", found.tolist(), unit)
    return tuple(found.tolist())


def _check_axis(axis: WorkAxis, name: str, values: int | tuple[float, ...]) -> None:
    """Refuse limits that cross, and candidates beyond them."""
    kind = type(axis).__name__
    check_range(f"the {kind}", axis.unit, axis.position_min, axis.position_max)
    for k, value in enumerate(values if isinstance(values, tuple) else ()):
        checks.within(f"{name}[{k}]", value, axis.position_min, axis.position_max, axis.unit)


def _spread(axis: WorkAxis, count: int) -> tuple[float, ...]:
    """Positions from limit to limit; one: in the middle."""
    if count == 1:
        return (0.5 * (axis.position_min + axis.position_max),)
    return tuple(np.linspace(axis.position_min, axis.position_max, count).tolist())
