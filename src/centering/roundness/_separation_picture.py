"""Picture of a separation: part, spindle, singular values."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from centering.roundness._setups import LOST
from centering.roundness._spindle_error import told_lost
from sdpgrind.base import pictures
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from centering.roundness._separation import Separation

_SHOWN = 100  # chosen: upr; beyond, singular values repeat


def plot(found: "Separation") -> Any:
    """Draw a separation; return the figure."""
    figure = pictures.figure(9, 7.5)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.8, 1))
    _draw_part(figure.add_subplot(grid[0, 0], projection="polar"), found)
    found.spindle.plot(figure.add_subplot(grid[0, 1], projection="polar"))
    _draw_singular(figure.add_subplot(grid[1, :]), found)
    return figure


def _draw_part(axis: Any, found: "Separation") -> None:
    deviation = found.part.deviation
    scale = polar_scale(deviation)
    polar_axes(scale, deviation, axis)
    draw_circle(axis, scale, color=pictures.LIMIT, linewidth=0.9, linestyle="--")
    draw_profile(axis, scale, found.part.part_angle, deviation, color="#1d3557")
    axis.set_title(f"part: {UM * float(np.ptp(deviation)):.3g} µm from peak to valley", fontsize=9)


def _draw_singular(axis: Any, found: "Separation") -> None:
    """Draw the smallest singular values, and the level below which a harmonic is lost."""
    shown = found.upr <= _SHOWN
    axis.vlines(found.upr[shown], 0, found.singular[shown], color=pictures.ACTUAL, lw=1.4)
    lost = found.lost[found.lost <= _SHOWN]
    axis.plot(lost, np.zeros(lost.size), "x", color=pictures.LIMIT, clip_on=False)
    axis.axhline(LOST, color=pictures.LIMIT, linestyle="--", linewidth=0.9)
    axis.set(xlabel=pictures.label("undulations per revolution", "upr"), ylabel="smallest singular value")
    axis.set_title(told_lost(found.lost), fontsize=9)
    pictures.opened([axis], grid=False)
