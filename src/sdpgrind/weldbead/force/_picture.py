"""Picture of a simulated force loop."""

from typing import Any

import numpy as np

from sdpgrind.base import pictures

_MOST_RUNS = 20  # chosen: more lines are not told apart


def plot_loop(record: Any) -> Any:
    """Draw force against plan, readings, and the command of each run over time (N, mm, s)."""
    figure, (top, low) = pictures.subplots(2, 1, (9, 5), sharex=True, height_ratios=(1.5, 1))
    runs, samples = record.command.shape
    shown, period = min(runs, _MOST_RUNS), record.time[-1] / samples
    faint = max(0.2, 1 - shown / 12)
    for k in range(shown):
        name = (
            dict.fromkeys(("reading", "force"), "_") if k else {"reading": "read", "force": "at the contact"}
        )
        begins = period * np.arange(samples)
        top.plot(begins, record.reading[k], ".", color="0.7", ms=2, label=name["reading"], zorder=1)
        top.plot(
            record.time,
            record.force[k],
            color=pictures.ACTUAL,
            lw=0.9,
            alpha=faint,
            label=name["force"],
            zorder=2,
        )
        low.step(begins, record.command[k], where="post", color=pictures.ACTUAL, lw=0.9, alpha=faint)
    top.plot(record.time, record.planned, "--", color=pictures.LIMIT, lw=1.2, label="planned", zorder=3)
    top.set_ylabel("normal force [N]")
    pictures.legend(top, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    low.set(ylabel="platform command [mm]", xlabel="time [s]", xlim=(0, record.time[-1]))
    some = f", the first {shown} drawn" if shown < runs else ""
    rms = record.error_rms().mean()
    figure.suptitle(
        f"{runs} run{'s' if runs > 1 else ''}{some}: force {rms:.3g} N rms off the plan", fontsize=10
    )
    return figure
