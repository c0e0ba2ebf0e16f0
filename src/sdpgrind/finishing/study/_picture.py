"""Picture of a study: mean ratio at the levels of each factor."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.finishing.study._means import LevelMean
from sdpgrind.finishing.study._observations import analysed
from sdpgrind.finishing.study._ratios import RATIOS
from sdpgrind.finishing.study._texts import labelled, level

if TYPE_CHECKING:
    from sdpgrind.finishing.study._study import Study

COLOUR = pictures.ACTUAL


def main_effects(study: "Study", confidence: float) -> Any:
    """Figure of a study; see `Study.plot`."""
    rows = study.level_means(confidence).rows
    names = list(study.factors)
    figure, axes = pictures.subplots(1, len(names), (1.2 + 1.9 * len(names), 3.4), sharey=True, squeeze=False)
    for axis, name in zip(axes[0], names, strict=True):
        _panel(axis, labelled(name, study.units.get(name, "")), [row for row in rows if row.factor == name])
        axis.axhline(float(analysed(study).y.mean()), color="0.6", lw=0.8, ls="--", zorder=0)
    unit = RATIOS[study.ratio].unit
    axes[0, 0].set_ylabel(f"mean ratio [{unit}]" if unit else labelled(study.name, study.unit))
    _second_scale(study, axes[0, -1])
    if any(row.half_width is not None for row in rows):
        figure.suptitle(f"{study.name}: means with {100 * confidence:g} % intervals", fontsize=9, color="0.3")
    return figure


def _panel(axis: Any, name: str, rows: list[LevelMean]) -> None:
    """Plot levels at equal distances, numbers in ascending order."""
    if all(isinstance(row.level, float) for row in rows):
        rows = sorted(rows, key=lambda row: float(row.level))
    at, means = np.arange(len(rows)), [row.mean for row in rows]
    axis.plot(at, means, "o-", color=COLOUR, ms=5, lw=1.2)
    widths = [row.half_width for row in rows]
    if None not in widths:
        axis.errorbar(at, means, yerr=widths, fmt="none", ecolor=COLOUR, elinewidth=1.0, capsize=3)
    axis.set_xticks(at, [level(row.level) for row in rows], fontsize=8)
    axis.set_xlim(-0.4, len(rows) - 0.6)
    axis.set_title(name.replace("_", " "), fontsize=9)


def _second_scale(study: "Study", axis: Any) -> None:
    """Add the response on the right-hand side, at the ticks of the ratio."""
    back = RATIOS[study.ratio].back
    if back is None or study.ratio == "none":
        return
    scale, unit = (1e3, "µm") if study.unit == "mm" and study.reference < 0.1 else (1.0, study.unit)
    right = axis.twinx()
    right.set_ylim(axis.get_ylim())
    ticks = [tick for tick in axis.get_yticks() if axis.get_ylim()[0] <= tick <= axis.get_ylim()[1]]
    right.set_yticks(
        ticks, [f"{scale * study.reference * float(back(np.asarray(tick))):.3g}" for tick in ticks]
    )
    right.set_ylabel(labelled(study.name, unit))
