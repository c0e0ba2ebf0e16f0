"""Picture of a reference circle: the profile magnified, circles, contacts."""

from typing import Any

import numpy as np

from centering.roundness._deviations_about import KINDS, DeviationsAbout
from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from sdpgrind.base import units


def plot(circle: DeviationsAbout, ax: Any = None) -> Any:
    """Draw the profile magnified about the circle's centre, with circles and contacts; return the figure."""
    scale, angle = polar_scale(circle.deviation), circle.angle
    ax = polar_axes(scale, circle.deviation, ax)
    draw_profile(ax, scale, angle, circle.deviation, color="C0")
    if circle.kind in ("LSC", "MCC", "MIC"):
        draw_circle(ax, scale, color="C3", label=KINDS[circle.kind])
    if circle.kind != "MCC":
        draw_circle(ax, scale, circle._sides[0], color="C3" if circle.kind == "MZC" else "0.4")
    if circle.kind != "MIC":
        draw_circle(
            ax, scale, circle._sides[1], color="C3" if circle.kind == "MZC" else "0.4", linestyle="--"
        )
    _mark(circle, ax, scale)
    filtered = f", {circle.filter}" if circle.filter else ""
    ax.set_title(f"{circle.kind}: RONt {circle.value / units.um(1.0):.4g} µm{filtered}")
    return ax.figure


def _mark(circle: DeviationsAbout, ax: Any, scale: Any) -> None:
    """Mark the contacts, or the highest and lowest point of LSC."""
    marked = zip(circle.contacts, circle.outer, strict=True)
    pairs = list(marked) or [
        (int(np.argmax(circle.deviation)), True),
        (int(np.argmin(circle.deviation)), False),
    ]
    for point, outer in pairs:
        symbol = "o" if circle.contacts.size else ("v" if outer else "^")
        style = {
            "color": "C3",
            "markerfacecolor": "C3" if outer else "white",
            "markersize": 5,
            "zorder": 4,
        }
        ax.plot(circle.angle[point], scale.height(circle.deviation[point]), symbol, **style)
