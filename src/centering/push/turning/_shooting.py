"""Final position of a push on a turning table, and the search for the push that ends on the axis.

In the search all lengths are shares of the offset, so that unknowns and misses are of one size.
"""

from cmath import exp
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from centering._problem.model import PushModel
from centering.push.turning import _plane_kernels as at
from sdpgrind.base.checks import Floats

_ROUNDS = 12  # chosen: most iterations; four are usual
_TURNS = 2  # chosen: iterations that correct the direction alone
_FINE, _COARSE = 5e-9, 1e-5  # chosen: integration errors of the last and of the first iterations
_NEAR, _ROUGH = 1e-8, 3e-4  # chosen: misses at which the last and the first iterations end
_FAIR = 1e-3  # chosen: miss accepted in the end: of a ring that chatters the last digits jump
_CHANGE = 1e-3  # chosen: step of finite differences
_LONGEST, _MOST_FIRST = 0.1, 0.5  # chosen: longest step of an iteration; of one of the direction alone, rad
_FLAT = 1e-2  # chosen: smaller determinants count as singular
_TENTH = 0.1  # chosen: step by which a stroke is shortened in the search
_SHORTEST = -0.8  # chosen: greatest shortening of a stroke; a shorter blow only throws the ring
_SLOPES = 0.5, 2.0  # chosen: range of trusted secant slopes


def ring_state(offset: float, offset_angle: float, radius: float, spindle_speed: float) -> Floats:
    """State for `_push_on_table` of a ring that rests on the turning table, tip at its rim."""
    state = np.empty(at.STATES)
    at.place(offset, offset_angle, radius, spindle_speed, state)
    return state


def landing(model: PushModel, spindle_speed: float, rows: Floats, state: Floats, tolerance: float) -> complex:
    """Final position of the ring, x + i y mm in the table's frame at the beginning; the tip stays at its end.

    `tolerance` (mm) is the integration error of a step. A ring that goes on sliding (RESTS is 0) counts with
    its last position.
    """
    at.land(model.parameters, model.part.radius, spindle_speed, rows, tolerance, state)
    return complex(state[at.X], state[at.Y]) * exp(-1j * spindle_speed * state[at.CLOCK])


class Aim(NamedTuple):
    """Angle of first touch (rad), lengthening (mm), deviation (rad), distance left along the way (mm).

    `left`: final distance from the axis, mm; infinite where the ring is not pushed. `rests`: the ring comes
    to rest.
    """

    angle: float
    longer: float
    astray: float
    along: float
    left: float
    rests: bool


def aimed(model: PushModel, spindle_speed: float, push: Floats, offset: float, angle: float) -> Aim:
    """Push near an angle of first touch (rad) that hits the axis; else the tried one that leaves least.

    `push` has the form of `push_rows`. For a ring thrown too far for any stroke only the direction is aimed.
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
    """Simulated push: angle of first touch (rad), lengthening, and the results of `missed`."""

    angle: float
    longer: float
    astray: float
    along: float
    left: float
    rests: float

    @property
    def missing(self) -> float:
        """Greater of both misses."""
        return max(abs(self.astray), abs(self.along))

    @property
    def hits(self) -> bool:
        return self.missing <= _FAIR and self.longer > _SHORTEST and self.rests > 0.5


_Inverse = tuple[float, float, float, float]
"""Inverse Jacobian of the miss by angle and lengthening, by rows."""
_OF_SMALL: _Inverse = (1.0, 0.0, 0.0, -1.0)
"""Its limit for small offsets: the angle turns the way, the stroke lengthens it; derived."""


class _Search:
    """Search for the push without a miss, by Broyden's method, with coarse and then fine integration."""

    def __init__(self, model: PushModel, spindle_speed: float, push: Floats, offset: float) -> None:
        self._asked = model.parameters, model.part.radius, spindle_speed, push, offset

    def best(self, angle: float) -> _Tried:
        """Push that hits, else the one that leaves least; the unchanged stroke where others are no better."""
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
        """Best push from a start."""
        rough, inverse = self._followed(angle, longer, inverse, _COARSE, _ROUGH)
        return self._followed(rough.angle, rough.longer, inverse, _FINE, _NEAR)[0]

    def _followed(
        self, angle: float, longer: float, inverse: _Inverse, tolerance: float, near: float
    ) -> tuple[_Tried, _Inverse]:
        """Iterate until the miss is below `near`; the best push, and the inverse Jacobian."""
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
        """Inverse Jacobian by finite differences, where it is sound."""
        now = self._tried(angle, longer, _COARSE)
        one = self._tried(angle + _CHANGE, longer, _COARSE)
        other = self._tried(angle, longer - _CHANGE, _COARSE)
        a, c = (one.astray - now.astray) / _CHANGE, (one.along - now.along) / _CHANGE
        b, d = (now.astray - other.astray) / _CHANGE, (now.along - other.along) / _CHANGE
        det = a * d - b * c
        return (d / det, -b / det, -c / det, a / det) if isfinite(det) and abs(det) > _FLAT else _OF_SMALL

    def _turned(self, angle: float, longer: float) -> tuple[float, float]:
        """Angle that aims a stroke roughly through the axis, and the distance left along the way."""
        along = inf
        for _ in range(_TURNS):
            tried = self._tried(angle, longer, _COARSE)
            along = tried.along
            angle -= min(max(tried.astray, -_MOST_FIRST), _MOST_FIRST)
        return angle, along

    def _thrown(self, angle: float) -> tuple[float, float] | None:
        """Start with a shorter stroke that no longer throws the ring beyond the axis; None without one."""
        longer = 0.0
        while longer > _SHORTEST:
            angle, along = self._turned(angle, longer)
            if along > 0.0:
                return (angle, longer + 0.5 * _TENTH) if longer < 0.0 else None
            longer -= _TENTH
        return None

    def _straight(self, angle: float) -> _Tried:
        """Best angle that aims the unchanged stroke through the axis, by secants."""
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
