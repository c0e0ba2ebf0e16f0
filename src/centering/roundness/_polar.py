"""Polar pictures as on roundness instruments: magnified deviation, scale in µm per division."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import pictures, units
from sdpgrind.base.checks import Floats

_DIVISIONS = 6  # chosen: divisions of the profile's height, and again from its lowest point to the middle
_BREAK = 8.0  # chosen: step over the median step that is a gap in the drawn line


class Scale(NamedTuple):
    """Scale of deviations: radius of the circle and distance of two rings, both µm."""

    base: float
    division: float

    def height(self, deviation: Any) -> Any:
        """Distance from the middle of the picture, µm, of a deviation (mm)."""
        return self.base + np.asarray(deviation) / units.um(1.0)


def polar_scale(deviation: Floats) -> Scale:
    """Scale for deviations (mm): division of 1, 2 or 5 times a power of ten, lowest point off the middle."""
    low, high = (float(end) / units.um(1.0) for end in (deviation.min(), deviation.max()))
    least = max((high - low) / _DIVISIONS, 1e-6)  # µm: flatter than a picometre is rounding
    ten = 10.0 ** np.floor(np.log10(least))
    division = next(step * ten for step in (1.0, 2.0, 5.0, 10.0) if step * ten >= least * (1 - 1e-9))
    return Scale(division * (np.ceil(-low / division) + _DIVISIONS), division)


def polar_axes(scale: Scale, deviation: Floats, ax: Any = None) -> Any:
    """Polar axes with the rings of a scale that contain deviations (mm): `ax`, or those of a new figure."""
    if ax is None:
        ax = pictures.figure(5.6, 5.6).add_subplot(projection="polar")
    top = scale.division * np.ceil(float(np.max(scale.height(deviation))) / scale.division + 0.5)
    ax.set_rlim(0.0, top)
    ax.set_rticks(np.arange(scale.division, top, scale.division), labels=[])
    ax.set_thetagrids(np.arange(0, 360, 30))
    ax.grid(linewidth=0.4, alpha=0.6)
    ax.text(1.0, -0.04, f"{scale.division:g} µm/div", transform=ax.transAxes, ha="right", va="top")
    return ax


def draw_profile(ax: Any, scale: Scale, angle: Floats, deviation: Floats, **style: Any) -> Any:
    """Draw deviations (mm) over their directions (rad) as a closed line, interrupted at gaps."""
    across, up = _line(np.asarray(angle, dtype=float), np.asarray(deviation, dtype=float))
    return ax.plot(across, scale.height(up), **{"linewidth": 0.8} | style)


def draw_circle(ax: Any, scale: Scale, deviation: float = 0.0, **style: Any) -> Any:
    """Draw a concentric circle at a deviation (mm)."""
    turn = np.linspace(0.0, 2 * np.pi, 361)
    return ax.plot(turn, np.full(turn.size, scale.height(deviation)), **{"linewidth": 1.0} | style)


def _line(angle: Floats, deviation: Floats) -> tuple[Floats, Floats]:
    """Closed line through the points in order, with NaN at gaps."""
    step = np.mod(np.diff(angle, append=angle[0]) + np.pi, 2 * np.pi) - np.pi
    far = np.abs(step) > max(_BREAK * float(np.median(np.abs(step))), 1e-9)
    places = np.flatnonzero(far) + 1
    line, heights = np.append(angle, angle[0]), np.append(deviation, deviation[0])
    return np.insert(line, places, np.nan), np.insert(heights, places, np.nan)
