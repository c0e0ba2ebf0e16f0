"""Picture of a surface in three dimensions."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.finishing.surface._surface import Surface

FINE = 60  # chosen: facets each way
COLOUR, LINES = "#b4cbe0", pictures.TRACKED
THICK = 0.08  # chosen: least width of the drawn box over its greatest, so that a flat surface is visible
TICKS = 5  # chosen: ticks along the longest side of the box


def surface(shape: "Surface", ax: Any = None) -> Any:
    """Draw the surface, shaded, with its knot lines, seen from the tool's side; x, y and z to one scale."""
    figure, axes = _axes(ax)
    (u0, u1), (v0, v1) = shape.domain
    found = shape.grid(np.linspace(u0, u1, FINE + 1), np.linspace(v0, v1, FINE + 1))
    azimuth, height = _side(shape.outward * np.cross(found.u, found.v).reshape(-1, 3))
    light = need("matplotlib.colors", "plot").LightSource(
        azdeg=30.0 - azimuth, altdeg=np.copysign(55.0, height)
    )
    axes.computed_zorder = False  # lines lie on the surface: rounding would hide them
    # light falls on the outside
    x, y, z = np.moveaxis(found.point if shape.outward < 0 else found.point.swapaxes(0, 1), -1, 0)
    axes.plot_surface(
        x, y, z, color=COLOUR, rcount=FINE, ccount=FINE, linewidth=0, antialiased=False, lightsource=light
    )
    for line in knot_lines(shape):
        axes.plot(*line.T, color=LINES, lw=0.7, zorder=1.5)
    axes.view_init(elev=height, azim=azimuth)
    _scaled(axes, found.point.reshape(-1, 3))
    return figure


def knot_lines(shape: "Surface") -> list[checks.Floats]:
    """Lines (m, 3) over the surface at its knots and the ends of the domain."""
    (u0, u1), (v0, v1) = shape.domain
    at_u, at_v = shape.breaks
    along_v = shape.grid(at_u, np.linspace(v0, v1, FINE + 1)).point
    along_u = shape.grid(np.linspace(u0, u1, FINE + 1), at_v).point
    return [*along_v, *along_u.swapaxes(0, 1)]


def _axes(ax: Any) -> tuple[Any, Any]:
    """Return figure and axes to draw in."""
    if ax is None:
        figure = pictures.figure(7, 5)
        return figure, figure.add_subplot(projection="3d")
    if not hasattr(ax, "plot_surface"):
        raise TypeError(
            "ax must be 3-D axes of matplotlib, as add_subplot(projection='3d') gives;"
            f" got {checks.shown(ax)}"
        )
    return ax.figure, ax


def _side(normals: checks.Floats) -> tuple[float, float]:
    """Azimuth and height (degrees) of the eye, near the surface's mean normal, where it has one."""
    x, y, z = normals.sum(axis=0) / np.linalg.norm(normals, axis=1).sum()
    if np.hypot(x, y) < max(0.1, 0.75 * abs(z)):
        return -60.0, 35.0 if z > -0.1 else -35.0
    return float(np.degrees(np.arctan2(y, x))) - 20.0, float(np.clip(np.degrees(np.arcsin(z)), -50.0, 50.0))


def _scaled(axes: Any, points: checks.Floats) -> None:
    """Set the box to the widths of the surface, with room for the ticks of each axis."""
    middle, widths = 0.5 * (points.max(axis=0) + points.min(axis=0)), np.ptp(points, axis=0)
    shown = np.maximum(widths, THICK * widths.max())
    for name, centre, width in zip("xyz", middle, shown, strict=True):
        axes.set(
            **{f"{name}lim": (centre - 0.5 * width, centre + 0.5 * width), f"{name}label": f"{name} [mm]"}
        )
        axes.locator_params(axis=name, nbins=max(1, round(TICKS * width / shown.max())))
    axes.set_box_aspect([float(width) for width in shown])
