"""Picture of a run on the force table: force and demand, contours, removal of each pass, penalty."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import part_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_REAL, _ASKED, _PLAN, _BAD = "tab:blue", "tab:orange", "0.15", "tab:red"


def picture(log: PartLog) -> "Figure":
    """Draw the first bead of a log of `ForceTableStand` by pass, and the outcomes of all beads."""
    figure: Figure
    figure, axes = pictures.subplots(2, 2, (11, 7.5))
    _forces(axes[0, 0], log)
    _contours(axes[0, 1], log)
    _cuts(axes[1, 0], log)
    _outcomes(axes[1, 1], log)
    pictures.opened(axes.ravel())
    out = log.outcome
    beads = f"{len(log)} beads" if len(log) > 1 else "1 bead"
    figure.suptitle(
        f"{beads}: {out.passes.values.mean():.1f} passes each, {int(out.stalls.values.sum())} stalls"
    )
    return figure


def _bead(log: PartLog) -> str:
    return part_named(log, 0, "bead")


def _first(log: PartLog, name: str) -> Any:
    """Table of the first bead that has a column, or None."""
    for tier in log.tiers:
        if name in log[tier]:
            table = log[tier]
            return table.isel(row=np.flatnonzero(table.part.values == 0))
    return None


def _forces(axis: Any, log: PartLog) -> None:
    """Measured force, and the demand where the controller reports it."""
    table = _first(log, "force")
    axis.set(xlabel="time [s]", ylabel="force [N]")
    axis.set_title(f"Force of {_bead(log)}", loc="left")
    if table is None:
        return
    if "force_demand_planned" in table:  # drawn first: a re-planned demand repeats the noise of the reading
        axis.plot(table.time, table.force_demand_planned, color=_ASKED, lw=1.6, label="demanded")
    axis.plot(table.time, table.force, color=_REAL, lw=0.7, label="read")
    pictures.legend(axis)


def _contours(axis: Any, log: PartLog) -> None:
    """Scans of the first bead, and its final contour."""
    table = _first(log, "profile")
    if table is not None and "profile_x" in table:
        scans = [k for k in range(table.sizes["row"]) if np.isfinite(table.profile.values[k]).any()]
        for k, row in enumerate(scans):
            shade = str(0.75 - 0.6 * k / max(1, len(scans)))
            axis.plot(table.profile_x.values[row], table.profile.values[row], color=shade, lw=0.7)
    left = log.outcome.contour.values[0]
    attrs = log.outcome.attrs
    x = float(attrs["grid_start"]) + float(attrs["grid_spacing"]) * np.arange(left.size)
    axis.plot(x, left, color=_REAL, lw=1.2, label="left at the end, true")
    axis.axhline(0, color=_PLAN, lw=1)
    axis.set(xlabel="along the bead [mm]", ylabel="height [mm]")
    axis.set_title(f"Contours of {_bead(log)}, the later the darker", loc="left")
    pictures.legend(axis)


def _cuts(axis: Any, log: PartLog) -> None:
    """Mean depth of each pass over its force."""
    out = log.outcome
    axis.plot(
        out.true_force.values.ravel(), out.true_cut_depth.values.ravel(), "o", color=_REAL, ms=3, alpha=0.6
    )
    axis.set(xlabel="mean force on the bead [N]", ylabel="mean cut [mm]")
    axis.set_title("What passes removed", loc="left")


def _outcomes(axis: Any, log: PartLog) -> None:
    """Final height and deepest overground point of each bead."""
    out = log.outcome
    axis.plot(out.part.values, out.height.values, "o", color=_REAL, ms=4, label="mean height left")
    axis.plot(
        out.part.values, -out.overground_worst.values, "v", color=_BAD, ms=4, label="deepest overground"
    )
    axis.axhline(0, color=_PLAN, lw=1)
    axis.set(xlabel="bead", ylabel="height [mm]", xlim=(out.part.values[0] - 0.5, out.part.values[-1] + 0.5))
    axis.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    axis.set_title(f"What was left; mean penalty {out.penalty.values.mean():.3f} \\$", loc="left")
    pictures.legend(axis)
