"""Pictures of pushes: tip and part, their contact force against both friction forces, modes as background."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.circle._fit.picture import told_length
from sdpgrind.base import pictures, units
from sdpgrind.base.extras import need
from sdpgrind.base.units import MS

if TYPE_CHECKING:
    from centering.push._contact.trace import PushTrace
    from centering.push._profile.profile import TipProfile

BLUE, RED, GREY = pictures.ACTUAL, pictures.LIMIT, "0.35"
_SHADES = {"rest": "#f2f2f2", "stick": "#cfcfcf", "slip": "#dbe7f3", "free": "#f8e3c4"}
_TOLD = {
    "rest": "at rest, apart",
    "stick": "at rest, touching (stick)",
    "slip": "moving, touching (slip)",
    "free": "moving, no contact (free)",
}
_FINE = 801  # chosen: points of a curve; fewer show corners


def plot_trace(trace: "PushTrace") -> Any:
    """Draw a push; return the figure (private to this package)."""
    figure = pictures.figure(8.0, 6.4)
    axes = figure.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.1, 2.0))
    for axis in axes:
        _shade(axis, trace)
        axis.margins(x=0.0)
    _draw_positions(axes[0], trace)
    _draw_lead(axes[1], trace)
    _draw_force(axes[2], trace)
    axes[0].set_title(_title(trace), fontsize=10)
    axes[2].set_xlabel("time [ms]")
    _legend_of_modes(figure, trace)
    return figure


def _title(trace: "PushTrace") -> str:
    ends = trace._rests if trace.final_velocity == 0.0 else "is still moving at"
    slide = f", slides free by {told_length(trace.free_slide)}" if trace.free_slide >= units.um(0.05) else ""
    return f"the part {ends} {trace.final_position:.4f} mm, force up to {trace.peak_force:.1f} N{slide}"


def _shade(axis: Any, trace: "PushTrace") -> None:
    """Shade the modes behind the curves."""
    ends = MS * trace.phases[:, 0]
    for begin, end, mode in zip(ends[:-1], ends[1:], trace.event_mode, strict=True):
        axis.axvspan(begin, end, color=_SHADES[mode], lw=0.0, zorder=0)


def _draw_positions(axis: Any, trace: "PushTrace") -> None:
    time = MS * trace.time
    axis.plot(time, trace.tip_position, color=RED, lw=1.2, label="tip")
    axis.plot(time, trace.part_position, color=BLUE, lw=1.2, label="part")
    axis.set_ylabel("position [mm]")
    pictures.legend(axis, loc="best")


def _draw_lead(axis: Any, trace: "PushTrace") -> None:
    """Lead of the part over the tip, which two long curves hide."""
    lead = (trace.part_position - trace.tip_position) / units.um(1.0)
    axis.plot(MS * trace.time, lead, color=BLUE, lw=1.0)
    axis.axhline(0.0, color=RED, lw=0.8)
    phase = np.searchsorted(trace.event_time, trace.time, side="right") - 1
    near = lead[trace.phases[phase, 1] > 0.0]  # not where the tip is far from a part at rest
    if near.size:
        spare = 0.1 * max(float(np.ptp(near)), 1.0)
        axis.set_ylim(min(near.min(), 0.0) - spare, max(near.max(), 0.0) + spare)
    axis.set_ylabel("part ahead\nof tip [µm]")


def _draw_force(axis: Any, trace: "PushTrace") -> None:
    static, coulomb = trace.parameters[3:5]
    axis.plot(MS * trace.time, trace.contact_force, color=BLUE, lw=1.0)
    for level, name, style in (
        (static, "breaks away at $F_s$", "--"),
        (coulomb, "slides against $F_k$", ":"),
    ):
        axis.axhline(level, color=GREY, lw=1.0, ls=style, label=f"{name} = {level:.1f} N")
    axis.set_ylabel("contact force [N]")
    axis.set_ylim(0.0, 1.3 * max(float(trace.contact_force.max()), float(static)))
    pictures.legend(axis, loc="upper right", ncols=2)


def _legend_of_modes(figure: Any, trace: "PushTrace") -> None:
    """Draw one patch for each mode that occurs."""
    patch = need("matplotlib.patches", "plot").Patch
    lasts = np.diff(trace.phases[:, 0]) > 0.0  # a part may rest for no time at all
    seen = [mode for mode in _SHADES if mode in np.array(trace.event_mode)[lasts]]
    handles = [patch(color=_SHADES[mode], label=_TOLD[mode]) for mode in seen]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8)


def plot_profile(profile: "TipProfile") -> Any:
    """Draw position and speed of a tip; return the figure (private to this package)."""
    figure = pictures.figure(7.0, 4.6)
    above, below = figure.subplots(2, 1, sharex=True)
    edges = np.concatenate(((0.0,), np.cumsum(profile.duration)))
    time = np.unique(np.concatenate((np.linspace(0.0, edges[-1], _FINE), edges)))
    above.plot(MS * time, profile.position(time), color=RED, lw=1.2)
    above.axhline(0.0, color=GREY, lw=0.8, ls=":", label="first touch")
    above.set(
        ylabel="tip position [mm]", title=f"{profile.stroke:.4g} mm in {MS * profile.total_time:.4g} ms"
    )
    pictures.legend(above)
    _draw_speed(below, profile, edges)
    return figure


def _draw_speed(axis: Any, profile: "TipProfile", edges: Any) -> None:
    """Draw the speed with its jumps."""
    ends = profile.velocity + profile.acceleration * profile.duration
    times = np.column_stack((edges[:-1], edges[1:])).ravel()
    axis.plot(MS * times, np.column_stack((profile.velocity, ends)).ravel(), color=BLUE, lw=1.2)
    axis.axhline(0.0, color=GREY, lw=0.8, ls=":")
    axis.set(xlabel="time [ms]", ylabel="tip speed [mm/s]")
