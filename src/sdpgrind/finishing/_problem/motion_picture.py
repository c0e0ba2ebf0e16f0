"""Picture of a motion: feed along the path, and the joints' shares of their limits."""

from collections.abc import Sequence
from itertools import cycle, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing.path._picture import work
from sdpgrind.finishing.surface._picture import fill

if TYPE_CHECKING:
    from sdpgrind.finishing._problem.motion import Motion

# chosen: time slices drawn by their extremes, one a column of pixels; few where lines stay apart
MANY, FEW = 1500, 150
PIECES = 3000  # chosen: line pieces of the path; more are not visible
CLOSE = 1.0  # s, chosen: shows single corners around the place nearest to a limit
TURNING = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")
SLIDING = ("black", "0.55", "0.35", "0.75")  # table: dark


def plot(motion: "Motion") -> Any:
    """Draw a motion; return the figure."""
    drawn = [_draw_feed, _draw_close, *((_draw_spin,) if "spin" in motion.posture.free else ()), _draw_joints]
    figure = pictures.figure(12, 5 * len(drawn) / 3)
    grid = figure.add_gridspec(len(drawn), 2, width_ratios=(1.2, 1))
    above = figure.add_subplot(grid[:, 0], projection="3d", computed_zorder=False)
    _draw_path(figure, above, motion)
    for row, draw in enumerate(drawn):
        draw(figure.add_subplot(grid[row, 1]), motion)
    figure.suptitle(f"{motion.length[-1]:.0f} mm in {motion.duration:.1f} s, {motion.method}", fontsize=10)
    fill(above)
    return figure


def _draw_path(figure: Any, axis: Any, motion: "Motion") -> None:
    """Draw the path by the joints on its surface, coloured by feed, with a mark where a limit is nearest."""
    lines = need("mpl_toolkits.mplot3d.art3d", "plot")
    work(motion.problem.path, axis, motion.points)
    points, kept, worst = motion.points, _apart(motion), motion.worst_violation
    pieces = np.stack([points[kept[:-1]], points[kept[1:]]], axis=1)
    drawn = lines.Line3DCollection(pieces, cmap="plasma", linewidth=1.3, capstyle="round", zorder=3)
    drawn.set_array([motion.feed_rate[a : b + 1].max() for a, b in pairwise(kept)])
    axis.add_collection3d(drawn)
    place = points[int(np.argmin(np.abs(motion.time - worst.time)))]
    told = f"{worst.quantity} {worst.joint}".strip()
    axis.scatter(
        *place, color="black", s=25, zorder=4, label=f"{told}: {100 * worst.ratio:.1f} % of its limit"
    )
    pictures.legend(axis, loc="upper left")
    figure.colorbar(drawn, ax=axis, shrink=0.6, pad=0.08, label="feed [mm/s]")


def _apart(motion: "Motion") -> Any:
    """Rows, one for each of `PIECES` slices of the length, with all corners."""
    slices = np.floor(motion.length / motion.length[-1] * PIECES)
    corners = np.flatnonzero(np.diff(motion.time) == 0)
    return np.unique(np.concatenate([[0], np.flatnonzero(np.diff(slices)) + 1, corners, [len(slices) - 1]]))


def _draw_feed(axis: Any, motion: "Motion") -> None:
    """Draw the feed over the whole time as a band between extremes, as there may be a thousand corners."""
    time, low, high = _extremes(motion.time, motion.feed_rate, MANY)
    axis.fill_between(time, low, high, color=pictures.ACTUAL, lw=0.4)
    axis.axhline(motion.problem.feed_rate, color="0.4", lw=0.8, ls="--")
    axis.axhline(motion.mean_feed_rate, color="0.1", lw=0.8)
    axis.set(ylabel="feed [mm/s]", xlim=(0, motion.duration), ylim=(0, _highest(motion)))
    axis.set_title(f"mean {motion.mean_feed_rate:.3g} of {motion.problem.feed_rate:.3g} mm/s", fontsize=8)


def _draw_close(axis: Any, motion: "Motion") -> None:
    """Draw the feed near the place where a limit is nearest."""
    worst = motion.worst_violation
    first = float(np.clip(worst.time - CLOSE / 2, 0.0, max(0.0, motion.duration - CLOSE)))
    near = (motion.time >= first) & (motion.time <= first + CLOSE)
    axis.plot(motion.time[near], motion.feed_rate[near], color=pictures.ACTUAL, lw=1)
    axis.axvline(worst.time, color=pictures.LIMIT, lw=0.8)
    axis.set(
        ylabel="feed [mm/s]",
        xlim=(first, min(first + CLOSE, motion.duration)),
        ylim=(0, _highest(motion)),
    )


def _highest(motion: "Motion") -> float:
    """Upper end of axes of feed, mm/s, above that in the air, too."""
    return 1.08 * max(motion.problem.feed_rate, float(motion.feed_rate.max()))


def _draw_spin(axis: Any, motion: "Motion") -> None:
    """Draw the turn of the tool about its own axis over time."""
    axis.plot(motion.time, motion.spin, color=pictures.ACTUAL, lw=1)
    axis.set(ylabel="turn of tool [rad]", xlim=(0, motion.duration))


def _draw_joints(axis: Any, motion: "Motion") -> None:
    """Draw each joint's share of its speed or acceleration limit, the greater one, over time."""
    robot, step = motion.problem.robot, np.diff(motion.time)
    lasting = step > 0
    pushed = (
        np.diff(motion.joint_speed, axis=0)[lasting]
        / step[lasting, np.newaxis]
        / np.array(robot.acceleration_max)
    )
    share = np.maximum(np.abs(motion.joint_speed[:-1][lasting]) / np.array(robot.speed_max), np.abs(pushed))
    for k, (name, colour) in enumerate(zip(robot.names, _colours(robot.units), strict=True)):
        time, _, high = _extremes(motion.time[:-1][lasting], share[:, k], FEW)
        axis.plot(time, 100 * high, lw=0.9, label=name, color=colour)
    axis.axhline(100, color="0.4", lw=0.8, ls="--")
    axis.set(ylabel="used of limits [%]", xlabel="time [s]", xlim=(0, motion.duration))
    axis.set_ylim(-5, max(130.0, 115 * float(share.max())))  # joints at rest lie above the frame
    pictures.legend(axis, ncol=len(robot.names), loc="upper center", handlelength=1)


def _colours(units: Sequence[str]) -> list[str]:
    """Colours of joints: bright for those that turn, dark for those that slide."""
    turning, sliding = cycle(TURNING), cycle(SLIDING)
    return [next(turning if unit == "rad" else sliding) for unit in units]


def _extremes(time: Floats, values: Floats, slices: int) -> tuple[Floats, Floats, Floats]:
    """Least and greatest values in slices of time."""
    if len(time) <= slices:
        return time, values, values
    cuts = np.linspace(0, len(time) - 1, slices).astype(int)[:-1]
    return time[cuts], np.minimum.reduceat(values, cuts), np.maximum.reduceat(values, cuts)
