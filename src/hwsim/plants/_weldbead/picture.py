"""Picture of a run on the weld-bead stand: height of all beads in time, penalties, cuts, power."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim.protocols import PartLog
from sdpgrind.base import pictures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GOOD, _BAD, _PLAN, _REAL = "tab:blue", "tab:red", "0.15", "tab:orange"
_MOST_BEADS = 100  # chosen: more lines cannot be distinguished


def picture(log: PartLog) -> "Figure":
    """Draw a log of `WeldBeadStand`: height in time, penalties, cuts, and power over removal rate."""
    figure: Figure
    figure, axes = pictures.subplots(2, 2, (11, 7.5))
    table = log[log.tiers[0]]
    _heights(axes[0, 0], log, table)
    _penalties(axes[0, 1], log)
    _cuts(axes[1, 0], table)
    _powers(axes[1, 1], log, table)
    pictures.opened(axes.ravel())
    figure.suptitle(_title(log))
    return figure


def _title(log: PartLog) -> str:
    out = log.outcome
    over = 100 * float((out.overground.values > 0).mean())
    beads = f"{len(log)} beads" if len(log) > 1 else "1 bead"
    return f"{beads}: {out.passes.values.mean():.1f} passes each, {over:.0f} % overground"


def _heights(axis: Any, log: PartLog, table: Any) -> None:
    """Scanned height of each bead; a pass is a slope, its reset is level."""
    reset = float(log.outcome.attrs["reset_time"])
    over = log.outcome.overground.values > 0
    shown = min(len(log), _MOST_BEADS)
    for part in range(shown):
        rows = np.flatnonzero(table.part.values == part)
        time, height = table.time.values[rows], table.height.values[rows]
        ends = np.maximum(time[1:] - reset, time[:-1])
        x = np.concatenate([time[:1], np.stack([ends, time[1:]], axis=1).ravel()])
        y = np.concatenate([height[:1], np.repeat(height[1:], 2)])
        colour = _BAD if over[part] else _GOOD
        axis.plot(x, y, "-", color=colour, lw=0.9, alpha=max(0.25, 1 - shown / 60))
        axis.plot(time, height, "o", color=colour, ms=2.5, alpha=max(0.25, 1 - shown / 60))
    _target_and_deadline(axis, log)
    axis.set(xlabel="time [s]", ylabel="height of the bead [mm]")
    some = f", the first {shown}" if shown < len(log) else ""
    axis.set_title(f"Every pass{some}", loc="left")


def _target_and_deadline(axis: Any, log: PartLog) -> None:
    deadline = float(log.outcome.attrs["start_time"])
    axis.axhline(0, color=_PLAN, lw=1)
    axis.axvline(deadline, color=_PLAN, lw=1, ls="--")
    low, high = axis.get_ylim()
    low = min(low, -0.08 * high)  # room for the words
    axis.set_ylim(low, high)
    axis.axhspan(low, 0, color=_BAD, alpha=0.06, lw=0)
    small: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8}
    axis.annotate("target", (0, 0), (2, 3), **small)
    axis.annotate("overground", (0, 0), (2, -3), color=_BAD, va="top", **small)
    axis.annotate("deadline", (deadline, high), (-3, -3), ha="right", va="top", rotation=90, **small)


def _penalties(axis: Any, log: PartLog) -> None:
    """Realised penalties, their mean with standard error, and the expectation of the policy."""
    values = log.outcome.penalty.values
    most = float(np.quantile(values, 0.995)) if values.size >= 200 else float(values.max())
    axis.hist(values, bins=min(40, max(8, values.size // 5)), range=(0, most or 1.0), color=_GOOD, alpha=0.45)
    if beyond := int((values > most).sum()):
        told = f"{beyond} more, up to {values.max():.3g} " + r"\$ →"
        axis.annotate(told, (1, 0.06), xycoords="axes fraction", ha="right", fontsize=8)
    mean = values.mean()
    error = values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else 0.0
    axis.axvspan(mean - error, mean + error, color=_REAL, alpha=0.3, lw=0)
    axis.axvline(mean, color=_REAL, label=rf"realised {mean:.4f} $\pm$ {error:.4f} \$")
    if "penalty_planned" in log.outcome:
        planned = log.outcome.penalty_planned.values.mean()
        axis.axvline(planned, color=_PLAN, ls="--", label=rf"planned {planned:.4f} \$")
    axis.set(xlabel=r"penalty of a bead [\$]", ylabel="beads")
    axis.yaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    axis.set_title("What it cost", loc="left")
    pictures.legend(axis)


def _faint(points: int) -> float:
    """Opacity for a number of points."""
    return float(np.clip(300 / max(points, 1), 0.15, 0.8))


def _cuts(axis: Any, table: Any) -> None:
    """Depth of each pass over the expectation of the policy."""
    same = table.part.values[1:] == table.part.values[:-1]
    measured = table.cut_depth.values[1:][same]
    if "mean_cut_planned" in table:
        expected = table.mean_cut_planned.values[:-1][same]
        axis.set(xlabel="mean cut expected of the pass [mm]", ylabel="cut by two scans [mm]")
    else:
        expected = np.arange(measured.size) + 1.0
        axis.set(xlabel="pass", ylabel="cut by two scans [mm]")
    axis.plot(expected, measured, ".", color=_GOOD, ms=3, alpha=_faint(measured.size))
    if "mean_cut_planned" in table and measured.size:
        line = np.array([0, expected.max()])
        axis.plot(line, line, color=_PLAN, lw=1, ls="--")
    axis.set_title("What passes removed", loc="left")


def _powers(axis: Any, log: PartLog, table: Any) -> None:
    """Measured power over removal rate: slope is the specific energy, intercept the idle power."""
    rate, power = table.removal_rate.values, table.grinding_power.values
    axis.plot(rate, power, ".", color=_GOOD, ms=3, alpha=_faint(rate.size), label="passes")
    if np.isfinite(rate).any():
        energy = np.nanmedian(log.outcome.true_specific_energy.values)
        idle = np.nanmedian(log.outcome.true_idle_power.values)
        line = np.array([0, np.nanmax(rate)])
        label = f"median truth: {energy:.1f} J/mm³, {idle:.0f} W"
        axis.plot(line, idle + energy * line, color=_PLAN, lw=1, ls="--", label=label)
    axis.set(xlabel="removal rate [mm³/s]", ylabel="grinding power [W]")
    axis.set_ylim(bottom=0)
    axis.set_title("What the sensors say", loc="left")
    pictures.legend(axis)
