"""From a chosen push to its command: motion of the slide and table angle of its start."""

from cmath import exp
from dataclasses import dataclass
from math import atan2, isfinite, nan

import numpy as np

from centering._problem.model import PushModel
from centering._problem.problem import CenteringLimits
from centering.cycle._strategy.outcomes import PushKind, rows_of, until_turn
from centering.cycle._strategy.tip_ways import approach_rows, drawn_back_rows
from centering.push._contact.reaction_kernels import (
    COLUMNS,
    DONE,
    FINAL_POSITION,
    LOG_COLUMNS,
    TRAVEL,
    push,
)
from centering.push.turning._plane_kernels import TIP
from centering.push.turning._shooting import landing, ring_state
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

_ERROR = 1e-6  # mm, chosen: of a step of the push in the plane
_TRIES = 12  # chosen: simulations of one lead
_MOVED = 0.2  # chosen: travel over offset below which the tip hardly touched the ring
_EARLIER, _NEAR_END = (
    0.5,
    1e-3,
)  # chosen: next lead after a miss: share of the way to alignment at the end; rad
_SLOPE, _SLOPES, _LEAP = (
    -0.7,
    (-3.0, -0.3),
    0.5,
)  # chosen: d direction/d lead at first, its bounds; rad a step
_LATEST = 0.2  # rad, chosen: beyond alignment at the end; later the rim meets the tip from its other side
_CLOSE = 1e-4  # chosen: remaining offset across over the offset; far below the scatter of the direction
_MENDINGS = 4  # chosen: corrections of one stroke
_MEND = 2e-4  # mm, chosen: smallest correction
_LEAST = 0.2  # chosen: smallest corrected stroke over the nominal one
_NO_LOG = np.empty((0, LOG_COLUMNS))


@dataclass(frozen=True, eq=False)
class SentPush(Frozen):
    """Push as it is sent.

    Parameters
    ----------
    lead : float
        Rotation of the table from the start of the motion until the offset is on the push line, rad.
    rows : array, (n, 3)
        Motion of the slide: duration (s), initial speed (mm/s), acceleration (mm/s^2), positive toward the
        axis.
    stop_time : float
        Time from the start until the tip turns back, s.
    beyond : float
        Expected excess travel over that on a table at rest, mm, after correction of the stroke.
    first : int
        First row of the push, after the approach.
    """

    lead: float
    rows: Floats
    stop_time: float
    beyond: float
    first: int

    @property
    def duration(self) -> float:
        """Duration of the whole motion, s."""
        return float(self.rows[:, 0].sum())


@dataclass(frozen=True)
class Approach(Frozen):
    """Start of a push.

    Parameters
    ----------
    offset : float
        Offset of the part, mm.
    room : float
        Distance from the waiting tip to the furthest rim, mm.
    spindle_speed : float
        Table speed, rad/s.
    """

    offset: float
    room: float
    spindle_speed: float


def launch(
    kind: PushKind,
    stroke: float,
    start: Approach,
    model: PushModel,
    limits: CenteringLimits,
    lag: float = 0.0,
    friction: float = 1.0,
) -> SentPush:
    """Return the command of a push.

    The tip reaches its speed before the furthest place of the rim and stops where it would for a table at
    rest, for which the stroke was chosen. The start follows from a simulation of ring, tip and table in the
    plane, so that the remaining offset lies along the old one. The stroke is corrected for the effect of the
    turning table on the travel.

    Parameters
    ----------
    kind : PushKind
        Kind of push.
    stroke : float
        Travel of the tip from the rim, mm.
    start : Approach
        Offset and room (mm), table speed (rad/s).
    model : PushModel
        Model of the part.
    limits : CenteringLimits
        Limits of the slide.
    lag : float
        Delay of the loaded slide, s, compensated: following error over speed of Mears' Table 3.2.
    friction : float
        Believed friction of the part over that of the model.
    """
    felt = felt_model(model, friction)
    goal = _travel_at_rest(rows_of(kind, model, stroke, limits.acceleration_max), felt)
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
    """Return an approximate command of a later push: `launch` with its stroke uncorrected (`beyond` = 0).

    Parameters
    ----------
    kind, stroke, start, model, limits, friction
        As for `launch` (mm, rad/s).
    """
    return _tried(kind, stroke, start, (model, felt_model(model, friction)), limits, None)


def felt_model(model: PushModel, friction: float) -> PushModel:
    """Return a model with its friction multiplied by a friction scale."""
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
    """Push with a stroke and its excess travel over the goal (mm); `guess` is an initial lead (rad).

    Of the two models the first is nominal, as in the tables of outcomes, the second is the believed one.
    """
    contact = rows_of(kind, models[0], stroke, limits.acceleration_max)
    before = approach_rows(start.room, float(contact[0, 1]), limits)
    rows = np.vstack((before, contact) if kind.retract else (before, contact, drawn_back_rows(limits)))
    lead, left = _lead(rows, start, models[1], guess)
    beyond = 0.0 if goal is None else start.offset - left - goal
    return SentPush(lead, rows, until_turn(rows), beyond, len(before))


def _mended(strokes: list[float], tries: list[SentPush]) -> float:
    """Next stroke: secant of the last two where it is sound, else slope 1."""
    slope = 1.0
    if len(tries) > 1 and strokes[-1] != strokes[-2]:
        slope = (tries[-1].beyond - tries[-2].beyond) / (strokes[-1] - strokes[-2])
    slope = min(max(slope, 0.5), 3.0)
    return max(strokes[-1] - tries[-1].beyond / slope, _LEAST * strokes[0])


def _made_up(rows: Floats, first: int, lag: float) -> Floats:
    """Motion that a slide with lag turns into `rows`: faster while accelerating, and longer by the lag."""
    out = rows.copy()
    out[first:, 1] += lag * rows[first:, 2]
    return np.insert(out, first, (lag, rows[first, 1], 0.0), axis=0)


def _travel_at_rest(contact: Floats, model: PushModel) -> float:
    """Travel of the ring on a table at rest, mm."""
    out = np.empty(COLUMNS)
    if push(model.parameters, contact, 0.0, out, _NO_LOG, TRAVEL) != DONE:
        raise RuntimeError("a push did not end within the greatest number of events")
    return float(out[FINAL_POSITION])


def _lead(rows: Floats, start: Approach, model: PushModel, guess: float) -> tuple[float, float]:
    """Lead angle (rad) without remaining offset across the old one, and the remaining offset along it (mm).

    By secants on the direction of travel, since the offset across also vanishes where the tip misses the
    ring.
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


def followed(
    rows: Floats, start: Approach, model: PushModel, lead: float, error: float = _ERROR
) -> tuple[float, float]:
    """Return the centre after a push, along and across the old offset, mm.

    Parameters
    ----------
    rows : array, (n, 3)
        Motion of the slide.
    start : Approach
        Start of the push.
    model : PushModel
        Model of the part.
    lead : float
        Angle of the offset before the push line at the start, rad.
    error : float
        Integration error of a step, mm.
    """
    radius, speed = model.part.radius, start.spindle_speed
    state = ring_state(start.offset, -lead, radius, speed)
    state[TIP] = radius + start.offset + start.room
    left = landing(model, speed, rows, state, error) * exp(1j * lead)
    return left.real, left.imag
