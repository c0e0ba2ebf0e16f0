"""Event simulation of pre-emptive tasks on one processor, in whole nanoseconds.

Order at one instant: the running job completes; releases, by priority, then by place among the tasks; the
processor goes to the most urgent job. A release while the task's previous job is incomplete is an overrun: it
creates no job, and the task keeps its phase.
"""

from array import array
from collections import deque
from collections.abc import Collection, Sequence
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from hwsim._processor.schedule import Kind, Schedule
from hwsim._processor.tasks import NEVER, Released, Task, TaskMotion
from sdpgrind.base import checks

Told = Collection[tuple[str, Kind]]


class TaskEvent(NamedTuple):
    """An event on the processor: time (ns), kind, task, number of the release from 0, missed ones included.

    Examples
    --------
    >>> TaskEvent(10_000_000, Kind.START, "control", 1).kind.name
    'START'
    """

    time: int
    kind: Kind
    task: str
    job: int


class TaskJob(NamedTuple):
    """A completed job: task, number of its release, and times of release, start and completion (ns).

    Examples
    --------
    >>> job = TaskJob("control", 1, 10_000_000, 10_500_000, 12_000_000)
    >>> job.completion - job.release  # ns
    2000000
    """

    task: str
    number: int
    release: int
    start: int
    completion: int


class Processor:
    """Running tasks on one processor; made by `Scheduler.start`.

    A machine with a scheduler goes from event to event with `next_event`, samples at a ``START`` and applies
    the command at the ``COMPLETE`` of the same job. `advance` returns the completed jobs only. Both take the
    motion of the spindle from ``now`` on, for tasks released by its angle; results do not depend on how time
    is divided. Copies are independent. `told`: events that `next_event` returns, as pairs of a task's name
    and a `Kind`; None: all.

    Examples
    --------
    >>> from hwsim._processor.scheduler import Scheduler
    >>> from hwsim._processor.tasks import NEVER, TaskMotion, Released, Task
    >>> core = Scheduler([Task("control", 0.01, execution_time=0.002)]).start(0)
    >>> core.next_event(5_000_000).kind.name, core.next_event(5_000_000).kind.name
    ('RELEASE', 'START')
    >>> for job in core.advance(12_000_000):  # ns
    ...     print(job.start, job.completion)
    0 2000000
    10000000 12000000
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        rngs: Sequence[np.random.Generator],
        angle: float,
        told: Told | None = None,
    ) -> None:
        listed = [[told is None or (task.name, kind) in told for kind in Kind] for task in tasks]
        self._own = [
            Released(task, k, rng, angle, listed[k])
            for k, (task, rng) in enumerate(zip(tasks, rngs, strict=True))
        ]
        self._completions = {own.name for own in self._own if own.told[Kind.COMPLETE]}
        self._angular = [place for place, own in enumerate(self._own) if own.period is None]
        self._now = 0
        self._motion = TaskMotion(0, angle, 0.0, 0.0)
        self._releases: list[tuple[int, int, int]] = []  # heap of time (ns), priority, place
        self._ready: list[tuple[int, int, int]] = []  # heap of priority, release, place
        self._running: Released | None = None
        self._ends = NEVER  # completion of the running job without pre-emption, ns
        self._news: deque[tuple[TaskEvent, TaskJob | None]] = deque()
        self._trace = array("q")  # four numbers for each event
        for own in self._own:
            own.next()
            self._expect(own)

    @property
    def now(self) -> int:
        """Current time, ns (a whole number)."""
        return self._now

    @property
    def schedule(self) -> Schedule:
        """All events until now (ns, whole numbers)."""
        trace = np.array(self._trace, dtype=np.int64).reshape(-1, 4)
        return Schedule(tuple(own.task for own in self._own), self._now, trace)

    def next_event(
        self, to: int, angle: float | None = None, speed: float = 0.0, acceleration: float = 0.0
    ) -> TaskEvent | None:
        """Advance to the next event, until `to` (ns) at the latest, and return it; None: there is none.

        Angle (rad), speed and acceleration are those of the spindle at ``now``; the acceleration lasts until
        `to`. A task with an angle step is released when a multiple of it is first reached. Angle None: the
        last motion continues.

        Examples
        --------
        >>> from hwsim._processor.scheduler import Scheduler
        >>> core = Scheduler([Task("model", angle_step=0.1)], spindle_speed_max=2.0).start(0, angle=0.05)
        >>> core.next_event(1_000_000_000, 0.05, 2.0).time  # 0.05 rad to go at 2 rad/s
        25000000
        """
        if angle is not None or to < self._now:
            self._turn(to, angle or 0.0, speed, acceleration)
        while (news := self._next(to)) is not None:
            event, done = news
            if done is None or event.task in self._completions:
                return event
        return None

    def advance(
        self, to: int, angle: float = 0.0, speed: float = 0.0, acceleration: float = 0.0
    ) -> list[TaskJob]:
        """Advance to a time (ns), included, and return the jobs completed; motion as for `next_event`.

        Examples
        --------
        >>> from hwsim._processor.scheduler import Scheduler
        >>> core = Scheduler([Task("camera", 1 / 60, execution_time=0.001)]).start(0)
        >>> [job.completion for job in core.advance(40_000_000)]  # ns
        [1000000, 17666667, 34333333]
        """
        self._turn(to, angle, speed, acceleration)
        jobs = []
        while (news := self._next(to)) is not None:
            if news[1] is not None:
                jobs.append(news[1])
        return jobs

    def _turn(self, to: int, *motion: float) -> None:
        """Set the motion of the spindle from now on; a multiple once reached stays reached."""
        if checks.whole("to", to, 0) < self._now:
            raise checks.refuse("to", f">= now, {self._now}", to, "ns")
        self._motion = TaskMotion(self._now, *motion)
        moved = [place for place in self._angular if self._own[place].nominal > self._now]
        if moved:
            self._releases = [entry for entry in self._releases if entry[2] not in moved]
            heapify(self._releases)
            for place in moved:
                self._expect(self._own[place])

    def _expect(self, own: Released) -> None:
        """Put the next release of a task on the heap, unless its time is unknown."""
        if own.period is None:
            own.nominal = own.crossing(self._motion)
        if own.nominal < NEVER:
            heappush(self._releases, (max(own.nominal + own.late, self._now), own.priority, own.place))

    def _next(self, to: int) -> tuple[TaskEvent, TaskJob | None] | None:
        while not self._news:
            time = min(self._releases[0][0], self._ends) if self._releases else self._ends
            if time > to:
                self._now = to
                return None
            self._now = time
            self._happen(time)
        return self._news.popleft()

    def _happen(self, now: int) -> None:
        """Process all events at this instant, in order."""
        releases, ready = self._releases, self._ready
        if self._ends == now and self._running is not None:
            self._complete(self._running)
        while releases and releases[0][0] == now:
            self._release(self._own[heappop(releases)[2]])
        if ready and (self._running is None or ready[0][0] < self._running.priority):
            self._dispatch()

    def _complete(self, own: Released) -> None:
        own.open, self._running, self._ends = False, None, NEVER
        self._trace.extend((self._now, Kind.COMPLETE, own.place, own.number))
        event = TaskEvent(self._now, Kind.COMPLETE, own.name, own.number)
        self._news.append((event, TaskJob(own.name, own.number, own.release, own.start, self._now)))

    def _release(self, own: Released) -> None:
        self._tell(Kind.OVERRUN if own.open else Kind.RELEASE, own, own.count)
        if not own.open:
            own.take(self._now)
            heappush(self._ready, (own.priority, self._now, own.place))
        own.next()
        self._expect(own)

    def _dispatch(self) -> None:
        """Start the most urgent job; an interrupted one keeps its remaining time."""
        before = self._running
        if before is not None:
            before.remaining = self._ends - self._now
            self._tell(Kind.PREEMPT, before, before.number)
            heappush(self._ready, (before.priority, before.release, before.place))
        own = self._running = self._own[heappop(self._ready)[2]]
        self._ends = self._now + own.remaining
        self._tell(Kind.RESUME if own.begun else Kind.START, own, own.number)
        if not own.begun:
            own.begun, own.start = True, self._now

    def _tell(self, kind: Kind, own: Released, job: int) -> None:
        self._trace.extend((self._now, kind, own.place, job))
        if own.told[kind]:
            self._news.append((TaskEvent(self._now, kind, own.name, job), None))
