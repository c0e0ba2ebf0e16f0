"""Compiled search for the push on a turning table with which nothing is missed: angle of first touch, length of the stroke.

All lengths are shares of the offset here: what is sought and what is missed are then pairs of numbers of one size. A ring is told
by its law (`PushModel.parameters`), radius (mm) and the speed of the table (rad/s), a push as `push_rows` takes it.
"""

from math import atan2, cos, hypot, inf, isfinite, sin, tan

import numpy as np

from centering.push._profile.row_kernels import ROWS, TOTAL, push_rows
from centering.push.turning._direction_kernels import CLOCK, RESTS, STATES, X, Y, land, place
from centering.push.turning._rim_kernels import reach
from sdpgrind.base.compiled import compiled

# What a search keeps: angle of first touch (rad), lengthening of the stroke; what is missed there, astray (rad) and left along
# the way; 1 where the ring comes to rest there; the inverse of the derivatives, by rows.
ANGLE, LONGER, ASTRAY, ALONG, STILL, _A, _B, _C, _D, SEARCH = range(10)

_ROUNDS = 12  # at most; four are usual
_TURNS = 2  # rounds in which only the direction is mended
_FINE, _COARSE = 5e-9, 1e-5  # errors of a step, at last and at first
_NEAR, _ROUGH, _FAIR = 1e-8, 3e-4, 1e-3  # misses that are none; at first; where a ring chatters and the last digits jump
_CHANGE = 1e-3  # over which a derivative is taken
_LONGEST, _MOST_FIRST = 0.1, 0.5  # longest step; that while the direction alone is mended, rad
_FLAT = 1e-2  # of a derivative that is none
_MOVED = 0.02  # below it the ring has stuck, and no direction can be told
_ASTRAY = 0.1  # rad: what goes by more is no push toward the axis
_TENTH, _SHORTEST = 0.1, -0.8  # by which a stroke is shortened in search, and at most: a shorter blow only throws the ring
_SLOPES = 0.5, 2.0  # slopes that a secant may have


@compiled(error_model="numpy")
def _missed(ring, push, offset, angle, longer, tolerance):
    """What a push misses: astray (rad), left along the way, infinite where there is none; whether the ring rests there."""
    law, radius, w = ring
    way = reach(angle, offset, radius)
    if not min(way, way + longer * offset, push[TOTAL] - way) > 0.0:
        return inf, inf, 0.0
    rows, state = np.empty((ROWS, 3)), np.empty(STATES)
    count = push_rows(push, way, longer * offset, rows)
    place(offset, -angle, radius, w, state)
    land(law, radius, w, rows[:count], tolerance * offset, state)
    turned = angle - w * state[CLOCK]
    c, s = cos(turned), sin(turned)
    x, y = (c * state[X] - s * state[Y]) / offset - 1.0, (s * state[X] + c * state[Y]) / offset
    if x * x + y * y < _MOVED * _MOVED:
        return 0.0, 1.0 - hypot(x, y), state[RESTS]
    return atan2(-y, -x), 1.0 + x, state[RESTS]


@compiled(error_model="numpy")
def _look(ring, push, offset, tolerance, aim):
    aim[ASTRAY], aim[ALONG], aim[STILL] = _missed(ring, push, offset, aim[ANGLE], aim[LONGER], tolerance)


@compiled(error_model="numpy")
def _at(angle, longer, aim):
    """Begin a search there, with the derivatives where all is small: the angle turns the way, the stroke lengthens it."""
    aim[:] = 0.0
    aim[ANGLE], aim[LONGER], aim[_A], aim[_D] = angle, longer, 1.0, -1.0


@compiled(error_model="numpy")
def _differences(ring, push, offset, aim):
    """Take the derivatives by differences, where these are sound."""
    _look(ring, push, offset, _COARSE, aim)
    one = _missed(ring, push, offset, aim[ANGLE] + _CHANGE, aim[LONGER], _COARSE)
    other = _missed(ring, push, offset, aim[ANGLE], aim[LONGER] - _CHANGE, _COARSE)
    a, c = (one[0] - aim[ASTRAY]) / _CHANGE, (one[1] - aim[ALONG]) / _CHANGE
    b, d = (aim[ASTRAY] - other[0]) / _CHANGE, (aim[ALONG] - other[1]) / _CHANGE
    det = a * d - b * c
    if isfinite(det) and abs(det) > _FLAT:
        aim[_A], aim[_B], aim[_C], aim[_D] = d / det, -b / det, -c / det, a / det


@compiled(error_model="numpy")
def _missing(aim):
    return max(abs(aim[ASTRAY]), abs(aim[ALONG]))


@compiled(error_model="numpy")
def _move(ring, push, offset, tolerance, aim):
    """One step of Broyden's method."""
    by, on = -(aim[_A] * aim[ASTRAY] + aim[_B] * aim[ALONG]), -(aim[_C] * aim[ASTRAY] + aim[_D] * aim[ALONG])
    much = max(1.0, max(abs(by), abs(on)) / _LONGEST)
    by, on, astray, along = by / much, on / much, aim[ASTRAY], aim[ALONG]
    aim[ANGLE], aim[LONGER] = aim[ANGLE] + by, aim[LONGER] + on
    _look(ring, push, offset, tolerance, aim)
    astray, along = aim[ASTRAY] - astray, aim[ALONG] - along
    gained, further = aim[_A] * astray + aim[_B] * along, aim[_C] * astray + aim[_D] * along
    scale = by * gained + on * further
    if isfinite(scale) and abs(scale) > _FLAT * (by * by + on * on):
        one, other = by * aim[_A] + on * aim[_C], by * aim[_B] + on * aim[_D]
        by, on = (by - gained) / scale, (on - further) / scale
        aim[_A], aim[_B], aim[_C], aim[_D] = aim[_A] + by * one, aim[_B] + by * other, aim[_C] + on * one, aim[_D] + on * other


@compiled(error_model="numpy")
def _follow(ring, push, offset, tolerance, near, aim):
    """Follow what is missed to within `near` of nothing; `aim` becomes the best place that was found."""
    now = aim.copy()
    _look(ring, push, offset, tolerance, now)
    aim[:_A] = now[:_A]
    for _ in range(_ROUNDS):
        if not near < _missing(now) < inf:
            break
        _move(ring, push, offset, tolerance, now)
        if _missing(now) < _missing(aim):
            aim[:_A] = now[:_A]
    aim[_A:] = now[_A:]


@compiled(error_model="numpy")
def _solved(ring, push, offset, aim):
    """Search from `aim` on, with coarse steps and then fine ones; return whether it hits."""
    _follow(ring, push, offset, _COARSE, _ROUGH, aim)
    _follow(ring, push, offset, _FINE, _NEAR, aim)
    return _missing(aim) <= _FAIR and aim[LONGER] > _SHORTEST and aim[STILL] > 0.5


@compiled(error_model="numpy")
def _turned(ring, push, offset, angle, longer):
    """The angle with which a stroke goes through the axis, roughly, and what it then leaves along the way."""
    along = inf
    for _ in range(_TURNS):
        astray, along, _ = _missed(ring, push, offset, angle, longer, _COARSE)
        angle -= min(max(astray, -_MOST_FIRST), _MOST_FIRST)
    return angle, along


@compiled(error_model="numpy")
def _thrown(ring, push, offset, angle, aim):
    """Begin near the shorter stroke with which a ring that is thrown beyond the axis no longer is; whether there is one."""
    longer = 0.0
    while longer > _SHORTEST:
        angle, along = _turned(ring, push, offset, angle, longer)
        if along > 0.0:
            _at(angle, longer + 0.5 * _TENTH, aim)
            return longer < 0.0
        longer -= _TENTH
    return False


@compiled(error_model="numpy")
def left_of(aim):
    """Distance from the axis at which the ring is left; infinite where it is not pushed toward it."""
    return hypot(aim[ALONG], (1.0 - aim[ALONG]) * tan(aim[ASTRAY])) if abs(aim[ASTRAY]) < _ASTRAY else inf


@compiled(error_model="numpy")
def _straight(ring, push, offset, angle, aim):
    """Leave the stroke and find the angle with which the ring goes through the axis, by secants; the best place in `aim`."""
    slope, now = 1.0, aim.copy()
    _at(angle, 0.0, now)
    _look(ring, push, offset, _FINE, now)
    aim[:] = now
    for _ in range(_ROUNDS):
        before = now[ASTRAY]
        if not _NEAR < abs(before) < inf:
            break
        change = min(max(-before / slope, -_LONGEST), _LONGEST)
        now[ANGLE] += change
        _look(ring, push, offset, _FINE, now)
        slope = (now[ASTRAY] - before) / change
        slope = slope if _SLOPES[0] < slope < _SLOPES[1] else 1.0
        if abs(now[ASTRAY]) < abs(aim[ASTRAY]):
            aim[:] = now


@compiled(error_model="numpy")
def aimed(law, radius, spindle_speed, push, offset, angle, aim):
    """Find the push with which nothing is missed, near an angle; else of those tried the one that leaves least.

    Return whether it hits. One of unchanged stroke is taken where others are no better.
    """
    ring = (law, radius, spindle_speed)
    _at(angle, 0.0, aim)
    if _solved(ring, push, offset, aim):
        return True
    straight, best = np.empty(SEARCH), np.empty(SEARCH)
    _straight(ring, push, offset, angle, straight)
    best[:] = straight
    for attempt in range(3):
        if attempt == 1:
            _at(_turned(ring, push, offset, angle, 0.0)[0], 0.0, aim)
        if attempt == 2 and not _thrown(ring, push, offset, angle, aim):
            break
        if attempt > 0:
            _differences(ring, push, offset, aim)
            if _solved(ring, push, offset, aim):
                return True
        if aim[LONGER] > _SHORTEST and left_of(aim) < left_of(best):
            best[:] = aim
    aim[:] = straight if left_of(straight) <= left_of(best) + _FAIR else best
    return False
