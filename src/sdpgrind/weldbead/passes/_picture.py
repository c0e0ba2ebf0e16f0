"""Pictures of a planned and of a relaxed pass."""

from typing import Any

import numpy as np

from sdpgrind.base import pictures

_TARGET = "#e0a9a0"  # pale and wide, below the reached contour: both are seen where they coincide


def plot_pass(plan: Any) -> Any:
    """Draw contours with the target, force and power with their limits, and the height of the disc (mm)."""
    problem = plan.problem
    figure, axes = pictures.subplots(4, 1, (9, 8.4), sharex=True, height_ratios=(1.5, 1, 1, 1))
    bead, after = problem.bead, plan.contour
    axes[0].fill_between(
        after.x, after.z, bead.at(after.x), color="#d9a441", alpha=0.45, lw=0, label="ground off"
    )
    axes[0].plot(bead.x, bead.z, color="0.35", lw=1, label="before")
    axes[0].plot(problem.target.x, problem.target.z, color=_TARGET, lw=3, label="target")
    axes[0].plot(after.x, after.z, color=pictures.ACTUAL, lw=1.4, label="after")
    axes[0].set_ylabel("height [mm]")
    pictures.legend(axes[0], ncols=4, loc="lower left", bbox_to_anchor=(0, 1))
    axes[1].plot(plan.tip_x, plan.normal_force, color=pictures.ACTUAL)
    if np.isfinite(problem.force_limit):
        axes[1].axhline(problem.force_limit, color=pictures.LIMIT, lw=0.8, ls=":")
    axes[1].set_ylabel("normal force [N]")
    axes[2].plot(plan.tip_x, plan.grinding_power, color="#6a8f4e")
    axes[2].axhline(problem.disc.model.idle_power, color="0.5", lw=0.8, ls=":")
    axes[2].set_ylabel("power [W]\n(dotted: idle)")
    axes[3].plot(plan.tip_x, plan.fly_height, color="0.3")
    axes[3].set(ylabel="height of\nthe center [mm]", xlabel="tip along the bead [mm]")
    figure.suptitle(f"{plan.method}: {plan.status}", fontsize=10)
    return figure


def plot_relaxed(found: Any) -> Any:
    """Draw bead, target, what a relaxed cut leaves, and its depth under the greatest (mm)."""
    problem, x = found.problem, found.x
    figure, (top, low) = pictures.subplots(2, 1, (9, 4.8), sharex=True)
    top.plot(problem.bead.x, problem.bead.z, color="0.35", lw=1, label="before")
    top.plot(problem.target.x, problem.target.z, color=_TARGET, lw=3, label="target")
    top.plot(x, found.contour.at(x), color=pictures.ACTUAL, lw=1.4, label="left")
    top.set_ylabel("height [mm]")
    pictures.legend(top, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    low.plot(x, found.cut_depth, color=pictures.ACTUAL)
    low.axhline(found.depth_max, color=pictures.LIMIT, lw=0.8, ls=":")
    low.set(ylabel="depth [mm]\n(dotted: greatest)", xlabel="along the bead [mm]")
    figure.suptitle(
        f"{problem.mean_cut:g} mm at {problem.feed_rate:g} mm/s: {found.deviation:.3g} mm rms off",
        fontsize=10,
    )
    return figure
