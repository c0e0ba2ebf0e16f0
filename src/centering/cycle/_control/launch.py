"""From a chosen push to what the machine is sent: motion of the slide, and the table angle at which it begins."""

from cmath import exp
from dataclasses import dataclass
from math import atan2, isfinite, nan, sqrt

import numpy as np

from centering.cycle._strategy.outcomes import PushKind, until_turn
from centering.push._contact.reaction_kernels import COLUMNS, DONE, FINAL_POSITION, LOG_COLUMNS, push
from centering.push._machine.model import PushModel
from centering.push._machine.problem import CenteringLimits
from centering.push.turning._direction_kernels import TIP
from centering.push.turning._shooting import landing, ring_state
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

_ERROR = 1e-6  # mm, chosen: of a step of the push in the plane
_TRIES = 12  # chosen
_MOVED = 0.2  # of the offset: a ring that went less far was hardly touched; pushes of less than half of it are not chosen
_EARLIER, _NEAR_END = (
    0.5,
    1e-3,
)  # of the way to a lead with alignment at the end, and rad more: the next try then
_SLOPE, _SLOPES, _LEAP = (
    -0.7,
    (-3.0, -0.3),
    0.5,
)  # of the direction over the lead, at first and in bounds; rad at a time
_LATEST = 0.2  # rad beyond alignment at the end: later the rim sweeps up the tip from its other side, where it is aligned, too
_CLOSE = 1e-4  # chosen: of the offset, across: far below what the direction scatters
_PAUSE = 0.02  # s, chosen: a tip that is not drawn back at once stays so long
_CLEAR = 0.5  # mm, chosen: how far it is drawn back then
_MENDINGS = 4  # chosen
_MEND = 2e-4  # mm, chosen: less is left alone
_LEAST = 0.2  # chosen: of a stroke
_NO_LOG = np.empty((0, LOG_COLUMNS))


@dataclass(frozen=True, eq=False)
class SentPush(Frozen):
    """A push as it is sent.

    Parameters
    ----------
    lead : float
        Angle that the table turns from the begin of the motion until the offset is on the push line, rad.
    rows : array, (n, 3)
        Motion of the slide: duration (s), speed at the begin (mm/s) and acceleration (mm/s^2), positive toward the axis.
    stop_time : float
        From the begin until the tip turns back, s.
    beyond : float
        How much further the ring is expected to go than on a table at rest, mm, after the stroke was mended for it.
    first : int
        Row with which the push begins, after the approach.
    """

    lead: float
    rows: Floats
    stop_time: float
    beyond: float
    first: int

    @property
    def duration(self) -> float:
        """Of the whole motion, s."""
        return float(self.rows[:, 0].sum())


@dataclass(frozen=True)
class Approach(Frozen):
    """Where a push begins.

    Parameters
    ----------
    offset : float
        Of the part, mm.
    room : float
        From the waiting tip to the furthest that the rim comes, mm.
    spindle_speed : float
        rad/s.
    """

    offset: float
    room: float
    spindle_speed: float


def run_up(speed: float, limits: CenteringLimits) -> float:
    """Return the distance (mm) in which the slide comes from rest to a speed (mm/s)."""
    return speed * speed / (2.0 * limits.acceleration_max)


def launch(
    kind: PushKind,
    stroke: float,
    start: Approach,
    model: PushModel,
    limits: CenteringLimits,
    lag: float = 0.0,
    friction: float = 1.0,
) -> SentPush:
    """Return what is to be sent for a push.

    The tip runs up to its speed before the place of the rim's furthest point and stops where it would with a table at rest, for
    which the stroke was chosen. When to begin is found by following ring, tip and table in the plane (friction, inertia and
    all), so that what the push leaves lies on the line of the offset. Where the turning table makes the ring go further or less
    far than one at rest would, the stroke is mended.

    Parameters
    ----------
    kind : PushKind
        How the tip pushes.
    stroke : float
        Travel of the tip from there, mm.
    start : Approach
        Offset and room (mm), table speed (rad/s).
    model : PushModel
        What the push is made for.
    limits : CenteringLimits
        Of the slide.
    lag : float
        How late the slide follows once it is loaded, s: speed over following error of Mears' Table 3.2; it is made up for.
    friction : float
        What is believed of the part's friction, over that of the model.
    """
    felt = felt_model(model, friction)
    goal = _travel_at_rest(kind.profile(model, stroke, limits.acceleration_max).segments, felt)
    tries = [_tried(kind, stroke, start, (model, felt), limits, goal)]
    strokes = [stroke]
    for _ in range(_MENDINGS):
        beyond = tries[-1].beyond
        if abs(beyond) <= max(_MEND, _CLOSE * start.offset):
            break
        strokes.append(_mended(strokes, tries))
        tries.append(_tried(kind, strokes[-1], start, (model, felt), limits, goal, tries[-1].lead))
    best = min(tries, key=lambda one: abs(one.beyond))
    if lag == 0.0:
        return best
    late = lag * start.spindle_speed
    return SentPush(
        best.lead + late, _made_up(best.rows, best.first, lag), best.stop_time + lag, best.beyond, best.first
    )


def preview(
    kind: PushKind,
    stroke: float,
    start: Approach,
    model: PushModel,
    limits: CenteringLimits,
    friction: float = 1.0,
) -> SentPush:
    """Return about what is to be sent for a push that is not due yet: `launch`, its stroke not mended (`beyond` is 0).

    Parameters
    ----------
    kind, stroke, start, model, limits, friction
        As `launch` has them (mm, rad/s).
    """
    return _tried(kind, stroke, start, (model, felt_model(model, friction)), limits, None)


def felt_model(model: PushModel, friction: float) -> PushModel:
    """Return a model with its friction times a friction scale."""
    return model.replace(mu_static=model.mu_static * friction, mu_kinetic=model.mu_kinetic * friction)


def _tried(
    kind: PushKind,
    stroke: float,
    start: Approach,
    models: tuple[PushModel, PushModel],
    limits: CenteringLimits,
    goal: float | None,
    guess: float = 0.0,
) -> SentPush:
    """The push with a stroke, and how much further than its goal (mm) the ring goes; `guess` is a lead to begin with (rad).

    Of the two models the first is what the push is made for, as the tables of outcomes have it, the second what is pushed.
    """
    contact = kind.profile(models[0], stroke, limits.acceleration_max).segments
    before = _approach(start.room, float(contact[0, 1]), limits)
    rows = np.vstack((before, contact) if kind.retract else (before, contact, _drawn_back(limits)))
    lead, left = _lead(rows, start, models[1], guess)
    beyond = 0.0 if goal is None else start.offset - left - goal
    return SentPush(lead, rows, until_turn(rows), beyond, len(before))


def _mended(strokes: list[float], tries: list[SentPush]) -> float:
    """The next stroke to try: by the slope of the last two where it is sound, else by a slope of 1."""
    slope = 1.0
    if len(tries) > 1 and strokes[-1] != strokes[-2]:
        slope = (tries[-1].beyond - tries[-2].beyond) / (strokes[-1] - strokes[-2])
    slope = min(max(slope, 0.5), 3.0)
    return max(strokes[-1] - tries[-1].beyond / slope, _LEAST * strokes[0])


def _made_up(rows: Floats, first: int, lag: float) -> Floats:
    """Motion that a slide which follows late under load makes into `rows`: faster as it accelerates, and longer by the lag."""
    out = rows.copy()
    out[first:, 1] += lag * rows[first:, 2]
    return np.insert(out, first, (lag, rows[first, 1], 0.0), axis=0)


def _travel_at_rest(contact: Floats, model: PushModel) -> float:
    """How far the ring goes on a table at rest, mm."""
    out = np.empty(COLUMNS)
    if push(model.parameters, contact, 0.0, out, _NO_LOG) != DONE:
        raise RuntimeError("a push did not end within the greatest number of events")
    return float(out[FINAL_POSITION])


def _approach(room: float, speed: float, limits: CenteringLimits) -> Floats:
    """Motion over the room before the rim that ends with a speed, as fast as the slide can."""
    most = limits.acceleration_max
    top = min(sqrt(most * room + 0.5 * speed * speed), limits.slide_speed_max)
    if top <= speed:  # too near to run up: the tip is still gaining speed where it should have it
        top = speed
    rise, fall = top / most, (top - speed) / most
    cruise = max((room - 0.5 * top * rise - 0.5 * (top + speed) * fall) / top, 0.0)
    rows = [(rise, 0.0, most), (cruise, top, 0.0), (fall, top, -most)]
    return np.array([row for row in rows if row[0] > 0.0])


def _drawn_back(limits: CenteringLimits) -> Floats:
    """A pause, then back."""
    half = sqrt(_CLEAR / limits.acceleration_max)
    most = limits.acceleration_max
    return np.array([(_PAUSE, 0.0, 0.0), (half, 0.0, -most), (half, -most * half, most)])


def _lead(rows: Floats, start: Approach, model: PushModel, guess: float) -> tuple[float, float]:
    """Lead angle (rad) with which nothing is left across the offset, and what is left along it (mm).

    By secants of the direction in which the ring goes: what is left across is also 0 where the tip misses the ring.
    """
    end = start.spindle_speed * until_turn(rows)
    if start.offset <= 0.0 or start.spindle_speed <= 0.0:
        return end, 0.0
    lead, slope, before = guess if guess > 0.0 else end, _SLOPE, (0.0, nan)
    for _ in range(_TRIES):
        along, across = followed(rows, start, model, lead)
        way = start.offset - along
        if way < _MOVED * start.offset:  # the rim goes away before the tip; or the push is too weak
            if lead >= end:
                return end, along
            lead, before = min(lead + _EARLIER * (end - lead) + _NEAR_END, end), (0.0, nan)
            continue
        if abs(across) <= _CLOSE * start.offset:
            break
        off = atan2(across, way)
        if isfinite(before[1]) and lead != before[0]:
            slope = min(max((off - before[1]) / (lead - before[0]), _SLOPES[0]), _SLOPES[1])
        before = lead, off
        lead -= min(max(off / slope, -_LEAP), _LEAP)
        if lead > end + _LATEST:
            lead, before = _EARLIER * end, (0.0, nan)
    return before[0] if abs(across) > _CLOSE * start.offset else lead, along


def followed(rows: Floats, start: Approach, model: PushModel, lead: float) -> tuple[float, float]:
    """Return where a push leaves the centre, along and across the offset it had, mm.

    Parameters
    ----------
    rows : array, (n, 3)
        Motion of the slide.
    start : Approach
        Where it begins.
    model : PushModel
        What is pushed.
    lead : float
        Angle of the offset before the push line at the begin, rad.
    """
    radius, speed = model.part.radius, start.spindle_speed
    state = ring_state(start.offset, -lead, radius, speed)
    state[TIP] = radius + start.offset + start.room
    left = landing(model, speed, rows, state, _ERROR) * exp(1j * lead)
    return left.real, left.imag
