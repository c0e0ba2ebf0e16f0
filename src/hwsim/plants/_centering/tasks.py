"""Tasks of a centering machine's computer: when the controller samples, and when its command takes effect."""

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
    """The four loops of Mears (2006), section 3.2, with his rates and order and chosen execution times."""
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
    """A machine driven by the tasks."""

    done: bool

    def move_to(self, seconds: float) -> None:
        """Advance the physics to a time, s."""

    def spindle(self) -> tuple[float, float, float, float]:
        """Angle (rad), speed (rad/s), acceleration (rad/s^2) and its remaining time (s)."""

    def take_effect(self) -> bool:
        """Apply the command of the last sample; return whether it changes the motion of the spindle."""


class Tasks:
    """Running tasks; the controller samples at the start of its job and commands at the completion."""

    def __init__(self, scheduler: Scheduler, rng: np.random.Generator) -> None:
        self._core = scheduler.start(rng, told=_TOLD)
        self._job = -1  # job of the last sample
        self._models = any(task.name == MODEL for task in scheduler.tasks)
        # Whether the processor knows how the spindle turns, and until when, ns.
        self._turned, self._until = False, FOREVER
        self.refreshed = not self._models

    def sample(self, number: int, part: Moved, last: float) -> int | None:
        """Advance to the start of job `number` of the controller, or of the first later one not missed.

        Returns its number; None where the part or the time `last` (s) ends before.
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
        """The next event; None: none before the limit or before the spindle's motion changes."""
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
        """Number of missed releases of all tasks, and longest response of the controller's task, s."""
        reports = self._core.schedule.report
        return float(sum(each.overruns for each in reports.values())), reports[CONTROL].worst_response


def control_period(scheduler: Scheduler) -> float:
    """Period of the controller's task, s; ValueError without one."""
    for task in scheduler.tasks:
        if task.name == CONTROL and task.period is not None:
            return task.period
    raise checks.refuse(
        "scheduler", f"with a task named {CONTROL} that has a period", [task.name for task in scheduler.tasks]
    )
