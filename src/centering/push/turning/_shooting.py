"""Where a push on a turning table leaves the ring, by following it in the plane; and how to begin it so that this is the axis.

In the search all lengths are shares of the offset: what is sought and what is missed are then pairs of numbers of one size.
"""

from cmath import exp
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from centering._problem.model import PushModel
from centering.push.turning import _plane_kernels as at
from sdpgrind.base.checks import Floats

_ROUNDS = 12  # chosen: at most; four are usual
_TURNS = 2  # chosen: rounds in which only the direction is mended
_FINE, _COARSE = 5e-9, 1e-5  # chosen: errors of a step, at last and at first
_NEAR, _ROUGH = 1e-8, 3e-4  # chosen: misses that are none, at last and at first
_FAIR = 1e-3  # chosen: a miss that is none where a ring chatters and the last digits jump
_CHANGE = 1e-3  # chosen: over which a derivative is taken
_LONGEST, _MOST_FIRST = 0.1, 0.5  # chosen: longest step; that while the direction alone is mended, rad
_FLAT = 1e-2  # chosen: of a derivative that is none
_TENTH = 0.1  # chosen: by which a stroke is shortened in search
_SHORTEST = -0.8  # chosen: greatest shortening of a stroke, as a shorter blow only throws the ring
_SLOPES = 0.5, 2.0  # chosen: slopes that a secant may have


def ring_state(offset: float, offset_angle: float, radius: float, spindle_speed: float) -> Floats:
    """State for `push_on_table` of a ring (mm, rad) that rests on the turning table (rad/s) with the tip at its rim."""
    state = np.empty(at.STATES)
    at.place(offset, offset_angle, radius, spindle_speed, state)
    return state


def landing(model: PushModel, spindle_speed: float, rows: Floats, state: Floats, tolerance: float) -> complex:
    """Where the ring comes to rest, x + i y mm in the table's frame at the begin; the tip stays where its profile ends.

    `tolerance` (mm) is what a step may err by. A ring that goes on sliding (RESTS of the state is 0) is where it was seen last.
    """
    at.land(model.parameters, model.part.radius, spindle_speed, rows, tolerance, state)
    return complex(state[at.X], state[at.Y]) * exp(-1j * spindle_speed * state[at.CLOCK])


class Aim(NamedTuple):
    """Angle of first touch (rad), lengthening of the stroke (mm); what they miss, astray (rad) and left along the way (mm).

    `left`: distance from the axis at which the ring is left, mm; infinite where it is not pushed. `rests`: it stays there.
    """

    angle: float
    longer: float
    astray: float
    along: float
    left: float
    rests: bool


def aimed(model: PushModel, spindle_speed: float, push: Floats, offset: float, angle: float) -> Aim:
    """The push with which nothing is missed, near an angle of first touch (rad); else of those tried the one that leaves least.

    `push` is what `push_rows` takes. A ring that is thrown so far that no stroke does is aimed at the axis in its direction only.
    """
    best = _Search(model, spindle_speed, push, offset).best(angle)
    return Aim(
        best.angle,
        best.longer * offset,
        best.astray,
        best.along * offset,
        best.left * offset,
        best.rests > 0.5,
    )


class _Tried(NamedTuple):
    """A push that was followed: angle of first touch (rad), lengthening, and what `missed` says of it."""

    angle: float
    longer: float
    astray: float
    along: float
    left: float
    rests: float

    @property
    def missing(self) -> float:
        """What is missed, by the greater."""
        return max(abs(self.astray), abs(self.along))

    @property
    def hits(self) -> bool:
        return self.missing <= _FAIR and self.longer > _SHORTEST and self.rests > 0.5


_Inverse = tuple[float, float, float, float]
"""Inverse of the derivatives of what is missed by angle and lengthening, by rows."""
_OF_SMALL: _Inverse = (1.0, 0.0, 0.0, -1.0)
"""That where all is small: the angle turns the way, the stroke lengthens it."""


class _Search:
    """Search for the push with which nothing is missed; by Broyden's method, with coarse steps and then fine ones."""

    def __init__(self, model: PushModel, spindle_speed: float, push: Floats, offset: float) -> None:
        self._asked = model.parameters, model.part.radius, spindle_speed, push, offset

    def best(self, angle: float) -> _Tried:
        """What hits, else what leaves least; a push of unchanged stroke where others are no better."""
        found = self._solved(angle, 0.0, _OF_SMALL)
        if found.hits:
            return found
        straight = best = self._straight(angle)
        for attempt in range(3):
            if attempt > 0:
                start = (self._turned(angle, 0.0)[0], 0.0) if attempt == 1 else self._thrown(angle)
                if start is None:
                    break
                found = self._solved(*start, self._differences(*start))
                if found.hits:
                    return found
            if found.longer > _SHORTEST and found.left < best.left:
                best = found
        return straight if straight.left <= best.left + _FAIR else best

    def _tried(self, angle: float, longer: float, tolerance: float) -> _Tried:
        return _Tried(angle, longer, *at.missed(*self._asked, angle, longer, tolerance))

    def _solved(self, angle: float, longer: float, inverse: _Inverse) -> _Tried:
        """The best from there on."""
        rough, inverse = self._followed(angle, longer, inverse, _COARSE, _ROUGH)
        return self._followed(rough.angle, rough.longer, inverse, _FINE, _NEAR)[0]

    def _followed(
        self, angle: float, longer: float, inverse: _Inverse, tolerance: float, near: float
    ) -> tuple[_Tried, _Inverse]:
        """Follow what is missed to within `near` of nothing; the best that was found."""
        now = best = self._tried(angle, longer, tolerance)
        for _ in range(_ROUNDS):
            if not near < now.missing < inf:
                break
            now, inverse = self._moved(now, inverse, tolerance)
            if now.missing < best.missing:
                best = now
        return best, inverse

    def _moved(self, now: _Tried, inverse: _Inverse, tolerance: float) -> tuple[_Tried, _Inverse]:
        """One step of Broyden's method."""
        a, b, c, d = inverse
        by, on = -(a * now.astray + b * now.along), -(c * now.astray + d * now.along)
        much = max(1.0, max(abs(by), abs(on)) / _LONGEST)
        by, on = by / much, on / much
        after = self._tried(now.angle + by, now.longer + on, tolerance)
        astray, along = after.astray - now.astray, after.along - now.along
        gained, further = a * astray + b * along, c * astray + d * along
        scale = by * gained + on * further
        if not (isfinite(scale) and abs(scale) > _FLAT * (by * by + on * on)):
            return after, inverse
        one, other = by * a + on * c, by * b + on * d
        by, on = (by - gained) / scale, (on - further) / scale
        return after, (a + by * one, b + by * other, c + on * one, d + on * other)

    def _differences(self, angle: float, longer: float) -> _Inverse:
        """The derivatives by differences, where these are sound."""
        now = self._tried(angle, longer, _COARSE)
        one = self._tried(angle + _CHANGE, longer, _COARSE)
        other = self._tried(angle, longer - _CHANGE, _COARSE)
        a, c = (one.astray - now.astray) / _CHANGE, (one.along - now.along) / _CHANGE
        b, d = (now.astray - other.astray) / _CHANGE, (now.along - other.along) / _CHANGE
        det = a * d - b * c
        return (d / det, -b / det, -c / det, a / det) if isfinite(det) and abs(det) > _FLAT else _OF_SMALL

    def _turned(self, angle: float, longer: float) -> tuple[float, float]:
        """The angle with which a stroke goes through the axis, roughly, and what it then leaves along the way."""
        along = inf
        for _ in range(_TURNS):
            tried = self._tried(angle, longer, _COARSE)
            along = tried.along
            angle -= min(max(tried.astray, -_MOST_FIRST), _MOST_FIRST)
        return angle, along

    def _thrown(self, angle: float) -> tuple[float, float] | None:
        """Angle and shorter stroke near which a ring that is thrown beyond the axis no longer is; None where there is none."""
        longer = 0.0
        while longer > _SHORTEST:
            angle, along = self._turned(angle, longer)
            if along > 0.0:
                return (angle, longer + 0.5 * _TENTH) if longer < 0.0 else None
            longer -= _TENTH
        return None

    def _straight(self, angle: float) -> _Tried:
        """The best angle with which the ring goes through the axis, by secants; the stroke as it is."""
        slope, now = 1.0, self._tried(angle, 0.0, _FINE)
        best = now
        for _ in range(_ROUNDS):
            before = now.astray
            if not _NEAR < abs(before) < inf:
                break
            change = min(max(-before / slope, -_LONGEST), _LONGEST)
            now = self._tried(now.angle + change, 0.0, _FINE)
            slope = (now.astray - before) / change
            slope = slope if _SLOPES[0] < slope < _SLOPES[1] else 1.0
            if abs(now.astray) < abs(best.astray):
                best = now
        return best
