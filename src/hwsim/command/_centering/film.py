"""Film strip of the last part: centre on a log-polar chart, and motion of tip and rim, for each push."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.circle import plot_centers
from hwsim._log.columns import columns
from sdpgrind.base import pictures

if TYPE_CHECKING:
    from hwsim._log.log import Log

_MOST = 8  # pushes in a strip, half of them the last ones; chosen: more are too small
_RIM, _TIP = "0.45", "tab:blue"
_AROUND = 0.06  # time drawn before and after the profile, s; chosen: shows the approach of the tip


class FilmStrip:
    """Pictures of the last part of a log of `hwsim.CenteringMachine`."""

    def __init__(self, log: "Log") -> None:
        self._table = columns(log, ("time", "slide", "probe", "pushing"))
        x, y = (log.outcome[name].values[-1] for name in ("center_x", "center_y"))
        self._centers = np.column_stack([x, y])[np.isfinite(x)]
        self._tolerance = float(log.outcome.attrs["tolerance"])
        self._radius = float(log.outcome.attrs["radius"])

    def plot(self) -> Any:
        """Draw the centre before and after each push, and distances of tip and rim (mm) over time (s)."""
        shown = self._shown()
        wide = max(len(shown), 1)
        figure = pictures.figure(3.0 * wide + 0.6, 6.0)
        grid = figure.add_gridspec(2, wide, height_ratios=(1.5, 1))
        for column, (number, begin, end) in enumerate(shown):
            chart = figure.add_subplot(grid[0, column], projection="polar")
            self._chart(chart, number)
            self._push(figure.add_subplot(grid[1, column]), begin, end, first=column == 0)
        return figure

    def _shown(self) -> list[tuple[int, int, int]]:
        """Number of each push shown, and the rows where its profile begins and ends."""
        running = np.concatenate([[0.0], self._table["pushing"] > 0.5, [0.0]])
        begins, ends = (np.flatnonzero(np.diff(running) == sign) for sign in (1, -1))
        count = min(begins.size, self._centers.shape[0] - 1)
        numbers = range(count) if count <= _MOST else [*range(_MOST // 2), *range(count - _MOST // 2, count)]
        return [(k, int(begins[k]), int(ends[k])) for k in numbers]

    def _chart(self, axis: Any, number: int) -> None:
        """Path of the centre so far; all charts have one scale, labelled on the first."""
        plot_centers(self._centers, self._tolerance, shown=number + 2, ax=axis)
        axis.get_legend().remove()
        axis.set_xticklabels([])
        if number:
            axis.set_yticklabels([])
        before, after = np.hypot(*self._centers[number : number + 2].T)
        axis.set_title(f"push {number + 1}\n{_length(before)} to {_length(after)}", fontsize=10)

    def _push(self, axis: Any, begin: int, end: int, *, first: bool) -> None:
        """Distances of tip and rim from the axis, minus the radius."""
        time = self._table["time"]
        seen = (time >= time[begin] - _AROUND) & (time <= time[min(end, time.size - 1)] + _AROUND)
        rim = self._table["slide"] + self._table["probe"] - self._radius
        axis.plot(time[seen], rim[seen], color=_RIM, lw=1.2, label="rim, as read")
        axis.plot(time[seen], self._table["slide"][seen] - self._radius, color=_TIP, lw=1.2, label="tip")
        axis.axhline(0.0, color="0.8", lw=0.8, zorder=0)
        axis.set_xlabel("time [s]")
        axis.spines[["top", "right"]].set_visible(False)
        if first:
            axis.set_ylabel("beyond the radius [mm]")
            pictures.legend(axis)


def _length(millimetres: float) -> str:
    return f"{millimetres:.3g} mm" if millimetres >= 0.1 else f"{1e3 * millimetres:.3g} µm"
