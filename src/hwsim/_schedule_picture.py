"""The picture of a schedule: one row a task, who has the processor, who waits, releases and overruns."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._schedule import Kind, Schedule
from hwsim._tasks import NANOSECONDS
from sdpgrind.base import checks
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_JOBS = 60  # in the picture, where nothing else is asked for
_MS = 1_000_000  # ns in a millisecond
_WORK, _WAIT, _RELEASE, _MISSED = "tab:blue", "0.82", "0.15", "tab:red"
_BAR, _LINE = 0.5, 0.12  # height of a bar, of the line of those that wait


def picture(schedule: Schedule, first: float, last: float | None) -> "Figure":
    """Draw a part of a schedule; times in s."""
    pyplot = need("matplotlib.pyplot", "plot")
    begin, end = _window(schedule, first, last)
    number = len(schedule.tasks)
    figure: Figure = pyplot.figure(figsize=(11.0, 1.9 + 0.62 * number), layout="constrained")
    axis = figure.add_subplot()
    for place, task in enumerate(schedule.tasks):
        _row(axis, schedule, place, task.name, begin, end)
    _finish(axis, schedule, begin, end)
    return figure


def _window(schedule: Schedule, first: float, last: float | None) -> tuple[int, int]:
    """Ends of what is drawn, ns."""
    whole = schedule.duration / NANOSECONDS
    begin = round(checks.within("first", first, 0.0, whole, "s") * NANOSECONDS)
    if last is not None:
        return begin, round(checks.within("last", last, first, whole, "s") * NANOSECONDS)
    releases = schedule.trace[(schedule.trace[:, 1] <= Kind.OVERRUN) & (schedule.trace[:, 0] >= begin), 0]
    return begin, int(releases[_JOBS]) if releases.size > _JOBS else schedule.duration


def _row(axis: Any, schedule: Schedule, place: int, name: str, begin: int, end: int) -> None:
    """One task: a thin line from release to completion, bars where it works, marks above."""
    jobs, slices = schedule.jobs(name), schedule.slices
    _bars(axis, place, jobs[:, [1, 3]], (begin, end), height=_LINE, color=_WAIT, label="from release to completion")
    _bars(axis, place, slices[slices[:, 0] == place, 2:], (begin, end), height=_BAR, color=_WORK, label="has the processor")
    trace = schedule.trace[schedule.trace[:, 2] == place]
    marks = (Kind.RELEASE, "v", _RELEASE, 14, 0.0, "release"), (Kind.OVERRUN, "x", _MISSED, 30, 1.2, "missed (overrun)")
    for kind, marker, color, size, width, label in marks:
        times = trace[(trace[:, 1] == kind) & (trace[:, 0] >= begin) & (trace[:, 0] <= end), 0] / _MS
        axis.scatter(times, np.full(times.size, place - 0.38), s=size, marker=marker, color=color, lw=width, label=label)


def _bars(axis: Any, place: int, spans: Any, window: tuple[int, int], *, height: float, color: str, label: str) -> None:
    begin, end = window
    seen = np.clip(spans[(spans[:, 1] >= begin) & (spans[:, 0] <= end)], begin, end) / _MS
    bars = np.column_stack([seen[:, 0], seen[:, 1] - seen[:, 0]])
    axis.broken_barh(bars, (place - height / 2, height), facecolor=color, edgecolor="none", label=label)


def _finish(axis: Any, schedule: Schedule, begin: int, end: int) -> None:
    reports = schedule.report
    lines = [
        f"{task.name}\n{100 * reports[task.name].utilisation:.1f} %, worst {1e3 * reports[task.name].worst_response:.3g} ms"
        for task in schedule.tasks
    ]
    axis.set_yticks(range(len(lines)), lines, fontsize=9)
    axis.set_ylim(len(lines) - 0.45, -0.6)
    axis.set_xlim(begin / _MS, max(end, begin + 1) / _MS)
    axis.set_xlabel("time [ms]")
    handles, labels = axis.get_legend_handles_labels()
    axis.legend(handles[:4], labels[:4], loc="lower left", bbox_to_anchor=(0, 1), ncols=4, frameon=False, fontsize=8)
    axis.grid(axis="x", alpha=0.25, lw=0.5)
    axis.spines[["top", "right", "left"]].set_visible(False)
    axis.tick_params(axis="y", length=0)
