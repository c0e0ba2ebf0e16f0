"""Monte-Carlo of a strategy: pushes by the exact simulator, independent of the strategy's own table."""

from typing import Any, Protocol

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.belief import Belief, PushEvidence
from centering.cycle._strategy.choice import PushChoice
from centering.cycle._strategy.cycle_times import FORCE_SHOWS
from centering.cycle._strategy.density import prior
from centering.cycle._strategy.draw_kernels import push_once
from centering.cycle._strategy.outcomes import FRICTION_SCALES, PushKind, rows_of, scaled, travels, until_turn
from centering.cycle._strategy.runs import CenteringRuns
from centering.cycle._strategy.timing import CycleTiming
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator

_LONG = 1.0  # mm, chosen: the turning table changes the travel of a longer push, as in `CenteringController`
_LEAST_SHARE = 0.1  # chosen: of the greatest offset: where parts begin unless told


class Followed(Protocol):
    """Interface of a strategy for its simulation; see `Strategy`."""

    problem: CenteringProblem
    finish: float
    kinds: tuple[PushKind, ...]

    @property
    def timing(self) -> CycleTiming: ...
    def push(self, *, offset: float, friction: float = 1.0, evidence: float = 0) -> PushChoice: ...
    def update_belief(
        self,
        friction: float,
        evidence: float,
        commanded: PushChoice,
        travelled: float,
        *,
        weights: Floats | None = None,
        shown: PushEvidence | None = None,
    ) -> Belief: ...


def simulate(strategy: Followed, parts: int, rng: Seed, start: Any) -> CenteringRuns:
    """Centre `parts` parts; see `Strategy.simulate`."""
    random = generator(rng)
    checks.count("runs", parts)
    offset_max = strategy.problem.offset_max
    begun = (
        random.uniform(_LEAST_SHARE * offset_max, offset_max, parts)
        if start is None
        else np.array(start, dtype=float)
    )
    begun = np.broadcast_to(checks.finite_array("start", begun, "mm"), parts)
    if np.any(begun <= 0.0) or np.any(begun > offset_max):
        raise checks.refuse(
            "start", f"in (0, {offset_max:g}]", float(begun[(begun <= 0.0) | (begun > offset_max)][0]), "mm"
        )
    return Parts(strategy, begun, random).run()


class Parts:
    """Parts simulated side by side; each draws equally often at every push, so none depends on another.

    `factor`: true mean friction over that of the model.
    """

    def __init__(
        self, strategy: Followed, start: Floats, random: np.random.Generator, factor: float = 1.0
    ) -> None:
        self.strategy, self.random, self.start = strategy, random, start
        self.scatter, count = strategy.problem.scatter, start.size
        self.scale = factor * (1.0 + self.scatter.friction_part_sd * random.standard_normal(count))
        self.offset = start.copy()
        self.beliefs = [Belief(1.0, 0.0, prior(strategy.problem, 1.0, 0.0))] * count
        self.waiting = np.ones(count, dtype=bool)
        self.pushes = np.zeros(count, dtype=np.int64)
        self.last = np.full(count, np.nan)  # time since the latest push, s
        self.measured = np.abs(self.offset + self.scatter.measuring_sd * random.standard_normal(count))
        self.phase = random.uniform(0.0, 2.0 * np.pi, count)  # first push after the soonest, rad
        begun = [
            strategy.timing.first_push(float(d), float(phase))
            for d, phase in zip(self.measured, self.phase, strict=True)
        ]
        self.time, self.speed = np.array(begun).T  # s; of the table, rad/s

    def run(self) -> CenteringRuns:
        """Push until all parts are measured as centred or abandoned."""
        self.waiting = self.measured > self.strategy.finish
        for _ in range(self.strategy.problem.pushes_max):
            if not self.waiting.any():
                break
            self._push()
        good = ~self.waiting & (self.offset <= self.strategy.problem.tolerance)
        return CenteringRuns(
            self.start, self.time, self.pushes, self.offset, good, self.strategy.problem, self.last
        )

    def _push(self) -> None:
        """One push of all waiting parts."""
        unit = self.random.standard_normal((5, self.offset.size))
        at = np.flatnonzero(self.waiting)
        choices = [
            self.strategy.push(
                offset=float(self.measured[k]),
                friction=self.beliefs[k].friction,
                evidence=self.beliefs[k].evidence,
            )
            for k in at
        ]
        travel = self._travel(at, choices, unit)
        for k, choice, x in zip(at, choices, travel, strict=True):
            self._move(int(k), choice, float(x), unit[:, k])

    def _travel(self, at: Any, choices: list[PushChoice], unit: Floats) -> Floats:
        """Travel of the parts, mm: the tip meets the part where it is, stops as commanded, plus scatter."""
        place = self.offset[at] - self.measured[at] + self.scatter.stop_sd * unit[1, at]
        scale = np.array([self._friction(int(k), unit[:, k]) for k in at])
        model = self.strategy.problem.model
        pushes = [
            self._rows(choice, max(choice.stroke + p, 1e-6))
            for choice, p in zip(choices, place.tolist(), strict=True)
        ]
        return travels(np.array([scaled(model, float(r)) for r in scale]), pushes)

    def _rows(self, choice: PushChoice, stroke: float) -> Floats:
        """Motion of the tip (s, mm/s, mm/s^2) in a push with another stroke (mm)."""
        problem = self.strategy.problem
        return rows_of(
            self.strategy.kinds[choice.kind], problem.model, stroke, problem.limits.acceleration_max
        )

    def _friction(self, k: int, unit: Floats) -> float:
        """Friction scale of a push of part k."""
        return max(0.2, float(self.scale[k] * (1.0 + self.scatter.friction_push_sd * unit[0])))

    def _learn(self, k: int, choice: PushChoice, seen: float, unit: Floats) -> None:
        """Update the belief about part k: by the travel seen (mm); at first and of long pushes by force."""
        friction, evidence, weights = self.beliefs[k]
        shown = None
        if evidence == 0.0 or choice.aim > _LONG:
            felt = self._friction(k, unit) + FORCE_SHOWS * unit[4]
            shown = PushEvidence(FRICTION_SCALES[None], np.array([FORCE_SHOWS]), np.array([felt]))
        self.beliefs[k] = self.strategy.update_belief(
            friction, evidence, choice, seen, weights=weights, shown=shown
        )

    def _move(self, k: int, choice: PushChoice, travel: float, unit: Floats) -> None:
        """Record a push of part k: place, measurement, duration, friction belief."""
        strategy = self.strategy
        self.offset[k], phase = push_once(self.offset[k], travel, self.scatter.direction_sd * unit[2])
        before = self.measured[k]
        self.measured[k] = abs(self.offset[k] + self.scatter.measuring_sd * unit[3])
        seen = float(
            np.sqrt(before**2 + self.measured[k] ** 2 - 2.0 * before * self.measured[k] * np.cos(phase))
        )
        self._learn(k, choice, seen, unit)
        self.waiting[k] = self.measured[k] > strategy.finish
        pressed, times = until_turn(self._rows(choice, choice.stroke)), strategy.timing
        at = float(self.speed[k]), float(self.measured[k]), int(self.pushes[k]), float(self.phase[k])
        if self.waiting[k]:
            self.last[k], self.speed[k] = times.next_push(choice.kind, pressed, phase, *at)
        else:
            self.last[k] = times.end_time(choice.kind, pressed, *at)
        self.time[k] += self.last[k]
        self.pushes[k] += 1
