"""Picture of a profile magnified about its circle, and of its spectrum."""

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from centering.roundness._profile_steps import limits
from centering.roundness._turn import told_radius
from sdpgrind.base import pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from centering.roundness._profile import Profile


_MARK: dict[str, Any] = {"color": pictures.LIMIT, "markersize": 5, "clip_on": False}
_LEAST = 0.005  # chosen: amplitude over the largest that is still visible; it ends the axis


def plot(profile: "Profile") -> Any:
    """Draw a profile and its spectrum; return the figure."""
    figure = pictures.figure(11, 5.2)
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.25))
    _draw_form(figure.add_subplot(grid[0], projection="polar"), profile)
    _draw_spectrum(figure.add_subplot(grid[1]), profile)
    figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, 0.95))  # room for the labels of the polar picture
    circle = profile.circle
    height = f"{_height(profile)}, {profile._origin.filter or 'not filtered'}"
    figure.suptitle(
        f"{height}; {told_radius(profile.radius, 6)}, {circle.offset:.3g} mm off the spindle", fontsize=10
    )
    return figure


def _height(profile: "Profile") -> str:
    """Roundness about the least-squares circle, or peak to valley where an arc is too short for one."""
    try:
        return f"RONt (LSC) {1e3 * profile.roundness('LSC').value:.3g} µm"
    except ValueError:
        return f"{1e3 * float(np.ptp(profile.deviation)):.3g} µm from peak to valley of an arc"


def _draw_form(axis: Any, profile: "Profile") -> None:
    """Draw the deviation and the least-squares circle."""
    deviation = profile.deviation
    scale = polar_scale(deviation)
    polar_axes(scale, deviation, axis)
    draw_circle(axis, scale, color=pictures.LIMIT, linewidth=0.9, linestyle="--")
    draw_profile(axis, scale, profile.part_angle, deviation, color="#1d3557")
    _draw_removed(axis, profile)


def _draw_removed(axis: Any, profile: "Profile") -> None:
    """Mark the asperities that were taken out at the rim, where the greatest of them would be far outside."""
    removed = profile.removed
    if len(removed):
        told = (
            f"{counted(len(removed), 'reading')} taken out, up to {UM * np.abs(removed[:, 1]).max():.3g} µm"
        )
        axis.plot(removed[:, 0], np.full(len(removed), axis.get_rmax()), "v", **_MARK, label=told)
        pictures.legend(axis, loc="lower left", bbox_to_anchor=(-0.25, -0.12))


def _draw_spectrum(axis: Any, profile: "Profile") -> None:
    """Draw the spectrum, its limits as a title, and the removed runout."""
    limit = limits(profile)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the title holds the warning
            found = profile.harmonics()
            found.plot(axis)
            axis.set_xlim(
                0,
                1.1
                * max(found.upr[found.amplitude >= _LEAST * found.amplitude.max(initial=0.0)], default=1.0),
            )
    except ValueError:
        axis.set_axis_off()
        limit = limit.replace("0 upr", "no upr").partition(":")[0]
    axis.set_title(limit, fontsize=8)
    lost = profile.roller_error
    if lost is not None and lost.seen:
        axis.axvline(lost.ratio, color=pictures.LIMIT, linewidth=0.8, linestyle=":")
        removed = f"roller runout removed: {1e3 * lost.amplitude:.3g} µm at {lost.ratio:.4g} upr"
        axis.text(
            0.99,
            0.97,
            removed,
            transform=axis.transAxes,
            ha="right",
            va="top",
            fontsize=8,
            color=pictures.LIMIT,
        )
