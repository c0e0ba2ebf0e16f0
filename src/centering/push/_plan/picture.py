"""Picture of a planned push: tip and rim until they meet, phases of the slide as background."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.push._contact.trace_picture import BLUE, GREY, RED
from sdpgrind.base import pictures, units
from sdpgrind.base.units import MS

if TYPE_CHECKING:
    from centering.push._plan.push import Push

_FINE = 801  # chosen: points of a curve; fewer show corners
_ROOM = 0.03  # chosen: margin below the curves, share of the height; without it the line at 0 is hidden
_SHADES = {"approach": "#f2f2f2", "pause": "#cfcfcf", "run-up": "#dbe7f3", "push": "#f8e3c4"}


def plot(push: "Push", ax: Any = None) -> Any:
    """Draw a push on axes, by default of a new figure; return the figure."""
    axis = pictures.axes_of(7.5, 4.4) if ax is None else ax
    draw_push(push, axis)
    return axis.figure


def draw_push(push: "Push", axis: Any) -> None:
    """Draw a push (private to this package)."""
    touched = _shade(push, axis)
    time = np.linspace(0.0, push.profile.total_time, _FINE)
    axis.plot(MS * time, _rim(push, touched) - push.profile.position(time), color=RED, lw=1.4, label="tip")
    before = np.append(time[time < touched], touched)
    axis.plot(MS * before, _rim(push, before), color=BLUE, lw=1.4, label="rim, until it is touched")
    axis.plot(MS * touched, _rim(push, touched), "o", color=BLUE, ms=5.0, label="first touch")
    axis.axhline(0.0, color=GREY, lw=0.8, ls=":", label="rim of a ring on the axis")
    axis.set(xlabel="time since the trigger [ms]", ylabel="place on the push line [mm]")
    axis.set_title(_title(push), fontsize=10)
    axis.margins(x=0.0)
    axis.set_ylim(axis.get_ylim()[0] - _ROOM * float(np.ptp(axis.get_ylim())))
    axis.figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)


def _title(push: "Push") -> str:
    lead, speed = push.lead_angle / units.deg(1.0), push.spindle_speed / units.rpm(1.0)
    return (
        f"{push.offset:.4g} mm off the axis at {speed:.4g} rpm: begin {lead:.2f}° before it is on the push"
        f" line, stroke {push.stroke:.4f} mm"
    )


def _shade(push: "Push", axis: Any) -> float:
    """Shade the phases of the slide; return the time of first touch, s."""
    touched = push.profile.total_time - push.touch.push_profile.total_time
    starts = touched - push.touch.run_up_time
    rests = max(starts - push.problem.limits.settle_time, 0.0)
    ends = [0.0, rests, starts, touched, push.profile.total_time]
    for (name, shade), begin, end in zip(_SHADES.items(), ends[:-1], ends[1:], strict=True):
        if end > begin:
            axis.axvspan(MS * begin, MS * end, color=shade, lw=0.0, zorder=0, label=name)
    return float(touched)


def _rim(push: "Push", time: Any) -> Any:
    """Position of the offset ring's rim on the push line, mm beyond that of a ring on the axis."""
    angle, r = push.spindle_speed * time - push.lead_angle, push.problem.model.part.radius
    across = push.offset * np.sin(angle)
    return push.offset * np.cos(angle) - across**2 / (r + np.sqrt(r * r - across**2))
