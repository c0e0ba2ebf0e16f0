"""Times of a cycle: to the first push, from push to push, and to the end, as the controller takes them."""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.table_limit import TableLimit, least_friction
from centering.cycle._strategy.tip_ways import LATEST
from centering.cycle._strategy.turning_kernels import (
    RESTING,
    measured_at,
    push_to_push,
    speed_after,
    turn_time,
)
from centering.push._profile.timing import rest_to_rest
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

SETTLED = 4  # chosen: pushes after which the belief counts as settled; further ones change its sd little
FIRSTS = 8  # chosen: rotations until the first push; the shorter, the less is known of the radius after it
_PHASES = 16  # chosen: directions of a part at the start, for the mean time to its first push


@dataclass(frozen=True, eq=False)
class CycleTiming(Frozen):
    """Times of a cycle of `CenteringController` with its usual settings; `Strategy.timing`.

    The table runs up as fast as friction allows, keeps its speed in a push, and gains speed between two. A
    measurement lasts until the place is known as well as the push needs; the last one until the part is
    certainly within the tolerance. Times are told from the alignment of pushes: the offset under the tip.

    Attributes
    ----------
    problem : CenteringProblem
        Planned problem.
    offsets, speeds : array, (N,)
        Nodes of the offset, evenly in its logarithm, mm, and table speeds there, rad/s.
    arc : array, (P, F, N)
        Rotation of the table during the measurement before a push, rad, by the number of pushes before and
        the rotation until the first one, evenly in a turn.
    final_arc : array, (P, F, M)
        Rotation during the last measurement, of parts at offsets evenly from 0 to that of a centred one, rad.
    lead : array, (N,)
        Time from the start of a push to its alignment, s.
    after : array, (K, 4)
        Times from the turning point of the tip, by kind of push, s: until the table changes its speed, the
        first reading of a part at rest, the first decision; and time of the fewest readings.
    rate : array, (P, N)
        Acceleration of the table after a push, by the number of pushes before, rad/s^2: what a push shows of
        friction is known only once the part is measured again.
    """

    problem: CenteringProblem
    offsets: Floats
    speeds: Floats
    arc: Floats
    final_arc: Floats
    lead: Floats
    after: Floats
    rate: Floats

    @property
    def _sample(self) -> float:
        return self.problem.limits.sample_time

    @cached_property
    def limit(self) -> TableLimit:
        """Speeds (rad/s) and rates (rad/s^2) that hold a part before a push has shown its friction."""
        return table_limit(self.problem)

    @cached_property
    def before(self) -> Floats:
        """Mean table speed at a push, (P, F, N), rad/s: by pushes before and rotation until the first one."""
        each = [2.0 * pi * (np.array([0.25, 0.75]) + k) / FIRSTS for k in range(FIRSTS)]
        first = [[self._first_pushes(float(d), phases)[1].mean() for d in self.offsets] for phases in each]
        found, held = [np.array(first)], float(np.median(self.after[:, 0]))
        came = np.array([[self._at(row, 0.5 * self.problem.offset_max)] for row in found[0]])
        begun = np.minimum(found[0], came)
        for rates in self.rate[:-1]:
            begun = np.array([_mean_reached(row, self.speeds, rates, held, self.lead) for row in begun])
            found.append(begun)
        return np.array(found)

    def of_kind(self, kind: int, pushes: int) -> tuple[Any, ...]:
        """Return the times of a kind of push after `pushes` for `all_draws` (s, rad, rad/s, rad/s^2)."""
        seen, then = min(pushes, SETTLED), min(pushes + 1, SETTLED)
        tip = tuple(self.after[kind].tolist())
        turned = self.arc[then], self.final_arc[then], self.before[seen], self.rate[seen]
        return tip, self.lead + LATEST * self._sample, self.lead, *turned

    def start_time(self, offset: float) -> float:
        """Return the mean time from rest to the first push at an offset (mm), s."""
        phases = 2.0 * pi * (np.arange(_PHASES) + 0.5) / _PHASES
        return float(np.mean(self._first_pushes(offset, phases)[0]))

    def first_push(self, offset: float, phase: float) -> tuple[float, float]:
        """Return time (s) from rest and table speed (rad/s) at the first push of a part at an offset (mm).

        The table turns by `phase` (rad) further than to the soonest push.
        """
        time, speed, _ = self._first_pushes(offset, np.array([phase]))
        return float(time[0]), float(speed[0])

    def first_speeds(self, offset: float, phase: float) -> Floats:
        """Return speeds (rad/s) of the run-up to the `first_push`, of an offset (mm) and a phase (rad)."""
        speeds, _, turned = way = self._run_up(offset)
        return np.asarray(speeds[turned <= self._first_pushes(offset, np.array([phase]), way)[2]])

    def _run_up(self, offset: float) -> tuple[Floats, Floats, Floats]:
        return self.limit.run_up(offset, self.speed(offset))

    def _first_pushes(
        self, offset: float, phases: Floats, way: tuple[Floats, Floats, Floats] | None = None
    ) -> tuple[Floats, Floats, Floats]:
        limits, (speeds, times, turned) = self.problem.limits, way or self._run_up(offset)
        goal = speeds[-1]
        arc, lead = self._at(self.arc[0, 0], offset), self._at(self.lead, offset)
        known = np.interp(np.sqrt(arc), np.sqrt(turned), times) + max(arc - turned[-1], 0.0) / goal
        there = rest_to_rest(limits.follow_gap, limits.slide_speed_max, limits.acceleration_max)
        soonest = max(float(known) + LATEST * self._sample, there)
        aligned = turned + speeds * lead  # of pushes that start in the run-up: they keep its speed
        angle = phases + np.interp(soonest, times, aligned) + max(soonest - times[-1], 0.0) * goal
        time = lead + np.interp(angle, aligned, times) + np.maximum(angle - aligned[-1], 0.0) / goal
        return time, np.interp(angle, aligned, speeds), angle

    def speed(self, offset: float) -> float:
        """Return the table speed at an offset (mm), rad/s."""
        return self._at(self.speeds, offset)

    def _at(self, values: Floats, offset: float) -> float:
        """Value at an offset (mm), between the nodes."""
        return float(np.interp(self._place(offset), self._nodes, values))

    def _place(self, offset: float) -> float:
        return float(np.log(max(offset, self.offsets[0])))

    @cached_property
    def _nodes(self) -> Floats:
        return np.log(self.offsets)

    def next_push(
        self,
        kind: int,
        pressed: float,
        phase: float,
        before: float,
        offset: float,
        pushes: int,
        first: float,
    ) -> tuple[float, float]:
        """Return the time (s) from a push to the next, and the table speed (rad/s) at that.

        Parameters
        ----------
        kind : int
            Kind of the push.
        pressed : float
            Time from its touch to the turning point of the tip, s.
        phase : float
            Rotation of the table that brings the part under the tip, rad.
        before : float
            Table speed at the push, rad/s.
        offset : float
            Offset after it, mm.
        pushes : int
            Pushes before it.
        first : float
            Phase of the `first_push` of the part, rad.
        """
        tip, row = tuple(self.after[kind].tolist()), self._columns[min(pushes, SETTLED), _part_of_turn(first)]
        there = _interpolated(self._place(offset), self._nodes, row)
        time, reached = push_to_push(phase, RESTING * pressed, tip, before, *there)
        return float(time), float(reached)

    @cached_property
    def _columns(self) -> Floats:
        """Columns of `push_to_push` at the offsets, (P, F, 5, N): by pushes before and first rotation."""
        launch = self.lead + LATEST * self._sample
        later = [min(seen + 1, SETTLED) for seen in range(SETTLED + 1)]
        rows = [
            [(self.speeds, self.rate[seen], arcs, launch, self.lead) for arcs in self.arc[then]]
            for seen, then in enumerate(later)
        ]
        return np.array(rows)

    def end_time(
        self, kind: int, pressed: float, before: float, offset: float, pushes: int, first: float
    ) -> float:
        """Return the time from the last push to the end, s.

        Parameters
        ----------
        kind, pressed, before, offset, pushes, first
            Arguments as of `next_push`: s, rad/s, mm, rad.
        """
        tip, _, _, _, ends, _, rates = self.of_kind(kind, pushes)
        arcs = ends[_part_of_turn(first)]
        arc = float(np.interp(offset, np.linspace(0.0, self.offsets[0], arcs.size), arcs))
        goal, rate = float(self.speeds[0]), float(rates[0])
        return float(measured_at(RESTING * pressed, tip, before, goal, rate, arc))


def table_limit(problem: CenteringProblem) -> TableLimit:
    """Return the limit of the table before a push has shown the friction of a part."""
    return TableLimit(problem, least_friction(problem))


def _mean_reached(before: Floats, speeds: Floats, rates: Floats, held: float, steady: Floats) -> Floats:
    """Mean speeds (rad/s) of tables after rotations (rad) from one push to the next, any part of a turn."""
    phases = (2.0 * pi * (np.arange(_PHASES) + 0.5) / _PHASES).tolist()
    found = []
    for begun, speed, rate, lead in zip(*(x.tolist() for x in (before, speeds, rates, steady)), strict=True):
        times = [turn_time(phase, begun, speed, rate, held, lead) for phase in phases]
        found.append(sum(speed_after(time, begun, speed, rate, held, lead) for time in times) / _PHASES)
    return np.array(found)


def _interpolated(place: float, nodes: Floats, rows: Floats) -> list[float]:
    """Return each row, (R, N), at a place, as `numpy.interp` does."""
    k = min(max(int(nodes.searchsorted(place, "right")) - 1, 0), nodes.size - 2)
    left, right, along = rows[:, k], rows[:, k + 1], min(max(place, nodes[0]), nodes[-1]) - nodes[k]
    values: list[float] = ((right - left) / (nodes[k + 1] - nodes[k]) * along + left).tolist()
    return values


def _part_of_turn(first: float) -> int:
    """Which of the tabulated rotations until the first push one (rad) is."""
    return int(first / (2.0 * pi) % 1.0 * FIRSTS)
