"""Picture of a control chart: values and average over the parts, the moving range below."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures

if TYPE_CHECKING:
    from centering.monitoring._chart import ControlChart

VALUE, AVERAGE, LIMIT = "0.35", pictures.TRACKED, pictures.ALARM
SMALL = 0.05  # chosen: means below it are drawn in µm, mm


def plot(chart: "ControlChart") -> Any:
    """Figure of a control chart; see `ControlChart.plot`."""
    names = list(chart.limits)
    figure, axes = pictures.subplots(
        2, len(names), (1.5 + 4.0 * len(names), 4.8), sharex="col", squeeze=False, height_ratios=(2, 1)
    )
    for (top, low), name in zip(axes.T, names, strict=True):
        _quantity(chart, name, top, low)
    handles = {
        name: handle for top in axes[0] for handle, name in zip(*top.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside upper center",
        ncols=len(handles),
        frameon=False,
        fontsize=8,
    )
    return figure


def _quantity(chart: "ControlChart", name: str, top: Any, low: Any) -> None:
    """Both charts of one quantity; parts of the batch have negative numbers."""
    limits, unit = chart.limits[name], chart.summary["quantities"][name]["unit"]
    scale, shown = (1e3, "µm") if unit == "mm" and abs(limits.mean) < SMALL else (1.0, unit)
    batch, values, averages = (scale * column for column in chart._history(name))
    part = np.arange(-batch.size, values.size)
    top.plot(part, np.concatenate([batch, values]), "o-", color=VALUE, ms=2.5, lw=0.6, label="parts")
    top.plot(part[batch.size :], averages, color=AVERAGE, lw=1.4, label="average")
    top.axhline(scale * limits.mean, color="0.6", lw=0.8)
    _lines(top, (scale * limits.low, scale * limits.high), LIMIT, "limits of a part")
    _lines(top, (scale * limits.average_low, scale * limits.average_high), AVERAGE, "limits of the average")
    low.plot(part[1:], np.abs(np.diff(np.concatenate([batch, values]))), "o-", color=VALUE, ms=2.5, lw=0.6)
    _lines(low, (scale * limits.range_high,), LIMIT, "limit")
    for axis in (top, low):
        axis.axvline(-0.5, color="0.8", lw=0.8, zorder=0)
    shown = "" if shown == "1" else shown
    top.set_ylabel(pictures.label(name, shown))
    low.set(xlabel="part", ylabel=pictures.label("change", shown), ylim=(0, None))
    for part_out in {signal.part for signal in chart.signals if signal.quantity == name}:
        top.plot(part_out, values[part_out], "o", color=LIMIT, ms=5, mfc="none", label="signals")


def _lines(ax: Any, heights: tuple[float, ...], colour: str, name: str) -> None:
    """Limits, labelled once."""
    for k, height in enumerate(heights):
        ax.axhline(height, color=colour, lw=0.9, ls="--", label=name if k == 0 else None)
