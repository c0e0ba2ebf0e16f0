"""Tasks of a real-time computer: when they are released, how urgent they are, how long they take."""

from dataclasses import KW_ONLY, dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from hwsim._part.clock import simplest
from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

NANOSECONDS = 1_000_000_000  # in a second
DRAWN = 64  # jobs whose random numbers are drawn together


class Draw(NamedTuple):
    """What is random about one job, ns: how late it is released, how long it runs."""

    late: int
    execution: int


@stored("hwsim.task")
@dataclass(frozen=True)
class Task(Frozen):
    """A loop of a real-time computer, released by time or by the angle of the spindle.

    Parameters
    ----------
    name : str
        What it is called.
    period : float, optional
        Between two releases, s: the k-th comes at k periods, rounded to a nanosecond, so that 60 Hz does not drift.
    angle_step : float, optional
        Between two releases, rad of the spindle; either this or `period`.
    priority : int
        Level, 1 is the most urgent; of equal levels the job released first runs first, and neither pre-empts the other.
    execution_time : float or tuple
        Time that a job takes on the processor alone, s; or its mean and standard deviation (gamma distributed).
    jitter : float
        A release comes late by a uniform draw between 0 and this, s; less than the period.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind import units
    >>> Task("control", 0.01, execution_time=0.002).share()
    0.2
    >>> round(Task("model", angle_step=units.deg(5.0), execution_time=(0.001, 0.0002)).share(units.rpm(100.0)), 12)
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
            raise checks.refuse(f"execution_time of {self.name}", "a time or (mean, sd)", self.execution_time, "s")
        checks.nonnegative(f"execution_time of {self.name}", self.mean, "s")
        checks.nonnegative(f"sd of the execution_time of {self.name}", self.sd, "s")
        if self.sd and not self.mean:
            raise checks.refuse(f"execution_time of {self.name}", "of a mean > 0 where its sd is > 0", self.execution_time, "s")
        checks.nonnegative(f"jitter of {self.name}", self.jitter, "s")
        if self.period is not None and self.jitter >= self.period:
            raise checks.refuse(f"jitter of {self.name}", f"< its period, {self.period:g}", self.jitter, "s")
        if self.period is not None and release_time(simplest(self.period), 1) < 1:
            raise checks.refuse(f"period of {self.name}", "at least a nanosecond", self.period, "s")

    @property
    def mean(self) -> float:
        """Mean execution time, s."""
        return self.execution_time[0] if isinstance(self.execution_time, tuple | list) else self.execution_time

    @property
    def sd(self) -> float:
        """Standard deviation of the execution time, s."""
        return self.execution_time[1] if isinstance(self.execution_time, tuple | list) else 0.0

    def share(self, spindle_speed: float = 0.0) -> float:
        """Return the share of the processor that the task needs on average, unit 1.

        Parameters
        ----------
        spindle_speed : float
            At which a task released by the angle is counted, rad/s.

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
        """Draw how late the next `DRAWN` jobs are released and how long each runs (private to this package).

        So many at once, whatever is asked of them: how the time is cut does not change what a job gets.
        """
        late = rng.uniform(0.0, self.jitter, DRAWN) if self.jitter else np.zeros(DRAWN)
        seconds = rng.gamma((self.mean / self.sd) ** 2, self.sd**2 / self.mean, DRAWN) if self.sd else np.full(DRAWN, self.mean)
        whole = (late * NANOSECONDS).astype(np.int64).tolist(), np.rint(seconds * NANOSECONDS).astype(np.int64).tolist()
        return list(map(Draw, *whole))


def release_time(period: Fraction, number: int) -> int:
    """When the job of that number is due, ns: the nearest to so many periods, a half goes up."""
    numerator, denominator = period.numerator * NANOSECONDS * number, period.denominator
    return (2 * numerator + denominator) // (2 * denominator)
