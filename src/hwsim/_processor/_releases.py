"""One task on the processor: when it is released, by its period or by the angle of the spindle, and its job under way."""

from collections.abc import Sequence
from math import ceil, inf, sqrt
from typing import NamedTuple

import numpy as np

from hwsim._part.clock import simplest
from hwsim._processor.tasks import NANOSECONDS, Draw, Task

NEVER = 2**62  # ns: 146 years


class Motion(NamedTuple):
    """How the spindle turns: from when (ns), rad, rad/s, rad/s^2."""

    time: int
    angle: float
    speed: float
    acceleration: float

    def until(self, target: float) -> float:
        """Time until an angle is reached for the first time, s; written so that nothing cancels."""
        way = target - self.angle
        if way <= 0.0:
            return 0.0
        square = self.speed * self.speed + 2.0 * self.acceleration * way
        if square < 0.0:
            return inf  # it turns back before
        if self.speed >= 0.0:
            total = self.speed + sqrt(square)
            return 2.0 * way / total if total > 0.0 else inf
        return (sqrt(square) - self.speed) / self.acceleration if self.acceleration > 0.0 else inf


class Released:
    """What changes of one task."""

    def __init__(self, task: Task, place: int, rng: np.random.Generator, angle: float, told: Sequence[bool]) -> None:
        self.task, self.name, self.place, self.rng, self.priority = task, task.name, place, rng, task.priority
        self.told = told  # of each kind of event
        period = None if task.period is None else simplest(task.period)
        self.period = None if period is None else (period.numerator * NANOSECONDS, period.denominator)  # ns
        self.count = -1  # of the release to come
        self.multiple = 0 if task.angle_step is None else ceil(angle / task.angle_step) - 1
        self.nominal = NEVER  # ns, when it comes without jitter
        self.drawn: list[Draw] = []  # ns, for the releases after it, the last first
        self.late = self.execution = 0  # ns, of the release to come
        self.open = False  # whether a job is not complete
        self.number = self.release = self.start = self.remaining = 0  # of that job; ns but the first
        self.begun = False

    def next(self) -> None:
        """Go on to the next release; each draws, also where it will be missed, so that a number always has its draw."""
        self.count += 1
        self.multiple += 1
        if not self.drawn:
            self.drawn = self.task.draws(self.rng)[::-1]
        self.late, self.execution = self.drawn.pop()
        if self.period is not None:  # as release_time, the nearest
            whole, parts = self.period
            self.nominal = (2 * whole * self.count + parts) // (2 * parts)

    def take(self, now: int) -> None:
        """Make a job of a release."""
        self.open, self.begun, self.number, self.release = True, False, self.count, now
        self.remaining = self.execution

    def crossing(self, motion: Motion) -> int:
        """When the spindle reaches the next multiple, ns."""
        assert self.task.angle_step is not None
        way = motion.until(self.multiple * self.task.angle_step) * NANOSECONDS
        return motion.time + round(way) if way < NEVER else NEVER
