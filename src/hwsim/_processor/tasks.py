"""Tasks of a real-time computer: releases, priorities, execution times, and the job under way."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from fractions import Fraction
from math import ceil, inf, sqrt
from typing import NamedTuple

import numpy as np

from hwsim._part.clock import simplest
from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

NANOSECONDS = 1_000_000_000  # in a second; derived
NEVER = 2**62  # ns; chosen: 146 years, and sums still fit a word
DRAWN = 64  # jobs whose random numbers are drawn together; chosen: fewer cost a numpy call each


class Draw(NamedTuple):
    """Random numbers of one job, ns: delay of its release, execution time."""

    late: int
    execution: int


@stored("hwsim.task")
@dataclass(frozen=True)
class Task(Frozen):
    """A loop of a real-time computer, released by time or by the angle of the spindle.

    Parameters
    ----------
    name : str
        Name.
    period : float, optional
        Time between releases, s. Release k is at k periods, rounded to a nanosecond: 60 Hz does not drift.
    angle_step : float, optional
        Spindle angle between releases, rad; either this or `period`.
    priority : int
        Level, 1 is the most urgent. Jobs of equal level run in the order of release, without pre-emption.
    execution_time : float or tuple
        Processor time of a job, s; or its mean and standard deviation (gamma distributed).
    jitter : float
        Upper limit of a uniform delay of each release, s; less than the period.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind import units
    >>> Task("control", 0.01, execution_time=0.002).share()
    0.2
    >>> model = Task("model", angle_step=units.deg(5.0), execution_time=(0.001, 0.0002))
    >>> round(model.share(units.rpm(100.0)), 12)
    0.12
    """

    name: str
    period: float | None = None
    _: KW_ONLY
    angle_step: float | None = None
    priority: int = 1
    execution_time: float | tuple[float, float] = 0.0
    jitter: float = 0.0

    def __post_init__(self) -> None:
        checks.kind("name", self.name, str)
        if (self.period is None) == (self.angle_step is None):
            raise ValueError(f"{self.name} must have a period (s) or an angle_step (rad), one of them")
        if self.period is not None:
            checks.positive(f"period of {self.name}", self.period, "s")
        if self.angle_step is not None:
            checks.positive(f"angle_step of {self.name}", self.angle_step, "rad")
        checks.count(f"priority of {self.name}", self.priority)
        self._check_times()

    def _check_times(self) -> None:
        if isinstance(self.execution_time, tuple | list) and len(self.execution_time) != 2:
            raise checks.refuse(
                f"execution_time of {self.name}", "a time or (mean, sd)", self.execution_time, "s"
            )
        checks.nonnegative(f"execution_time of {self.name}", self.mean, "s")
        checks.nonnegative(f"sd of the execution_time of {self.name}", self.sd, "s")
        if self.sd and not self.mean:
            raise checks.refuse(
                f"execution_time of {self.name}",
                "of a mean > 0 where its sd is > 0",
                self.execution_time,
                "s",
            )
        checks.nonnegative(f"jitter of {self.name}", self.jitter, "s")
        if self.period is not None and self.jitter >= self.period:
            raise checks.refuse(f"jitter of {self.name}", f"< its period, {self.period:g}", self.jitter, "s")
        if self.period is not None and release_time(simplest(self.period), 1) < 1:
            raise checks.refuse(f"period of {self.name}", "at least a nanosecond", self.period, "s")

    @property
    def mean(self) -> float:
        """Mean execution time, s."""
        return (
            self.execution_time[0] if isinstance(self.execution_time, tuple | list) else self.execution_time
        )

    @property
    def sd(self) -> float:
        """Standard deviation of the execution time, s."""
        return self.execution_time[1] if isinstance(self.execution_time, tuple | list) else 0.0

    def share(self, spindle_speed: float = 0.0) -> float:
        """Return the average share of the processor that the task needs, unit 1.

        Parameters
        ----------
        spindle_speed : float
            Spindle speed for a task released by the angle, rad/s.

        Examples
        --------
        >>> Task("data", 0.01, execution_time=0.001).share()
        0.1
        """
        if self.period is not None:
            return self.mean / self.period
        assert self.angle_step is not None
        return self.mean * spindle_speed / self.angle_step

    def draws(self, rng: np.random.Generator) -> list[Draw]:
        """Draw delays and execution times of the next `DRAWN` jobs (private to this package).

        Always the same number of draws: how time is divided does not change the random numbers of a job.
        """
        late = rng.uniform(0.0, self.jitter, DRAWN) if self.jitter else np.zeros(DRAWN)
        seconds = (
            rng.gamma((self.mean / self.sd) ** 2, self.sd**2 / self.mean, DRAWN)
            if self.sd
            else np.full(DRAWN, self.mean)
        )
        whole = (
            (late * NANOSECONDS).astype(np.int64).tolist(),
            np.rint(seconds * NANOSECONDS).astype(np.int64).tolist(),
        )
        return list(map(Draw, *whole))


def release_time(period: Fraction, number: int) -> int:
    """Time of a release (ns): `number` periods, rounded to the nearest, half up."""
    numerator, denominator = period.numerator * NANOSECONDS * number, period.denominator
    return (2 * numerator + denominator) // (2 * denominator)


class TaskMotion(NamedTuple):
    """Motion of the spindle: begin (ns), angle (rad), speed (rad/s), acceleration (rad/s^2)."""

    time: int
    angle: float
    speed: float
    acceleration: float

    def until(self, target: float) -> float:
        """Time until an angle is first reached, s, without cancellation."""
        way = target - self.angle
        if way <= 0.0:
            return 0.0
        square = self.speed * self.speed + 2.0 * self.acceleration * way
        if square < 0.0:
            return inf  # reverses before the angle
        if self.speed >= 0.0:
            total = self.speed + sqrt(square)
            return 2.0 * way / total if total > 0.0 else inf
        return (sqrt(square) - self.speed) / self.acceleration if self.acceleration > 0.0 else inf


class Released:
    """State of one task: its next release and its job under way."""

    def __init__(
        self, task: Task, place: int, rng: np.random.Generator, angle: float, told: Sequence[bool]
    ) -> None:
        self.task, self.name, self.place, self.rng, self.priority = task, task.name, place, rng, task.priority
        self.told = told  # whether each kind of event is returned
        period = None if task.period is None else simplest(task.period)
        self.period = None if period is None else (period.numerator * NANOSECONDS, period.denominator)  # ns
        self.count = -1  # number of the next release
        self.multiple = 0 if task.angle_step is None else ceil(angle / task.angle_step) - 1
        self.nominal = NEVER  # its time without jitter, ns
        self.drawn: list[Draw] = []  # for the releases after it, the last first
        self.late = self.execution = 0  # of the next release, ns
        self.open = False  # whether a job is incomplete
        self.number = self.release = self.start = self.remaining = 0  # of that job; times in ns
        self.begun = False

    def next(self) -> None:
        """Go on to the next release; missed releases draw too, so that each number has its own draw."""
        self.count += 1
        self.multiple += 1
        if not self.drawn:
            self.drawn = self.task.draws(self.rng)[::-1]
        self.late, self.execution = self.drawn.pop()
        if self.period is not None:  # as release_time
            whole, parts = self.period
            self.nominal = (2 * whole * self.count + parts) // (2 * parts)

    def take(self, now: int) -> None:
        """Start a job from a release."""
        self.open, self.begun, self.number, self.release = True, False, self.count, now
        self.remaining = self.execution

    def crossing(self, motion: TaskMotion) -> int:
        """Time when the spindle reaches the next multiple, ns."""
        assert self.task.angle_step is not None
        way = motion.until(self.multiple * self.task.angle_step) * NANOSECONDS
        return motion.time + round(way) if way < NEVER else NEVER
