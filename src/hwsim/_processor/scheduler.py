"""Deterministic, pre-emptive, multi-rate scheduling of tasks with fixed priorities on one processor."""

from collections.abc import Sequence
from dataclasses import KW_ONLY
from typing import Any

import numpy as np
import numpy.typing as npt

from hwsim._processor.processor import Processor, Told
from hwsim._processor.schedule import Schedule
from hwsim._processor.tasks import NANOSECONDS, Task
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.base.rng import Seed, children

_ROUNDING = 1e-12  # chosen: above the rounding of ten shares of 0.1, far below a real overload


def _tasks(name: str, given: Any) -> tuple[Task, ...]:
    if not isinstance(given, Sequence) or not given:
        raise TypeError(f"{name} must be a list of tasks; got {checks.shown(given)}")
    for k, task in enumerate(given):
        checks.kind(f"{name}[{k}]", task, Task)
    checks.unique(f"names of {name}", [task.name for task in given])
    return tuple(given)


@described()
class Scheduler(Described):
    """Tasks that share one simulated processor; the most urgent job runs, an interrupted one waits.

    A job samples its inputs at its start; its outputs take effect at its completion. A release while the
    previous job of the task is incomplete is an overrun: it is counted and missed.

    Time is counted in whole nanoseconds and is independent of the wall clock: equal seeds give equal traces,
    byte for byte. Each task draws from its own child of the seed.

    Parameters
    ----------
    tasks : sequence of Task
        The tasks, with different names.
    spindle_speed_max : float, optional
        Spindle speed at which the load of tasks with an angle step is counted, rad/s; required with such
        tasks.

    Raises
    ------
    ValueError
        When names repeat, or the tasks need more than the whole processor on average.

    Examples
    --------
    The four loops of Mears (2006), section 3.2:

    >>> from sdpgrind import units
    >>> control = Task("control", 0.01, priority=1, execution_time=(0.001, 0.0001))
    >>> data = Task("data", 0.01, priority=2, execution_time=0.0005)
    >>> model = Task("model", angle_step=units.deg(5.0), priority=3, execution_time=(0.003, 0.001))
    >>> communication = Task("communication", 0.1, priority=4, execution_time=(0.01, 0.003))
    >>> scheduler = Scheduler([control, data, model, communication], spindle_speed_max=units.rpm(100.0))
    >>> round(scheduler.utilisation, 3)
    0.61
    >>> scheduler.run(2.0, rng=0, spindle=[(2.0, units.rpm(100.0), 0.0)]).report["model"].releases
    240
    """

    tasks: Sequence[Task] = custom(_tasks)
    _: KW_ONLY
    spindle_speed_max: float | None = quantity(
        "rad/s", above=0, usual=(0.01, 1000.0), typical=10, default=None
    )

    def _check(self) -> None:
        angular = [task.name for task in self.tasks if task.angle_step is not None]
        if angular and self.spindle_speed_max is None:
            raise ValueError(
                f"spindle_speed_max must be given (rad/s), as {angular[0]} has an angle_step; got None"
            )
        if self.utilisation > 1.0 + _ROUNDING:
            shares = ", ".join(
                f"{task.name} {task.share(self.spindle_speed_max or 0.0):.3g}" for task in self.tasks
            )
            raise ValueError(
                f"utilisation of the tasks must be <= 1 (1); got {self.utilisation:.4g} ({shares})"
            )

    @property
    def utilisation(self) -> float:
        """Average share of the processor that the tasks need, unit 1."""
        return sum(task.share(self.spindle_speed_max or 0.0) for task in self.tasks)

    def start(self, rng: Seed = 0, *, angle: float = 0.0, told: Told | None = None) -> Processor:
        """Return the tasks on a processor at time 0.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Random source.
        angle : float
            Initial angle of the spindle, rad; a multiple of an angle step counts as reached.
        told : collection, optional
            Events that `Processor.next_event` returns, as pairs of a task's name and a `Kind`. None: all.

        Returns
        -------
        Processor
            Running tasks.

        Examples
        --------
        >>> core = Scheduler([Task("control", 0.01)]).start(0)
        >>> [job.start for job in core.advance(25_000_000)]  # ns
        [0, 10000000, 20000000]
        """
        return Processor(
            self.tasks, children(rng, len(self.tasks)), checks.number("angle", angle, "rad"), told
        )

    def run(
        self,
        duration: float,
        rng: Seed = 0,
        *,
        spindle: npt.ArrayLike | None = None,
        start_angle: float = 0.0,
    ) -> Schedule:
        """Run the tasks for a duration, its end excluded.

        Parameters
        ----------
        duration : float
            Length, s.
        rng : int, Generator or SeedSequence
            Random source.
        spindle : array_like, shape (n, 3), optional
            Segments of spindle motion: duration (s), initial speed (rad/s) and acceleration (rad/s^2); at
            rest after the last. None: at rest.
        start_angle : float
            Initial angle of the spindle, rad.

        Returns
        -------
        Schedule
            All events.

        Raises
        ------
        ValueError
            When a value is out of range.

        Examples
        --------
        >>> scheduler = Scheduler([Task("model", angle_step=0.1)], spindle_speed_max=1.0)
        >>> schedule = scheduler.run(1.0, spindle=[(9.0, 1.0, 0.0)])
        >>> schedule.jobs("model")[:3, 1]  # ns
        array([        0, 100000000, 200000000])
        """
        end = round(checks.positive("duration", duration, "s") * NANOSECONDS)
        core = self.start(rng, angle=start_angle)
        angle = float(start_angle)
        for span, speed, acceleration in _segments(spindle):
            begun = core.now
            core.advance(min(begun + round(span * NANOSECONDS), end - 1), angle, speed, acceleration)
            seconds = (core.now - begun) / NANOSECONDS
            angle += (speed + 0.5 * acceleration * seconds) * seconds
        core.advance(end - 1, angle)
        return Schedule(core.schedule.tasks, end, core.schedule.trace)


def _segments(spindle: npt.ArrayLike | None) -> list[list[float]]:
    segments = checks.finite_array("spindle", np.empty((0, 3)) if spindle is None else spindle)
    if segments.ndim != 2 or segments.shape[1] != 3:
        raise ValueError(f"spindle must be of shape (n, 3) (s, rad/s, rad/s^2); got {segments.shape}")
    for k, span in enumerate(segments[:, 0]):
        checks.positive(f"spindle[{k}, 0]", float(span), "s")
    rows: list[list[float]] = segments.tolist()
    return rows
