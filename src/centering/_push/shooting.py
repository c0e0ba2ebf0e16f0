"""Where a push on a turning table leaves the ring, by following it in the plane; and how to begin it so that this is the axis."""

from cmath import exp, phase
from functools import partial
from math import cos, hypot, inf, isfinite, nan, pi, sin, sqrt, tan
from typing import NamedTuple, Protocol

import numpy as np

from centering._push import direction_kernels as at
from centering._push.direction_kernels import push_on_table
from centering._push.model import GRAVITY, PushModel
from sdpgrind.base.checks import Floats

_STEPS = 700  # of a simulated push
_PER_SWING = 60  # steps at least in a swing of the ring on the contact
_COARSE = 4.0  # times longer are the steps of the first rounds
_ROUNDS = 12  # at most; four are usual
_TURNS = 2  # rounds in which only the direction is mended
_ROUGH = 3e-4  # rad, and share of the offset: what coarse steps need not be better than
_ANGLE, _PLACE = 1e-8, 1e-7  # rad, mm: misses that are none by these steps, which err by µm over long fast pushes
_FAIR = 1e-3  # rad, and share of the offset: what is good enough where a ring chatters and the last digits jump
_CHANGE = 1e-3  # rad, and share of the offset: over which a derivative is taken
_MOST_TURN, _MOST_LONGER = 0.15, 0.1  # rad, share of the offset: the longest steps
_TENTHS = 10  # parts of the offset by which a stroke is shortened in search
_MOST_TENTHS = 8  # a shorter blow only throws the ring, and where it stops is hardly told
_MOST_FIRST = 0.5  # rad: the longest step while the direction alone is mended
_USUAL = np.diag([1.0, -1.0])  # the angle turns the way, the stroke lengthens it: inverse of the derivatives where all is small
_FLAT = 1e-2  # of a derivative that is none
_ASTRAY = 0.1  # rad: what goes by more is no push toward the axis
_SLOPES = 0.5, 2.0  # slopes that a secant may have
_PARTS = 4  # in which a slide that goes on after the stroke is followed
_MOVED = 0.02  # share of the offset: below it the ring has stuck, and no direction can be told


class Miss(Protocol):
    """What a push misses: astray (rad) and left along the way (mm), by angle of first touch (rad) and longer stroke (mm)."""

    def __call__(self, angle: float, longer: float, coarse: bool) -> Floats: ...


def ring_state(offset: float, offset_angle: float, radius: float, spindle_speed: float) -> Floats:
    """State for `push_on_table` of a ring (mm, rad) that rests on the turning table (rad/s) with the tip at its rim."""
    state = np.zeros(at.STATES)
    x, y = offset * cos(offset_angle), offset * sin(offset_angle)
    state[at.X], state[at.Y], state[at.V_X], state[at.V_Y] = x, y, -spindle_speed * y, spindle_speed * x
    state[at.TIP], state[at.RESTS], state[at.TOUCH] = x + sqrt(radius * radius - y * y), 1.0, -1.0
    return state


def step_of(model: PushModel, rows: Floats) -> float:
    """Step for following a push, s."""
    swing = 2.0 * pi * sqrt(model.inertia / model.contact_stiffness)
    return float(max(min(rows[:, 0].sum() / _STEPS, swing / _PER_SWING), 1e-6))


def landing(model: PushModel, spindle_speed: float, rows: Floats, state: Floats, step: float) -> complex:
    """Where the ring comes to rest, x + i y mm in the table's frame at the begin; the tip stays where its profile ends."""
    w, radius, law = spindle_speed, model.part.radius, model.parameters
    push_on_table(law, radius, w, rows, step, state)
    fastest = np.abs(rows[:, 1]).max() + 1.0
    wait = np.array([[2.0 * fastest / (model.mu_kinetic * GRAVITY * _PARTS), 0.0, 0.0]])
    for _ in range(2 * _PARTS):
        if state[at.RESTS] > 0.5:
            break
        push_on_table(law, radius, w, wait, step, state)
    return complex(state[at.X], state[at.Y]) * exp(-1j * w * state[at.CLOCK])


def missed(model: PushModel, spindle_speed: float, offset: float, angle: float, rows: Floats, coarse: bool) -> Floats:
    """By how much a push that touches at an angle (rad) before the line goes astray (rad), and what it leaves along it (mm)."""
    state = ring_state(offset, -angle, model.part.radius, spindle_speed)
    step = step_of(model, rows) * (_COARSE if coarse else 1.0)
    moved = landing(model, spindle_speed, rows, state, step) * exp(1j * angle) - offset
    if abs(moved) < _MOVED * offset:
        return np.array([0.0, offset - abs(moved)])
    return np.array([phase(-moved), offset + moved.real])


class Aim(NamedTuple):
    """Angle of first touch (rad), lengthening of the stroke (mm), what is missed with them (rad, mm); whether that is nothing."""

    angle: float
    longer: float
    missed: Floats
    solved: bool

    def left(self, offset: float) -> float:
        """Distance from the axis at which the ring is left, mm; infinite where it is not pushed."""
        astray, along = self.missed
        return hypot(along, (offset - along) * tan(astray)) if abs(astray) < _ASTRAY else inf


def aimed(miss: Miss, angle: float, offset: float) -> Aim:
    """The push with which nothing is missed, found with coarse steps first; else of those tried the one that leaves least.

    A ring that is thrown so far that no stroke does is aimed at the axis in its direction only.
    """
    x = np.array([angle, 0.0])
    for _ in range(_TURNS):
        x[0] -= min(max(miss(float(x[0]), 0.0, True)[0], -_MOST_FIRST), _MOST_FIRST)
    tried = [_solved(miss, x, _inverse(miss, x, offset), offset)]
    if not tried[-1].solved:
        tried.append(_solved(miss, x, _USUAL, offset))
    if not tried[-1].solved and (start := _thrown(miss, float(x[0]), offset)) is not None:
        tried.append(_solved(miss, start, _inverse(miss, start, offset), offset))
    return tried[-1] if tried[-1].solved else _least(miss, angle, offset, tried)


def _least(miss: Miss, angle: float, offset: float, tried: list[Aim]) -> Aim:
    """Of pushes that miss the one that leaves least: the one of unchanged stroke where others are no better."""
    straight = _directed(miss, angle)
    plain = Aim(straight, 0.0, miss(straight, 0.0, False), False)
    sound = [one for one in tried if one.longer > -_MOST_TENTHS / _TENTHS * offset and isfinite(straight)]
    best = min([plain, *sound], key=lambda one: one.left(offset))
    return plain if plain.left(offset) <= best.left(offset) + _FAIR * offset else best


def _solved(miss: Miss, x: Floats, inverse: Floats, offset: float) -> Aim:
    """The push near some angle and lengthening that misses least, with coarse steps and then fine ones."""
    most, near = np.array([_MOST_TURN, _MOST_LONGER * offset]), np.array([_ROUGH, _ROUGH * offset])
    x, _, inverse = _broyden(partial(miss, coarse=True), x, inverse, near, most)
    x, f, _ = _broyden(partial(miss, coarse=False), x, inverse, np.array([_ANGLE, _PLACE]), most)
    near_enough = np.all(np.abs(f) <= (_FAIR, _FAIR * offset)) and x[1] > -_MOST_TENTHS / _TENTHS * offset
    return Aim(float(x[0]), float(x[1]), f, bool(near_enough))


def _thrown(miss: Miss, angle: float, offset: float) -> Floats | None:
    """Angle and shorter stroke near which a ring that is thrown beyond the axis no longer is."""
    for tenth in range(_MOST_TENTHS):
        longer = -tenth / _TENTHS * offset
        for _ in range(_TURNS):
            f = miss(angle, longer, True)
            angle -= min(max(f[0], -_MOST_TURN), _MOST_TURN)
        if f[1] > 0.0:
            return np.array([angle, longer + 0.5 / _TENTHS * offset]) if tenth else None
    return None


def _inverse(miss: Miss, x: Floats, offset: float) -> Floats:
    """Inverse of the derivatives of what is missed by angle and stroke, by differences."""
    less, f = _CHANGE * offset, miss(float(x[0]), float(x[1]), True)
    slopes = (miss(x[0] + _CHANGE, x[1], True) - f) / _CHANGE, (f - miss(x[0], x[1] - less, True)) / less
    matrix = np.array(slopes).T
    sound = np.isfinite(matrix).all() and abs(np.linalg.det(matrix)) > _FLAT
    return np.asarray(np.linalg.inv(matrix)) if sound else _USUAL


def _broyden(miss: "partial[Floats]", x: Floats, inverse: Floats, near: Floats, most: Floats) -> tuple[Floats, Floats, Floats]:
    """Follow what is missed to within `near` of nothing, in steps of at most `most`: the best place, what it misses, inverse."""
    f = miss(*x)
    best = x, f
    for _ in range(_ROUNDS):
        if np.all(np.abs(f) <= near):
            break
        change = -inverse @ f
        change = change / max(1.0, float((np.abs(change) / most).max()))
        x, before = x + change, f
        f = miss(*x)
        if not np.isfinite(f).all():
            break
        if np.abs(f / most).max() < np.abs(best[1] / most).max():
            best = x, f
        gained = inverse @ (f - before)
        scale = change @ gained
        if abs(scale) > _FLAT * (change @ change) > 0.0:
            inverse = inverse + np.outer(change - gained, change @ inverse) / scale
    return *best, inverse


def _directed(miss: Miss, angle: float) -> float:
    """Angle of first touch (rad) with which the ring goes through the axis, by secants; NaN: there is none."""
    slope, now = 1.0, miss(angle, 0.0, False)[0]
    best, least = nan, _ASTRAY
    for _ in range(_ROUNDS):
        if abs(now) < least:
            best, least = angle, abs(now)
        if abs(now) <= _ANGLE or not isfinite(now):
            break
        change, before = min(max(-now / slope, -_MOST_TURN), _MOST_TURN), now
        angle += change
        now = miss(angle, 0.0, False)[0]
        slope = (now - before) / change
        slope = slope if _SLOPES[0] < slope < _SLOPES[1] else 1.0
    return best
