"""Picture of doubts: intervals relative to what is believed, and what the plan makes of them."""

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.doubts.stakes import Figure, Stake

if TYPE_CHECKING:
    from sdpgrind.base.doubts.record import Doubts

_LABEL = 36  # chosen: characters of a line below half of the picture


def drawn_doubts(doubts: "Doubts") -> Any:
    """Draw intervals over believed values on the left, stakes on the right; return the figure."""
    rows = [row for row in doubts.rows if row.measured and row.believed]
    tall = 0.4 * max(len(rows), len(doubts.stakes), 2) + 1.2
    figure, axes = pictures.subplots(1, 2 if doubts.stakes else 1, (8.0, tall), squeeze=False)
    _intervals(axes[0, 0], rows)
    if doubts.figure and doubts.stakes:
        _stakes(axes[0, 1], doubts.figure, doubts.stakes)
    pictures.opened(axes[0])
    return figure


def _intervals(axis: Any, rows: list[Any]) -> None:
    for k, row in enumerate(rows):
        low, told, high = (value / float(row.believed) for value in (row.low, row.told, row.high))
        colour = pictures.LIMIT if row.verdict == "differs" else pictures.ACTUAL
        axis.plot([low, high], [k, k], color=colour, lw=4, solid_capstyle="butt")
        axis.plot(told, k, "o", color=colour)
    axis.axvline(1.0, color="k", lw=0.8)
    axis.set(xlabel="told by the data / believed", yticks=range(len(rows)), ylim=(len(rows) - 0.5, -0.5))
    axis.set_yticklabels([pictures.label(row.name) for row in rows])


def _stakes(axis: Any, figure: Figure, stakes: Sequence[Stake]) -> None:
    for k, stake in enumerate(stakes):
        ends = [value for value in (stake.at_low, stake.at_high) if np.isfinite(value)]
        axis.plot(ends, [k] * len(ends), "o-", color=pictures.ACTUAL, lw=4, ms=4)
    axis.axvline(figure.value, color="k", lw=0.8)
    axis.set(xlabel=fill(pictures.label(figure.name, figure.unit), _LABEL), yticks=range(len(stakes)))
    axis.set_yticklabels([pictures.label(stake.name) for stake in stakes])
    axis.set_ylim(len(stakes) - 0.5, -0.5)
