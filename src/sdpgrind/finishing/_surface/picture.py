"""A surface in three dimensions."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.finishing._surface.surface import Surface

FINE = 60
"""Facets each way."""
COLOUR, LINES = "#9db8d2", "#31527a"


def surface(shape: "Surface", ax: Any = None) -> Any:
    """Draw the surface, shaded, with its knot lines; x, y and z to one scale."""
    figure, axes = _axes(ax)
    (u0, u1), (v0, v1) = shape.domain
    x, y, z = np.moveaxis(shape.grid(np.linspace(u0, u1, FINE + 1), np.linspace(v0, v1, FINE + 1)).point, -1, 0)
    axes.plot_surface(x, y, z, color=COLOUR, rcount=FINE, ccount=FINE, linewidth=0, antialiased=False, alpha=0.9)
    for line in knot_lines(shape):
        axes.plot(*line.T, color=LINES, lw=0.8)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_box_aspect(_box(x, y, z))
    return figure


def knot_lines(shape: "Surface") -> list[checks.Floats]:
    """Lines (m, 3) over the surface at its knots, ends of the domain among them."""
    (u0, u1), (v0, v1) = shape.domain
    at_u, at_v = (np.unique(np.clip(k, *ends)) for k, ends in zip(shape.knots, shape.domain, strict=True))
    along_v = shape.grid(at_u, np.linspace(v0, v1, FINE + 1)).point
    along_u = shape.grid(np.linspace(u0, u1, FINE + 1), at_v).point
    return [*along_v, *along_u.swapaxes(0, 1)]


def _axes(ax: Any) -> tuple[Any, Any]:
    """Figure and axes to draw in."""
    if ax is None:
        figure = need("matplotlib.pyplot", "plot").figure(figsize=(7, 5), layout="constrained")
        return figure, figure.add_subplot(projection="3d")
    if not hasattr(ax, "plot_surface"):
        raise TypeError(f"ax must be 3-D axes of matplotlib, as add_subplot(projection='3d') gives; got {checks.shown(ax)}")
    return ax.figure, ax


def _box(*columns: checks.Floats) -> list[float]:
    """Widths of the drawn box, those of the surface; none so thin that nobody sees it."""
    widths = np.array([np.ptp(column) for column in columns])
    return [float(width) for width in np.maximum(widths, 0.05 * widths.max())]
