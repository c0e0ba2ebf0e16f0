"""Trace of events on a simulated processor, and figures of each task."""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt

from hwsim._processor.tasks import NANOSECONDS, Task
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.plans import Plan
from sdpgrind.base.stored import decode, encode

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Whole = npt.NDArray[np.int64]


class Kind(IntEnum):
    """Event of a job on a processor (integers, without unit), as in the trace.

    ``RELEASE``: requested. ``OVERRUN``: requested while the previous one is incomplete; no job is created.
    ``START``: begins, inputs are sampled. ``PREEMPT``: interrupted by a more urgent job. ``RESUME``:
    continues. ``COMPLETE``: ends, outputs take effect.
    """

    RELEASE = 0
    OVERRUN = 1
    START = 2
    PREEMPT = 3
    RESUME = 4
    COMPLETE = 5


@dataclass(frozen=True)
class TaskReport:
    """Figures of one task.

    Parameters
    ----------
    releases, overruns : int
        Number of releases, and of those missed because the previous job was incomplete.
    completed : int
        Number of completed jobs.
    preemptions : int
        Number of interruptions by more urgent jobs.
    worst_response : float
        Longest time from release to completion, s; 0 where no job was completed.
    utilisation : float
        Share of time in which the task had the processor, unit 1.

    Examples
    --------
    >>> from hwsim._processor.scheduler import Scheduler
    >>> Scheduler([Task("control", 0.01, execution_time=0.002)]).run(1.0).report["control"].utilisation
    0.2
    """

    releases: int
    overruns: int
    completed: int
    preemptions: int
    worst_response: float
    utilisation: float


@dataclass(frozen=True, eq=False, repr=False)
class Schedule(ByValue, Plan):
    """All events on a processor, in order; made by `Scheduler.run`.

    Parameters
    ----------
    tasks : tuple of Task
        The tasks.
    duration : int
        Length of the run, ns.
    trace : array, shape (n, 4)
        Events: time (ns), kind (`Kind`), place of the task, number of its release.

    Examples
    --------
    >>> from hwsim._processor.scheduler import Scheduler
    >>> control = Task("control", 0.01, priority=1, execution_time=0.002)
    >>> model = Task("model", 0.05, priority=2, execution_time=0.02)
    >>> schedule = Scheduler([control, model]).run(1.0)
    >>> schedule
    Schedule(1 s: control 100 releases, model 20 releases; overruns: none)
    >>> schedule.report["model"].worst_response, schedule.report["model"].preemptions  # s
    (0.026, 40)
    """

    kind = "hwsim.schedule"
    tasks: tuple[Task, ...]
    duration: int
    trace: Whole

    def __post_init__(self) -> None:
        object.__setattr__(self, "trace", lasting(self.trace, np.int64))

    def jobs(self, task: str) -> Whole:
        """Return the completed jobs of a task, shape (n, 4): number; release, start, completion (whole ns).

        Parameters
        ----------
        task : str
            Name of the task.

        Raises
        ------
        ValueError
            When there is no such task.

        Examples
        --------
        >>> from hwsim._processor.scheduler import Scheduler
        >>> Scheduler([Task("control", 1 / 60, execution_time=0.002)]).run(0.05).jobs("control")
        array([[       0,        0,        0,  2000000],
               [       1, 16666667, 16666667, 18666667],
               [       2, 33333333, 33333333, 35333333]])
        """
        place = [each.name for each in self.tasks].index(
            checks.one_of("task", task, (each.name for each in self.tasks))
        )
        mine = self.trace[self.trace[:, 2] == place]
        times = {kind: mine[mine[:, 1] == kind] for kind in (Kind.RELEASE, Kind.START, Kind.COMPLETE)}
        # jobs of one task do not overlap: the first n events of each kind belong together
        number = times[Kind.COMPLETE][:, 3]
        return np.column_stack([number, *(each[: number.size, 0] for each in times.values())])

    @cached_property
    def slices(self) -> Whole:
        """Uninterrupted intervals of work, one a row: place of the task, job's number, start and end (ns)."""
        # begins (START, RESUME) and ends (PREEMPT, COMPLETE) alternate
        work = self.trace[self.trace[:, 1] >= Kind.START]
        begins, ends = work[0::2], work[1::2, 0]
        ends = np.append(ends, self.duration) if len(begins) > len(ends) else ends
        return np.column_stack([begins[:, 2], begins[:, 3], begins[:, 0], ends])

    @property
    def report(self) -> dict[str, TaskReport]:  # type: ignore[override]  # older than pages: figures of tasks
        """Figures of each task by name (times in s)."""
        return {task.name: self._report(place, task.name) for place, task in enumerate(self.tasks)}

    def _report(self, place: int, name: str) -> TaskReport:
        kinds = np.bincount(self.trace[self.trace[:, 2] == place, 1], minlength=len(Kind))
        jobs, work = self.jobs(name), self.slices[self.slices[:, 0] == place]
        return TaskReport(
            releases=int(kinds[Kind.RELEASE] + kinds[Kind.OVERRUN]),
            overruns=int(kinds[Kind.OVERRUN]),
            completed=int(kinds[Kind.COMPLETE]),
            preemptions=int(kinds[Kind.PREEMPT]),
            worst_response=float((jobs[:, 3] - jobs[:, 1]).max(initial=0) / NANOSECONDS),
            utilisation=float((work[:, 3] - work[:, 2]).sum() / self.duration) if self.duration else 0.0,
        )

    @property
    def dataset(self) -> "xr.Dataset":
        """The trace with labels, times in ns."""
        import xarray as xr

        labels = {
            "time": {"units": "ns"},
            "kind": {"long_name": "Kind"},
            "task": {"long_name": "place of the task"},
            "job": {},
        }
        columns = {name: ("event", self.trace[:, k], attrs) for k, (name, attrs) in enumerate(labels.items())}
        return xr.Dataset(columns, attrs={"tasks": encode(self.tasks), "duration": float(self.duration)})

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        trace = np.column_stack([dataset[name].values for name in ("time", "kind", "task", "job")])
        return cls(decode(dataset.attrs["tasks"]), int(dataset.attrs["duration"]), trace)

    def plot(self, first: float = 0.0, last: float | None = None) -> "Figure":
        """Draw the Gantt chart.

        Parameters
        ----------
        first, last : float
            Interval drawn, s. `last` None: the first 60 releases after `first`.
        """
        from hwsim._processor.schedule_picture import Row, picture

        rows = []
        for place, (name, report) in enumerate(self.report.items()):
            label = f"{name}\n{100 * report.utilisation:.1f} %, worst {1e3 * report.worst_response:.3g} ms"
            mine, works = self.trace[self.trace[:, 2] == place], self.slices[self.slices[:, 0] == place, 2:]
            releases, overruns = (mine[mine[:, 1] == kind, 0] for kind in (Kind.RELEASE, Kind.OVERRUN))
            rows.append(Row(label, self.jobs(name)[:, [1, 3]], works, releases, overruns))
        return picture(rows, self.duration, first, last)

    def _told(self) -> str:
        reports = self.report
        told = ", ".join(f"{name} {each.releases} releases" for name, each in reports.items())
        missed = [f"{name} {each.overruns}" for name, each in reports.items() if each.overruns]
        return f"{self.duration / NANOSECONDS:g} s: {told}; overruns: {', '.join(missed) or 'none'}"
