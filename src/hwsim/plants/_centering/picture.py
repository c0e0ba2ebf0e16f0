"""Picture of a run on a centering machine: centre, motion and force of the last part, all parts."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.circle import plot_centers
from hwsim._log.columns import columns, part_named, parts_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RIM, _TIP, _FORCE, _PUSH, _BAD = "0.45", "tab:blue", "tab:orange", "0.9", "tab:red"
_LEAST = 1e-6  # smallest offset drawn, mm; chosen: 0 has no logarithm


def picture(log: PartLog) -> "Figure":
    """Draw a log of `CenteringMachine`: the last part on a log-polar chart and in time, and all parts."""
    figure: Figure = pictures.figure(12.0, 7.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.2, 1), height_ratios=(1.9, 1))
    pair = grid[0, 0].subgridspec(2, 1, hspace=0.0)  # of one axis of time: no room for labels between
    above = figure.add_subplot(pair[0])
    axes = [above, figure.add_subplot(pair[1], sharex=above), figure.add_subplot(grid[1, 0])]
    last = columns(log, ("time", "slide", "probe", "force", "peak_force", "pushing"))
    _motion(axes[0], last, part_named(log).capitalize())
    _force(axes[1], last)
    _parts(axes[2], log)
    pictures.opened(axes)
    tolerance = float(log.outcome.attrs["tolerance"])
    plot_centers(_centers(log), tolerance, ax=figure.add_subplot(grid[:, 1], projection="polar"))
    figure.suptitle(_title(log))
    return figure


def _centers(log: PartLog) -> Floats:
    """Centre of the last part before each push and at the end, mm."""
    x, y = (log.outcome[name].values[-1] for name in ("center_x", "center_y"))
    known = np.isfinite(x)
    return np.column_stack([x[known], y[known]])


def _shade(axis: Any, last: dict[str, Floats]) -> None:
    """Shade the times of profiles."""
    pushing = np.concatenate([[0.0], last["pushing"] > 0, [0.0]])
    begins, ends = (np.flatnonzero(np.diff(pushing) == sign) for sign in (1, -1))
    time = np.append(last["time"], last["time"][-1])
    for begin, end in zip(begins, ends, strict=True):
        axis.axvspan(time[begin], time[end], color=_PUSH, lw=0)


def _motion(axis: Any, last: dict[str, Floats], part: str) -> None:
    """Positions of rim and pusher on the probe line."""
    _shade(axis, last)
    axis.plot(last["time"], last["slide"] + last["probe"], color=_RIM, lw=1, label="rim")
    axis.plot(last["time"], last["slide"], color=_TIP, lw=1, label="tip of the pusher")
    axis.set(ylabel="from the axis [mm]")
    axis.set_title(f"{part}; shaded: the slide runs a profile", loc="left", fontsize=10)
    axis.tick_params(labelbottom=False)
    pictures.legend(axis, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)


def _force(axis: Any, last: dict[str, Floats]) -> None:
    """Peak force of each sample."""
    _shade(axis, last)
    axis.plot(last["time"], last["peak_force"], color=_FORCE, lw=1, drawstyle="steps")
    axis.set(ylabel="peak force [N]", xlabel="time [s]")
    axis.set_ylim(bottom=min(0.0, float(np.nanmin(last["peak_force"]))))


def _parts(axis: Any, log: PartLog) -> None:
    """Offset of each part by push and at the end; unfinished parts in red."""
    out = log.outcome
    offset = UM * np.maximum(np.hypot(out.center_x.values, out.center_y.values), _LEAST)
    final = UM * np.maximum(out.offset.values, _LEAST)
    done = out.finished.values > 0
    axis.plot(offset.T, color=_RIM, lw=0.6, alpha=max(0.3, 1.0 / len(offset)))
    for those, color, label in ((done, _TIP, "finished"), (~done, _BAD, "not finished")):
        if those.any():
            axis.plot(out.pushes.values[those], final[those], "o", color=color, ms=3.5, label=label)
    axis.axhline(UM * float(out.attrs["tolerance"]), color="0.15", lw=1, ls="--", label="tolerance")
    axis.set(xlabel="pushes", ylabel="offset [µm]", yscale="log")
    axis.set_ylim(min(0.1, 0.5 * float(final.min())), 2.0 * max(5.0, float(np.nanmax(offset))))
    axis.xaxis.get_major_locator().set_params(integer=True)
    axis.set_title(f"{parts_named(log)}, push by push", loc="left", fontsize=10)
    pictures.legend(axis, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _title(log: PartLog) -> str:
    """Summary of the parts in one line."""
    out = log.outcome
    parts, done = len(log), int((out.finished.values > 0).sum())
    told = (
        f"{float(out.attrs['mass']):g} kg: {done} of {parts} finished"
        if parts > 1
        else f"{float(out.attrs['mass']):g} kg"
    )
    return f"{told}, {out.pushes.values.mean():.3g} pushes and {out.time.values.mean():.3g} s a part"
