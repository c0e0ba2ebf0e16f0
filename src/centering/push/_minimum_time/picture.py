"""Picture of a push of minimum time: speed of the tip, contact force and lead at every friction."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.push._contact.trace_picture import BLUE, GREY, RED
from sdpgrind.base import pictures
from sdpgrind.base.extras import need
from sdpgrind.base.units import MS

if TYPE_CHECKING:
    from centering.push._minimum_time.push import OptimalPush

_SAMPLES = 3001  # chosen: points of a curve; fewer show corners
_LIGHT, _DARK = "#9db9d6", "#1f3f66"


def plot_optimal(push: "OptimalPush") -> Any:
    """Draw a push; return the figure (private to this package)."""
    figure = pictures.figure(8.0, 6.4)
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=(1.6, 1.6, 1.0))
    colours = need("matplotlib.colors", "plot").LinearSegmentedColormap.from_list(
        "friction", [_LIGHT, BLUE, _DARK]
    )
    shades = [colours(share) for share in np.linspace(0.0, 1.0, len(push.traces))]
    _draw_speed(above, push, shades[-1])
    for trace, ratio, shade in zip(push.traces, push.friction, shades, strict=True):
        time = np.linspace(0.0, float(push.rest_time.max()), _SAMPLES)
        data = trace.at(time)
        label = f"friction x {ratio:.3g}"
        middle.plot(MS * time, data.contact_force, color=shade, lw=1.1, label=label)
        below.plot(MS * time, MS * (data.tip_position - data.part_position), color=shade, lw=1.1)
    _dress(push, above, middle, below)
    return figure


def _draw_speed(axis: Any, push: "OptimalPush", shade: Any) -> None:
    """Draw the speed of the tip, its limit, and the speed of the part at the greatest friction."""
    profile, trace = push.profile, push.traces[-1]
    edges = np.concatenate(((0.0,), np.cumsum(profile.duration)))
    ends = profile.velocity + profile.acceleration * profile.duration
    times = np.column_stack((edges[:-1], edges[1:])).ravel()
    axis.plot(
        MS * trace.time,
        trace.part_velocity,
        color=shade,
        lw=1.1,
        label=f"part, friction x {push.friction[-1]:.3g}",
    )
    axis.plot(MS * times, np.column_stack((profile.velocity, ends)).ravel(), color=RED, lw=1.4, label="tip")
    most = push.problem.limits.push_speed_max
    axis.axhline(most, color=GREY, lw=1.0, ls="--", label=f"greatest speed of the tip, {most:.4g} mm/s")


def _dress(push: "OptimalPush", above: Any, middle: Any, below: Any) -> None:
    """Add labels, limits and title."""
    errors, time = push.stop_error * MS, push.time
    found = {"NOT_FOUND": "none found, the gentle push: ", "NOT_CONFIRMED": "not confirmed: "}.get(
        push.status.name, ""
    )
    above.set_title(
        f"{found}{push.distance:g} mm in {MS * time:.1f} ms,"
        f" stops {errors.min():+.1f} to {errors.max():+.1f} µm from there",
        fontsize=10,
    )
    above.set_ylabel("speed [mm/s]")
    above.set_xlim(0.0, MS * time)
    above.set_ylim(bottom=0.0)
    middle.set_ylabel("contact force [N]")
    middle.set_ylim(bottom=0.0)
    below.set(xlabel="time since first touch [ms]", ylabel="tip beyond\npart [µm]")
    pictures.legend(above, loc="lower center")
    pictures.legend(middle, loc="upper right")
