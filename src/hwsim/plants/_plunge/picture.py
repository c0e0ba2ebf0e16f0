"""Picture of a run on the plunge grinder: the last part in time, and the outcomes of all parts."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import columns, part_named, parts_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures, stored
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LEFT, _DAMAGE, _FEED, _BAD, _LIMIT = "0.35", "tab:red", "tab:blue", "tab:red", "0.15"
_BEGINS = 2.0  # least infeed with visible damage over the rate at burn onset; chosen: excludes ploughing


_COLUMNS = (
    "time", "size", "grinding_power", "power_saturated", "command_rate_command",
    "section_planned", "infeed_rate_planned",
)  # fmt: skip


def picture(log: PartLog) -> "Figure":
    """Draw a log of `PlungeGrinder`: rates, stock and damage of the last part; outcomes of all parts."""
    figure: Figure = pictures.figure(11.5, 6.8)
    grid = figure.add_gridspec(6, 2, width_ratios=(1.25, 1))
    last = columns(log, _COLUMNS)
    rates = figure.add_subplot(grid[:3, 0])
    _rates(rates, last, part_named(log).capitalize())
    _stock(figure.add_subplot(grid[3:, 0], sharex=rates), last, log)
    _outcomes([figure.add_subplot(grid[2 * k : 2 * k + 2, 1]) for k in range(3)], log)
    pictures.opened(figure.axes)
    figure.suptitle(_title(log))
    return figure


def _title(log: PartLog) -> str:
    out = log.outcome
    parts = f"{len(log)} parts" if len(log) > 1 else "1 part"
    burned, rough = (int(out[name].values.sum()) for name in ("burned", "out_of_round"))
    return f"{parts}: {out.time.values.mean():.2f} s each, {burned} burned, {rough} out of round"


def _sections(axis: Any, last: dict[str, Floats]) -> None:
    """A line at the beginning of each section."""
    begins = np.flatnonzero(np.diff(last["section_planned"]) > 0) + 1
    for begin in begins[:-1] if begins.size else begins:  # the last one ends the part
        axis.axvline(last["time"][begin], color="0.8", lw=1, zorder=0)


def _rates(axis: Any, last: dict[str, Floats], title: str) -> None:
    time = last["time"]
    axis.step(time, UM * last["command_rate_command"], where="post", color="0.6", lw=1, label="command")
    if np.isfinite(last["infeed_rate_planned"]).any():
        axis.plot(
            time, UM * last["infeed_rate_planned"], color=_FEED, label="infeed, estimated by the controller"
        )
    _sections(axis, last)
    axis.set(ylabel="rate [µm/s]")
    axis.tick_params(labelbottom=False)
    axis.set_title(title, loc="left")
    pictures.legend(axis)


def _stock(axis: Any, last: dict[str, Floats], log: PartLog) -> None:
    """Remaining stock by the gauge, and burn depth by unclipped power."""
    attributes, time = log.outcome.attrs, last["time"]
    axis.plot(
        time, float(attributes["stock"]) - last["size"], color=_LEFT, label="remaining stock, by the gauge"
    )
    if "problem" in attributes:
        problem = stored.decode(str(attributes["problem"]))
        model = problem.model
        cuts = last["infeed_rate_planned"] > _BEGINS * model.burn_onset[0]
        used = cuts & (last["power_saturated"] == 0)
        power = last["grinding_power"][used] - problem.drive.idle_power
        damage = model.burn_depth(last["infeed_rate_planned"][used], power)
        axis.plot(
            time[used], np.maximum(damage, 0.0), ".", color=_DAMAGE, ms=3, label="depth of damage, by power"
        )
    axis.axhline(0, color=_LIMIT, lw=1)
    _sections(axis, last)
    axis.set(xlabel="time [s]", ylabel="depth from the size [mm]")
    pictures.legend(axis)


def _outcomes(axes: list[Any], log: PartLog) -> None:
    """Time, least stock minus burn depth (``part_slack``; no point: no damage) and roundness of each part."""
    out, limit = log.outcome, float(log.outcome.attrs["roundness_max"])
    parts = np.arange(len(log))
    _series(axes[0], parts, out.time.values, out.unfinished.values)
    axes[0].set(ylabel="time [s]")
    axes[0].set_title(parts_named(log), loc="left")
    _series(axes[1], parts, UM * out.part_slack.values, out.burned.values)
    axes[1].set(ylabel="part slack [µm]")
    axes[1].axhline(0, color=_LIMIT, lw=1, ls="--")
    axes[1].annotate(
        "below: burned", (0.99, 0), (0, 3), xycoords=("axes fraction", "data"), **_small(ha="right")
    )
    _series(axes[2], parts, UM * out.roundness.values, out.out_of_round.values)
    axes[2].set(ylabel="out-of-round [µm]", xlabel="part")
    axes[2].axhline(UM * limit, color=_LIMIT, lw=1, ls="--")
    axes[2].annotate(
        "limit", (0.99, UM * limit), (0, 3), xycoords=("axes fraction", "data"), **_small(ha="right")
    )
    for axis in axes:
        axis.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
        axis.margins(y=0.2)
    for axis in axes[:2]:
        axis.sharex(axes[2])
        axis.tick_params(labelbottom=False)


def _small(**options: Any) -> dict[str, Any]:
    return {"textcoords": "offset points", "fontsize": 8, **options}


def _series(axis: Any, parts: Any, values: Floats, bad: Floats) -> None:
    """One value for each part; bad ones in red."""
    axis.plot(parts, values, "-", color=_FEED, lw=0.8, alpha=0.5)
    for chosen, colour in ((bad == 0, _FEED), (bad != 0, _BAD)):
        axis.plot(parts[chosen], values[chosen], "o", color=colour, ms=3.5)
