"""The tasks of a centering machine's computer: when the controller samples, and when its command takes effect."""

from typing import Protocol

import numpy as np

from hwsim._processor.processor import TaskEvent
from hwsim._processor.schedule import Kind
from hwsim._processor.scheduler import Scheduler
from hwsim._processor.tasks import NANOSECONDS, Task
from hwsim.protocols import FOREVER
from sdpgrind import units
from sdpgrind.base import checks

CONTROL, MODEL = "control", "model"
_SECOND = 1 / NANOSECONDS
_TOLD = {(CONTROL, Kind.START), (CONTROL, Kind.COMPLETE), (MODEL, Kind.COMPLETE)}


def source_tasks() -> Scheduler:
    """The four loops of Mears (2006), section 3.2, on one processor; he gives rates and order, execution times are chosen."""
    return Scheduler(
        (
            Task(CONTROL, 0.01, priority=1, execution_time=(5e-4, 5e-5), jitter=2e-5),
            Task("data", 0.01, priority=2, execution_time=(3e-4, 3e-5), jitter=2e-5),
            Task(MODEL, angle_step=units.deg(5.0), priority=3, execution_time=(2e-3, 5e-4)),
            Task("communication", 0.1, priority=4, execution_time=(5e-3, 1.5e-3), jitter=1e-3),
        ),
        spindle_speed_max=units.rpm(100.0),
    )


class Moved(Protocol):
    """What the tasks run on."""

    done: bool

    def move_to(self, seconds: float) -> None:
        """Let everything move until a time, s."""

    def spindle(self) -> tuple[float, float, float, float]:
        """Angle (rad), speed (rad/s), acceleration (rad/s^2), and how long that acceleration lasts (s)."""

    def take_effect(self) -> bool:
        """Let the command of the last sample take effect; return whether it changes how the spindle turns."""


class Tasks:
    """Tasks, running; the controller samples at the start of its job, its command takes effect when the job is complete."""

    def __init__(self, scheduler: Scheduler, rng: np.random.Generator) -> None:
        self._core = scheduler.start(rng, told=_TOLD)
        self._job = -1  # of the last sample
        self._models = any(task.name == MODEL for task in scheduler.tasks)
        self._turned, self._until = (
            False,
            FOREVER,
        )  # whether the processor knows how the spindle turns, and until when, ns
        self.refreshed = not self._models

    def sample(self, number: int, part: Moved, last: float) -> int | None:
        """Go on to the start of that job of the controller, or of the first one after it that was not missed.

        Returns its number; None where the part is over before, or the time `last` (s) is.
        """
        limit = round(last * NANOSECONDS)
        self.refreshed = not self._models
        while not part.done:
            event = self._next(part, limit)
            if event is None:
                if self._core.now >= limit:
                    part.move_to(last)
                    return None
            elif event.task == CONTROL and event.kind == Kind.START and event.job >= number:
                part.move_to(event.time * _SECOND)
                self._job = event.job
                return event.job
            elif event.kind == Kind.COMPLETE:
                self._complete(event, part)
        return None

    def _next(self, part: Moved, limit: int) -> TaskEvent | None:
        """The next event; None where there is none until the limit, or until the spindle turns otherwise."""
        if self._turned and self._core.now < self._until:
            return self._core.next_event(min(limit, self._until))
        part.move_to(self._core.now * _SECOND)
        angle, speed, rate, lasts = part.spindle()
        self._turned, self._until = (
            True,
            self._core.now + max(round(lasts * NANOSECONDS), 1) if rate else FOREVER,
        )
        return self._core.next_event(min(limit, self._until), angle, speed, rate)

    def _complete(self, event: TaskEvent, part: Moved) -> None:
        if event.task == CONTROL and event.job == self._job:
            part.move_to(event.time * _SECOND)
            self._turned = self._turned and not part.take_effect()
        self.refreshed = self.refreshed or event.task == MODEL

    def report(self) -> tuple[float, float]:
        """Releases that were missed, of all tasks, and the longest response of the controller's, s."""
        reports = self._core.schedule.report
        return float(sum(each.overruns for each in reports.values())), reports[CONTROL].worst_response


def control_period(scheduler: Scheduler) -> float:
    """Period of the controller's task, s; refuse a scheduler without one."""
    for task in scheduler.tasks:
        if task.name == CONTROL and task.period is not None:
            return task.period
    raise checks.refuse(
        "scheduler", f"with a task named {CONTROL} that has a period", [task.name for task in scheduler.tasks]
    )
