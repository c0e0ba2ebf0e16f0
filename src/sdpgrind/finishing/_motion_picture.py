"""Picture of a motion: feed along the path, and how much of their limits the joints use."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.finishing._motion import Motion

FEW = 1500  # columns of pixels: more rows than that are drawn by their extremes


def plot(motion: "Motion") -> Any:
    """Draw a motion; return the figure."""
    plt = need("matplotlib.pyplot", "plot")
    figure = plt.figure(figsize=(11, 5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.1, 1))
    _draw_path(figure, figure.add_subplot(grid[:, 0], projection="3d"), motion)
    _draw_feed(figure.add_subplot(grid[0, 1]), motion)
    _draw_joints(figure.add_subplot(grid[1, 1]), motion)
    figure.suptitle(f"{motion.duration:.1f} s, {motion.length[-1]:.0f} mm, {motion.method}", fontsize=10)
    return figure


def _draw_path(figure: Any, axis: Any, motion: "Motion") -> None:
    """The path as the joints make it, coloured by its feed; a mark where a limit is nearest."""
    lines = need("mpl_toolkits.mplot3d.art3d", "plot")
    points, feed = motion.points, motion.feed
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    drawn = lines.Line3DCollection(pieces, cmap="viridis", linewidth=0.9)
    drawn.set_array((feed[:-1] + feed[1:]) / 2)
    axis.add_collection3d(drawn)
    low, high = points.min(axis=0), points.max(axis=0)
    axis.set(
        xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2] - 1e-3, high[2] + 1e-3), xlabel="x [mm]", ylabel="y [mm]"
    )
    axis.set_box_aspect(np.maximum(high - low, 0.15 * (high - low).max()))
    worst = motion.worst_violation
    place = points[int(np.argmin(np.abs(motion.time - worst.time)))]
    axis.scatter(*place, color="#b04a3a", s=30, label=f"{worst.quantity} {worst.joint}: {100 * worst.ratio:.1f} % of its limit")
    axis.legend(frameon=False, fontsize=8, loc="upper left")
    figure.colorbar(drawn, ax=axis, shrink=0.6, label="feed [mm/s]")


def _draw_feed(axis: Any, motion: "Motion") -> None:
    time, low, high = _extremes(motion.time, motion.feed)
    axis.fill_between(time, low, high, color="#4878a8", lw=0.6)
    axis.axhline(motion.problem.feed_rate, color="0.4", lw=0.8, ls="--")
    axis.axhline(motion.mean_feed, color="0.2", lw=0.8)
    axis.text(motion.duration, motion.mean_feed, f" mean {motion.mean_feed:.3g}", fontsize=8, va="bottom", ha="right")
    axis.set(ylabel="feed [mm/s]", xlim=(0, motion.duration), ylim=(0, 1.08 * motion.problem.feed_rate))


def _draw_joints(axis: Any, motion: "Motion") -> None:
    """Greatest share of its speed that each joint uses, over time."""
    arm = motion.problem.arm
    share = np.abs(motion.joint_speed) / np.array(arm.speed_max)
    for k, name in enumerate(arm.names):
        time, _, high = _extremes(motion.time, share[:, k])
        axis.plot(time, 100 * high, lw=0.9, label=name)
    axis.axhline(100, color="0.4", lw=0.8, ls="--")
    axis.set(ylabel="speed [% of the limit]", xlabel="time [s]", xlim=(0, motion.duration))
    axis.set_ylim(0, max(105.0, 105 * float(share.max())))
    axis.legend(frameon=False, fontsize=8, ncol=7, loc="upper center", handlelength=1)


def _extremes(time: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Least and greatest values in as many slices of time as a picture has columns."""
    if len(time) <= FEW:
        return time, values, values
    cuts = np.linspace(0, len(time) - 1, FEW).astype(int)[:-1]
    return time[cuts], np.minimum.reduceat(values, cuts), np.maximum.reduceat(values, cuts)
