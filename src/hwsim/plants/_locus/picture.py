"""Picture of a run on the adaptive grinder: the first parts in time and on the locus, all parts."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import parts_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures, stored
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COMMAND, _TRUE, _BEST, _LIMIT, _BAD = "0.6", "tab:blue", "tab:green", "0.15", "tab:red"
_SHOWN = 5  # parts drawn over time; chosen: later parts look like the last of them
_SAMPLES = ("sample_time", "true_infeed_rate", "best_infeed_rate", "true_grinding_power", "burning_power")


def picture(log: PartLog) -> "Figure":
    """Draw a log of `AdaptiveGrinder`: infeed and power of the first parts, path on the locus, all parts."""
    figure: Figure = pictures.figure(12.5, 7.2)
    grid = figure.add_gridspec(6, 2, width_ratios=(1.6, 1))
    slack = figure.add_subplot(grid[4:, 0])
    _in_time(
        [*(figure.add_subplot(grid[rows, 0], sharex=slack) for rows in (slice(2), slice(2, 4))), slack], log
    )
    _way(figure.add_subplot(grid[:2, 1]), log)
    least = figure.add_subplot(grid[4:, 1])
    _outcomes([figure.add_subplot(grid[2:4, 1], sharex=least), least], log)
    pictures.opened(figure.axes)
    figure.suptitle(_title(log))
    return figure


def _title(log: PartLog) -> str:
    out = log.outcome
    areas = out.true_wear_flat_area.values
    parts = f"{len(log)} parts" if len(log) > 1 else "1 part"
    burned = f"{int(out.burned.values.sum())} burned"
    return (
        f"{parts}: {out.time.values.mean():.1f} s each, {burned}; wear flat area {areas[-1]:.4g} in the end"
    )


def _samples(log: PartLog, part: int) -> dict[str, Floats]:
    """Truth of a part by sample, without the first one, before contact."""
    out = log.outcome.isel(part=part)
    known = np.isfinite(out.sample_time.values)
    return {name: out[name].values[known] for name in _SAMPLES}


def _commands(log: PartLog, part: int) -> tuple[Floats, ...]:
    """Time, infeed rate and work rotation of the commands of a part."""
    table = log[log.tiers[0]]
    names = ("infeed_rate_command", "work_rotation_command")
    if any(name not in table.variables for name in names):
        return np.empty(0), np.empty(0), np.empty(0)
    rows = table.part.values == part
    return tuple(table[name].values[rows] for name in ("time", *names))


def _in_time(axes: list[Any], log: PartLog) -> None:
    """Infeed, power and slack over the time of the series."""
    rates, power, slack = axes
    begin, once = 0.0, True
    for part in range(min(len(log), _SHOWN)):
        true, (time, rate, _) = _samples(log, part), _commands(log, part)
        label: Any = (lambda text: text) if once else (lambda text: None)
        at = begin + true["sample_time"]
        rates.step(begin + time, UM * rate, where="post", color=_COMMAND, lw=1, label=label("command"))
        rates.plot(at, UM * true["true_infeed_rate"], color=_TRUE, label=label("true infeed"))
        rates.plot(
            at,
            UM * true["best_infeed_rate"],
            "--",
            color=_BEST,
            label=label("best infeed for the wheel as it is"),
        )
        _powers([power, slack], at[1:], true["true_grinding_power"][1:], true["burning_power"][1:], label)
        for axis in axes:
            axis.axvspan(begin, begin + float(log.outcome.attrs["touch_in"]), color="0.94", lw=0, zorder=0)
        begin, once = begin + float(log.outcome.time.values[part]), False
    rates.set(ylabel="infeed rate [µm/s]")
    some = f"The first {_SHOWN} parts" if len(log) > _SHOWN else f"{parts_named(log)} in time"
    rates.set_title(some, loc="left")
    power.set(ylabel="power [W]")
    slack.set(xlabel="time of the series [s]", ylabel="slack [W]", ylim=_near_zero(log))
    slack.axhline(0, color=_LIMIT, lw=1, ls="--")
    for axis in (rates, power):
        axis.tick_params(labelbottom=False)
        pictures.legend(axis, loc="lower right")
    pictures.legend(slack, loc="upper right")


def _near_zero(log: PartLog) -> tuple[float, float]:
    """Limits of the slack axis: violations, and some more above zero."""
    least = np.nanmin(log.outcome.slack.values[:_SHOWN], initial=0.0)
    return 1.3 * min(float(least), -5.0), 4.0 * max(-float(least), 10.0)


def _powers(axes: list[Any], time: Floats, true: Floats, limit: Floats, label: Any) -> None:
    """Grinding and burning power, and their difference; burning is shaded."""
    power, slack = axes
    power.plot(time, limit, color=_LIMIT, lw=1, ls="--", label=label("burning power"))
    power.plot(time, true, color=_TRUE, label=label("grinding power"))
    slack.plot(time, limit - true, color=_TRUE, label=label("burning less grinding power"))
    burns = {"where": true > limit, "interpolate": True, "color": _BAD, "alpha": 0.6, "lw": 0}
    power.fill_between(time, limit, true, **burns)
    slack.fill_between(time, limit - true, 0.0, **burns, label=label("burns"))


def _way(axis: Any, log: PartLog) -> None:
    """Work speed over infeed: the locus, commands, and positions of the slide."""
    attributes = log.outcome.attrs
    process = stored.decode(str(attributes["process"])) if "process" in attributes else None
    process = getattr(process, "grinding", process)  # of a dressed wheel
    half = process.work_diameter / 2 if process else 1.0
    ranges = float(attributes["work_rotation_min"]), float(attributes["work_rotation_max"])
    ends: list[float] = []
    for part in range(min(len(log), _SHOWN)):
        true, (_, rate, rotation) = _samples(log, part), _commands(log, part)
        shown = np.isfinite(rotation)
        first = part == 0
        axis.plot(
            UM * rate[shown],
            half * rotation[shown],
            ".",
            color=_COMMAND,
            ms=4,
            label="command" if first else None,
        )
        count = min(int(shown.sum()), len(true["true_infeed_rate"]) - 1)
        after = true["true_infeed_rate"][1 : 1 + count]
        axis.plot(
            UM * after,
            half * rotation[shown][:count],
            color=_TRUE,
            lw=1,
            label="true infeed" if first else None,
        )
        ends += rate[shown].tolist()
    if process and ends:
        _locus(axis, process, np.linspace(0.9 * min(ends), 1.1 * max(ends), 200), ranges)
    axis.set(xlabel="infeed rate [µm/s]", ylabel="work speed [mm/s]" if process else "work rotation [rad/s]")
    axis.set_title("The way along the locus", loc="left")
    pictures.legend(axis)


def _locus(axis: Any, process: Any, rates: Floats, ranges: tuple[float, float]) -> None:
    """Work speed of the locus, where its closed form is known."""
    try:
        speeds = process.work_speed_on_locus(process.specific_removal_rate(rates))
    except TypeError:  # another sliding law
        return
    bounds = [process.work_speed(end) for end in ranges]
    axis.plot(UM * rates, np.clip(speeds, *bounds), color=_BEST, lw=1, zorder=0, label="locus")


def _outcomes(axes: list[Any], log: PartLog) -> None:
    """Convergence and slack of each part."""
    out, parts = log.outcome, np.arange(len(log))
    axes[0].plot(parts, out.convergence_time.values, "o-", color=_TRUE, ms=3.5, lw=0.8)
    axes[0].set(ylabel="converged [s]", ylim=(0, None))
    axes[0].set_title(parts_named(log), loc="left")
    axes[0].tick_params(labelbottom=False)
    slack, burned = out.slack.values, out.burned.values != 0
    axes[1].plot(parts, slack, "-", color=_TRUE, lw=0.8, alpha=0.5)
    for chosen, colour in ((~burned, _TRUE), (burned, _BAD)):
        axes[1].plot(parts[chosen], slack[chosen], "o", color=colour, ms=3.5)
    axes[1].axhline(0, color=_LIMIT, lw=1, ls="--")
    axes[1].set(ylabel="least slack [W]", xlabel="part")
    small: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8, "ha": "right"}
    axes[1].annotate("below: burns", (0.99, 0), (0, 3), xycoords=("axes fraction", "data"), **small)
    for axis in axes:
        axis.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
        axis.margins(y=0.2)
