"""Picture of a run in the finishing cell: the last part in time and from above, all parts."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import modelled, part_named, parts_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TRUE, _SET, _GRAY, _BAD = "tab:blue", "0.15", "0.55", "tab:red"
_LEGEND: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1, 0.97)}  # above its axes
_SAMPLES = ("sample_time", "true_normal_force", "true_feed", "height_error", "true_x", "true_y")


def picture(log: PartLog) -> "Figure":
    """Draw a log of `FinishingCell`: the last part in time and from above, roughness of all parts."""
    figure: Figure = pictures.figure(12.5, 7.2)
    halves = figure.add_gridspec(1, 2, width_ratios=(1.5, 1))
    last, wanted = _last(log), _set_force(log)
    rows = halves[0].subgridspec(3, 1)
    height = figure.add_subplot(rows[2])
    _in_time([*(figure.add_subplot(rows[k], sharex=height) for k in (0, 1)), height], last, log, wanted)
    right = halves[1].subgridspec(2, 1, height_ratios=(2, 1))
    _from_above(figure.add_subplot(right[0]), last, log)
    _parts(figure.add_subplot(right[1]), log)
    pictures.opened(figure.axes, grid=False)
    figure.suptitle(_title(log, wanted))
    return figure


def _title(log: PartLog, wanted: float | None) -> str:
    out = log.outcome
    parts = f"{len(log)} parts" if len(log) > 1 else "1 part"
    played = np.isfinite(out.normal_force.values)
    if not played.any():
        return f"{parts}, {out.attrs['pattern']}: nothing was played"
    force, off, feed = (
        float(out[name].values[played].mean()) for name in ("normal_force", "lift_off", "feed")
    )
    held = f"{force:.3f} N" + ("" if wanted is None else f" for {wanted:.3f} N")
    return (
        f"{parts}, {out.attrs['pattern']}: "
        f"force {held}, {100 * off:.2g} % without contact, feed {feed:.1f} mm/s"
    )


def _last(log: PartLog) -> dict[str, Floats]:
    """Truth of the last part by sample."""
    out = log.outcome.isel(part=-1)
    known = np.isfinite(out.sample_time.values)
    return {name: out[name].values[known] for name in _SAMPLES}


def _set_force(log: PartLog) -> float | None:
    """Target force (N), or None."""
    wanted = log.outcome.attrs.get("target_force")
    return None if wanted is None else float(wanted)


def _in_time(axes: list[Any], last: dict[str, Floats], log: PartLog, wanted: float | None) -> None:
    """Force, feed and height error of a part over time."""
    force, feed, height = axes
    time, down = last["sample_time"], float(log.outcome.touch_down.values[-1])
    force.plot(time, last["true_normal_force"], color=_TRUE, lw=0.5, label="normal force")
    if wanted is not None:
        force.axhline(wanted, color=_SET, lw=1, ls="--", label="set")
    if np.isfinite(down):
        force.axvline(down, color=_GRAY, lw=0.8, ls=":", label="touches")
    force.set(ylabel="force [N]", ylim=(0, None))
    force.set_title(part_named(log).capitalize(), loc="left")
    pictures.legend(force, **_LEGEND, ncols=3)
    feed.plot(time, last["true_feed"], color=_TRUE, lw=0.5, label="of the contact")
    feed.axhline(
        float(log.outcome.attrs["feed_rate"]), color=_SET, lw=1, ls="--", label="planned between corners"
    )
    feed.set(ylabel="feed [mm/s]", ylim=(0, None))
    pictures.legend(feed, **_LEGEND, ncols=2)
    height.plot(time, UM * last["height_error"], color=_TRUE, lw=0.8)
    height.set(xlabel="time [s]", ylabel="height error [µm]")
    for axis in axes:
        axis.grid(alpha=0.25, lw=0.5)
    for axis in axes[:2]:
        axis.tick_params(labelbottom=False)


def _from_above(axis: Any, last: dict[str, Floats], log: PartLog) -> None:
    """Force in colours along the path of the contact."""
    down = np.flatnonzero(last["sample_time"] >= np.nan_to_num(log.outcome.touch_down.values[-1]))
    moved = down[last["true_feed"][down] > 0]
    force = last["true_normal_force"][moved]
    low, high = np.percentile(force, [1, 99]) if force.size else (0.0, 1.0)
    dots = axis.scatter(
        last["true_x"][moved], last["true_y"][moved], c=force, s=5, lw=0, vmin=low, vmax=high, cmap="viridis"
    )
    axis.figure.colorbar(dots, ax=axis, label="normal force [N]", shrink=0.85, extend="both")
    axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    axis.set_title(f"{part_named(log).capitalize()}, from above", loc="left")


def _parts(axis: Any, log: PartLog) -> None:
    """Roughness of each part, where its model knows it."""
    rough = UM * modelled(log.outcome).roughness_ra.values
    axis.plot(np.arange(len(log)), rough, "o-", color=_TRUE, lw=0.8, ms=4)
    if beyond := int(np.isnan(rough).sum()):
        where = {"xycoords": "axes fraction", "ha": "center", "color": _BAD}
        words = f"{beyond} of {counted(rough.size, 'part')}: beyond the roughness model"
        axis.annotate(words, (0.5, 0.5), **where)
    axis.set(
        xlabel="part",
        ylabel="roughness Ra [µm]",
        ylim=(0, 1.2 * np.nanmax(rough) if np.isfinite(rough).any() else 1.0),
    )
    axis.set_title(parts_named(log), loc="left")
    axis.grid(alpha=0.25, lw=0.5)
    axis.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
