"""Outcome of pushes: travel of the part by kind, stroke and friction, simulated exactly and tabulated."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import cached_property, partial
from math import sqrt

import numpy as np

from centering._problem.model import PushModel
from centering.cycle._strategy.outcome_kernels import FINE, stroke_for, travel_at
from centering.push._contact.reaction import refuse_unfinished
from centering.push._contact.reaction_kernels import COLUMNS, FINAL_POSITION, TRAVEL, push_many
from centering.push._profile.gentle import gentle_push, profile_of, tap
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import execute
from sdpgrind.base.quantities import Described, array, choice, custom, described, flag, quantity

_FIRST, _EACH, _SCALES = -1.6, 1.0 / 15.0, 62  # chosen: first node, step and number, in inverse sinh
FRICTION_SCALES = 1.0 + FINE * np.sinh(_FIRST + _EACH * np.arange(_SCALES))
"""Friction scales of the tables, 0.41 to 2.46: steps of 1/60 near 1, wider far from it."""
_STEP = 1.02  # chosen: ratio of neighbouring strokes
_LONGEST = 0.25  # chosen: longest time of pushing, s; a longer push belongs to a faster kind
_SPREAD = 0.045  # chosen: sd of the friction scale for the mean travel; that of a push after a few were seen


@described("centering.push_kind")
class PushKind(Described):
    """Kind of push.

    Parameters
    ----------
    shape : {"trapezoid", "gentle"}
        Constant speed from the first touch and full deceleration, or `gentle_profile`.
    push_speed : float
        Greatest speed of the tip, mm/s.
    retract : bool
        Whether the tip retracts at once.

    Raises
    ------
    ValueError
        Unknown shape, or a speed <= 0.

    Examples
    --------
    >>> PushKind("trapezoid", 10.0, True).name
    'trapezoid 10 mm/s, drawn back'
    """

    shape: str = choice("trapezoid", "gentle")
    push_speed: float = quantity("mm/s", above=0, usual=(0.01, 2000.0), typical=20)
    retract: bool = flag()

    @property
    def name(self) -> str:
        """Description, with the speed in mm/s."""
        return f"{self.shape} {self.push_speed:.4g} mm/s" + (", drawn back" if self.retract else "")

    def profile(self, model: PushModel, stroke: float, acceleration: float) -> TipProfile:
        """Return the motion of the tip from the first touch on.

        Parameters
        ----------
        model : PushModel
            Believed model of the part.
        stroke : float
            Greatest travel of the tip after the first touch, mm.
        acceleration : float
            Acceleration of the slide, mm/s^2.
        """
        stroke = checks.positive("stroke", stroke, "mm")
        return profile_of(
            rows_of(self, model, stroke, checks.positive("acceleration", acceleration, "mm/s^2"))
        )


def rows_of(kind: PushKind, model: PushModel, stroke: float, acceleration: float) -> Floats:
    """Return the rows of `PushKind.profile`: duration (s), initial velocity (mm/s), acceleration (mm/s^2)."""
    if kind.shape == "gentle":
        return gentle_push(model, stroke, kind.push_speed, acceleration)
    if kind.retract:
        return tap(stroke, kind.push_speed, acceleration)
    return _stopped_push(stroke, kind.push_speed, acceleration)


def _stopped_push(stroke: float, speed: float, acceleration: float) -> Floats:
    """Rows at constant speed (mm/s) that stop after `stroke` (mm) at full deceleration."""
    top = min(speed, sqrt(2.0 * acceleration * stroke))
    cruise = stroke / top - top / (2.0 * acceleration)
    rows = [(cruise, top, 0.0)] if cruise > 1e-9 else []
    return np.array([*rows, (top / acceleration, top, -acceleration)])


def default_kinds(top_speed: float) -> tuple[PushKind, ...]:
    """Return the default kinds of push: slow taps up to `top_speed` (mm/s), and gentle ones."""
    taps = [PushKind("trapezoid", speed, True) for speed in (2.0, 5.0, 20.0, 40.0) if speed < top_speed]
    gentle = [PushKind("gentle", speed, True) for speed in (5.0, 10.0, 20.0, 40.0) if speed < top_speed]
    return (
        *taps,
        PushKind("trapezoid", top_speed, True),
        PushKind("trapezoid", min(10.0, top_speed), False),
        *gentle,
    )


@described("centering.outcomes")
class OutcomeTable(ByValue, Described):
    """Travel of a part by kind of push, stroke and friction scale.

    Attributes
    ----------
    kinds : tuple of PushKind
        (K,).
    first_stroke, stroke_ratio : float
        Stroke i is ``first_stroke stroke_ratio^i``, mm.
    travel : array, (K, S, R)
        Travel at the friction scales `FRICTION_SCALES`, mm.
    contact_time : array, (K, S)
        Time from first touch to the turning point of the tip, s.
    last : array of int, (K,)
        Index of the greatest stroke of each kind.
    """

    kinds: tuple[PushKind, ...] = custom()
    first_stroke: float = custom(unit="mm")
    stroke_ratio: float = custom(unit="1")
    travel: Floats = array("mm", finite=False)
    contact_time: Floats = array("s", finite=False)
    last: Floats = array("1", np.int64, finite=False)

    def _check(self) -> None:
        if self.travel.shape[-1] != _SCALES:
            rule = f"of shape (K, S, {_SCALES}), as a plan of this version has it"
            raise self._refused("travel", rule, self.travel.shape)

    def __repr__(self) -> str:
        last = self.first_stroke * self.stroke_ratio ** (self.travel.shape[1] - 1)
        strokes = self.travel.shape[1]
        return f"OutcomeTable({len(self.kinds)} kinds of push, {strokes} strokes up to {last:.4g} mm)"

    @cached_property
    def grid(self) -> tuple[float, float, float, float]:
        """Log of the first stroke (mm) and of the ratio, first friction scale and step (asinh, unit 1)."""
        return float(np.log(self.first_stroke)), float(np.log(self.stroke_ratio)), _FIRST, _EACH

    @property
    def stroke_range(self) -> tuple[float, float]:
        """First stroke (mm), and ratio of neighbours."""
        return self.first_stroke, self.stroke_ratio

    @cached_property
    def strokes(self) -> Floats:
        """Strokes of the table, (S,), mm."""
        return lasting(self.first_stroke * self.stroke_ratio ** np.arange(self.travel.shape[1]))

    @cached_property
    def mean_travel(self) -> Floats:
        """Mean travel about each friction scale, monotone in the stroke, (K, S, R), mm: for its choice."""
        node, weight = np.polynomial.hermite_e.hermegauss(9)
        at = np.clip(np.add.outer(FRICTION_SCALES, _SPREAD * node), FRICTION_SCALES[0], FRICTION_SCALES[-1])
        cell = (np.arcsinh((at - 1.0) / FINE) - _FIRST) / _EACH
        hat = np.maximum(0.0, 1.0 - np.abs(cell[:, :, None] - np.arange(_SCALES)))
        blur = np.einsum("q,jqr->jr", weight / weight.sum(), hat)
        return lasting(np.maximum.accumulate(self.travel @ blur.T, axis=1))

    def expected(self, kind: int, stroke: float, friction: float) -> float:
        """Return the travel (mm) of a kind of push with a stroke (mm) at a friction scale."""
        return float(travel_at(self.travel[kind], self.grid, stroke, friction))

    def travels(self, kind: int, stroke: float) -> Floats:
        """Return the travels (mm) of a kind of push with a stroke (mm) at the friction scales, (R,)."""
        first, step = self.grid[:2]
        at = min(max((np.log(max(stroke, 1e-300)) - first) / step, 0.0), self.travel.shape[1] - 1.0)
        low = min(int(at), self.travel.shape[1] - 2)
        table = self.travel[kind]
        return np.asarray((1.0 - at + low) * table[low] + (at - low) * table[low + 1])

    def stroke_for(self, kind: int, travel: float, friction: float) -> float:
        """Return the stroke (mm) of a kind (index) with mean `travel` (mm) at a friction scale; inf: none."""
        return float(stroke_for(self.mean_travel[kind], self.grid, int(self.last[kind]), friction, travel))


def simulated(
    model: PushModel,
    kinds: Sequence[PushKind],
    *,
    longest: float,
    acceleration: float,
    executor: Executor | None = None,
    tell: Callable[[float, str], None],
) -> OutcomeTable:
    """Return the table of a model, simulated push by push, for strokes up to `longest` mm."""
    first = 0.3 * min(model.breakaway_force / model.contact_stiffness, longest)
    count = int(np.ceil(np.log(longest / first) / np.log(_STEP))) + 1
    strokes: Floats = np.asarray(first * _STEP ** np.arange(count))
    work = partial(_rows, model, strokes, acceleration)
    found = []
    for at in range(0, len(kinds), 2 if executor is None else len(kinds)):
        tell(at / len(kinds), f"simulating pushes, {kinds[at].name}")
        found += execute(work, kinds[at : at + (2 if executor is None else len(kinds))], executor)
    travel, time, last = (np.array(part) for part in zip(*found, strict=True))
    return OutcomeTable(tuple(kinds), float(first), _STEP, travel, time, last)


def _rows(
    model: PushModel, strokes: Floats, acceleration: float, kind: PushKind
) -> tuple[Floats, Floats, int]:
    """Travel [stroke, friction scale], contact time [stroke] and last stroke of one kind of push."""
    pushes, times = [], []
    for stroke in strokes.tolist():
        pushes.append(rows_of(kind, model, stroke, acceleration))
        times.append(until_turn(pushes[-1]))
        if times[-1] > _LONGEST:
            break
    count = len(pushes)
    travel = np.zeros((strokes.size, FRICTION_SCALES.size))
    for k, scale in enumerate(FRICTION_SCALES.tolist()):
        travel[:count, k] = travels(scaled(model, scale)[None], pushes)
    travel[count:] = travel[count - 1]
    return travel, np.pad(times, (0, strokes.size - count), mode="edge"), count - 1


def travels(parameters: Floats, pushes: Sequence[Floats]) -> Floats:
    """Return the travels (mm) of parts in pushes by their rows; `parameters`, (m, 6) or (1, 6): of all."""
    segments, ends = np.concatenate(pushes), np.cumsum([len(rows) for rows in pushes])
    out, status = np.empty((ends.size, COLUMNS)), np.empty(ends.size, dtype=np.int64)
    push_many(parameters, segments, ends, np.zeros(ends.size), out, status, TRAVEL)
    refuse_unfinished(status)
    return out[:, FINAL_POSITION].copy()


def scaled(model: PushModel, scale: float) -> Floats:
    """Parameters of a model with both friction coefficients multiplied by a friction scale."""
    parameters = model.parameters
    parameters[3:5] *= scale
    return parameters


def until_turn(rows: Floats) -> float:
    """Time until a tip stops, s; rows of duration (s), initial speed (mm/s), acceleration (mm/s^2)."""
    ahead = np.flatnonzero(rows[:, 1] + rows[:, 2] * rows[:, 0] > 1e-9)
    last = int(ahead[-1]) + 2 if ahead.size else 1
    return float(rows[:last, 0].sum())
