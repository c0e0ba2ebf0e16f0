"""Pictures of logs: that of the plant, or a panel for each measured quantity."""

from collections.abc import Callable
from importlib import import_module
from math import nan
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import modelled
from hwsim.protocols import PartLog
from sdpgrind.base import pictures
from sdpgrind.base.means import half_interval
from sdpgrind.base.sheets.amounts import scale_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Plant -> module with a function ``picture(log)``; a table, since a file must not name code to import
_PICTURES = {
    "AdaptiveGrinder": "hwsim.plants._locus.picture",
    "CenteringMachine": "hwsim.plants._centering.picture",
    "FinishingCell": "hwsim.plants._finishing.picture",
    "ForceTableStand": "hwsim.plants._force_table.picture",
    "PlungeGrinder": "hwsim.plants._plunge.picture",
    "Probe": "hwsim.plants._probe.picture",
    "WeldBeadStand": "hwsim.plants._weldbead.picture",
}
_MOST_LETTERS = 36  # in all names of controllers; chosen: more overlap
_LINE = 48  # letters in a line below a panel; chosen: more exceed its width
_TITLE = 40  # letters in a line above a panel; chosen: more exceed its width
_MOST_PARTS = 50  # chosen: more lines cannot be told apart


def draw(log: PartLog) -> "Figure":
    """Draw a log with the picture of its plant."""
    module = _PICTURES.get(str(log.outcome.attrs["plant"]))
    if module is not None and "controller" not in log.outcome.dims:
        picture: Callable[[PartLog], Figure] = import_module(module).picture
        return picture(log)
    return compared(log) if "controller" in log.outcome.dims else _all_measured(log)


def label(variable: Any, name: str, more: str = "") -> str:
    """Axis label of a labelled array: long name, `more`, unit."""
    unit = variable.attrs.get("units", "1")
    text = variable.attrs.get("long_name", name)
    escaped = unit.replace("$", r"\$")
    return text + more if unit == "1" else f"{text}{more} [{escaped}]"


def _legible(variable: Any) -> Any:
    """Small lengths in µm, rates in µm/s and short times in ms, as in tables of a page; others unchanged."""
    largest, unit = float(np.nanmax(np.abs(variable.values), initial=0.0)), variable.attrs.get("units", "")
    factor, shown = scale_of(unit, largest)
    return variable if shown == unit else (factor * variable).assign_attrs(variable.attrs | {"units": shown})


def compared(log: PartLog) -> "Figure":
    """Draw each scalar outcome: controllers minus the first, part by part, with mean and 95 % interval.

    The means themselves are below each panel.
    """
    outcome = modelled(log.outcome)
    names = [str(n) for n, v in outcome.data_vars.items() if v.dims == ("controller", "part") and _tells(v)]
    if not names:
        raise ValueError("the log holds nothing to draw: every controller made the same of every part")
    columns = min(3, len(names))
    figure, axes = _panels(len(names), columns)
    controllers = [str(name) for name in outcome.controller.values]
    less = f" less that of {controllers[0]}" if len(controllers) > 1 else ""
    for axis, name in zip(axes, names, strict=True):
        variable = _legible(outcome[name])
        values = variable.values
        if len(controllers) > 1:
            _differences(axis, controllers[1:], values[1:] - values[:1])
            axis.set_xlabel(_means(controllers, values), fontsize="small")
        else:
            axis.boxplot([values[0][np.isfinite(values[0])]], tick_labels=controllers, showmeans=True)
        axis.set_title(fill(label(variable, name, less), _TITLE), fontsize="medium")
        axis.yaxis.set_major_formatter("{x:g}")  # a power of ten above the axis would lie on the title
    for axis in axes[:-columns]:
        axis.tick_params(labelbottom=False)  # names below the last panel of each column only
    figure.suptitle(f"{outcome.attrs['plant']}: {outcome.sizes['part']} equal parts for each controller")
    return figure


def _means(controllers: list[str], values: Any) -> str:
    """Text with the mean of each controller."""
    known = [row[np.isfinite(row)] for row in values]
    each = (
        f"{name} {row.mean() if row.size else nan:.3g}" for name, row in zip(controllers, known, strict=True)
    )
    return fill("means: " + ", ".join(each), _LINE)


def _differences(axis: Any, controllers: list[str], differences: Any) -> None:
    """A column for each controller: a point for each part, the mean and its interval."""
    axis.axhline(0, color="0.15", lw=1)
    for k, row in enumerate(differences):
        known = row[np.isfinite(row)]
        spread = 0.15 * np.linspace(-1, 1, known.size) if known.size > 1 else np.zeros(known.size)
        axis.plot(k - 0.15 + spread, known, ".", color="tab:blue", ms=3, alpha=0.5)
        mean = known.mean() if known.size else nan
        axis.errorbar(k + 0.25, mean, half_interval(known), fmt="o", color="tab:orange", ms=4, capsize=4)
    crowded = sum(map(len, controllers)) > _MOST_LETTERS
    axis.set_xticks(
        range(len(controllers)), controllers, **({"rotation": 30, "ha": "right"} if crowded else {})
    )
    axis.set_xlim(-0.6, len(controllers) - 0.4)


def _tells(variable: Any) -> bool:
    """Whether an outcome differs between controllers; for a single controller, between parts."""
    values = variable.values
    values = values[1:] - values[:1] if len(values) > 1 else values - values[:, :1]
    return bool(np.any(np.isfinite(values) & (values != 0)))


def _all_measured(log: PartLog) -> "Figure":
    """Every measured and commanded quantity of the first table against time, a line for each part."""
    table = log[log.tiers[0]]
    drawn = {str(name): each for name, each in table.data_vars.items() if each.dims == ("row",)}
    names = [n for n, v in drawn.items() if v.dtype.kind in "fiub" and np.isfinite(v.values).any()]
    figure, axes = _panels(len(names), columns=1)
    for axis, name in zip(axes, names, strict=True):
        shown = _legible(table[name])
        for part in range(min(len(log), _MOST_PARTS)):
            rows = shown.isel(row=np.flatnonzero(table.part.values == part))
            axis.plot(rows.time, rows, ".-", lw=0.8, ms=3, alpha=0.7)
        axis.set_ylabel(label(shown, name))
    axes[-1].set_xlabel(label(table.time, "time"))
    return figure


def _panels(number: int, columns: int) -> tuple["Figure", list[Any]]:
    if number == 0:
        raise ValueError("the log holds nothing to draw: no quantity has a reading")
    rows = -(-number // columns)
    size = (4.2 * columns + 3 * (columns == 1), 1.2 + 2.2 * rows)
    figure, axes = pictures.subplots(rows, columns, size, squeeze=False)
    for spare in axes.ravel()[number:]:
        spare.remove()
    return figure, list(axes.ravel()[:number])
