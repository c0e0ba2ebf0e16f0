"""Gantt chart of a schedule: a row for each task, with work, waiting, releases and overruns."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hwsim._processor.tasks import NANOSECONDS
from sdpgrind.base import checks, pictures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_JOBS = 60  # releases drawn by default; chosen: of more, single jobs cannot be seen
_MS = 1_000_000  # ns in a millisecond; derived
_WORK, _WAIT, _RELEASE, _MISSED = "tab:blue", "0.82", "0.15", "tab:red"
_BAR, _LINE = 0.5, 0.12  # heights of working and waiting, rows; chosen: rows stay apart


class Row(NamedTuple):
    """Row of one task, times in ns."""

    label: str
    waits: npt.NDArray[np.int64]  # (n, 2): release and completion
    works: npt.NDArray[np.int64]  # (n, 2): start and end of uninterrupted work
    releases: npt.NDArray[np.int64]
    overruns: npt.NDArray[np.int64]


def picture(rows: Sequence[Row], duration: int, first: float, last: float | None) -> "Figure":
    """Draw a schedule of a duration (ns) from `first` to `last` (s)."""
    begin, end = _window(rows, duration, first, last)
    axis = pictures.axes_of(11.0, 1.9 + 0.62 * len(rows))
    for place, row in enumerate(rows):
        _draw(axis, place, row, (begin, end))
    _finish(axis, [row.label for row in rows], begin, end)
    figure: Figure = axis.figure
    return figure


def _window(rows: Sequence[Row], duration: int, first: float, last: float | None) -> tuple[int, int]:
    """Interval drawn, ns."""
    whole = duration / NANOSECONDS
    begin = round(checks.within("first", first, 0.0, whole, "s") * NANOSECONDS)
    if last is not None:
        return begin, round(checks.within("last", last, first, whole, "s") * NANOSECONDS)
    times = np.sort(np.concatenate([each for row in rows for each in (row.releases, row.overruns)]))
    times = times[times >= begin]
    return begin, int(times[_JOBS]) if times.size > _JOBS else duration


def _draw(axis: Any, place: int, row: Row, window: tuple[int, int]) -> None:
    """One task: a thin line from release to completion, bars of work, marks above."""
    _bars(axis, place, row.waits, window, height=_LINE, color=_WAIT, label="from release to completion")
    _bars(axis, place, row.works, window, height=_BAR, color=_WORK, label="has the processor")
    marks = (
        (row.releases, "v", _RELEASE, 14, 0.0, "release"),
        (row.overruns, "x", _MISSED, 30, 1.2, "missed (overrun)"),
    )
    for times, marker, color, size, width, label in marks:
        seen = times[(times >= window[0]) & (times <= window[1])] / _MS
        axis.scatter(
            seen, np.full(seen.size, place - 0.38), s=size, marker=marker, color=color, lw=width, label=label
        )


def _bars(
    axis: Any, place: int, spans: Any, window: tuple[int, int], *, height: float, color: str, label: str
) -> None:
    begin, end = window
    seen = np.clip(spans[(spans[:, 1] >= begin) & (spans[:, 0] <= end)], begin, end) / _MS
    bars = np.column_stack([seen[:, 0], seen[:, 1] - seen[:, 0]])
    axis.broken_barh(bars, (place - height / 2, height), facecolor=color, edgecolor="none", label=label)


def _finish(axis: Any, labels: Sequence[str], begin: int, end: int) -> None:
    axis.set_yticks(range(len(labels)), labels, fontsize=9)
    axis.set_ylim(len(labels) - 0.45, -0.6)
    axis.set_xlim(begin / _MS, max(end, begin + 1) / _MS)
    axis.set_xlabel("time [ms]")
    handles, names = axis.get_legend_handles_labels()
    axis.legend(
        handles[:4], names[:4], loc="lower left", bbox_to_anchor=(0, 1), ncols=4, frameon=False, fontsize=8
    )
    axis.grid(axis="x", alpha=0.25, lw=0.5)
    axis.spines[["top", "right", "left"]].set_visible(False)
    axis.tick_params(axis="y", length=0)
