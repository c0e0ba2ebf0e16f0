"""Picture of a surface in three dimensions."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.finishing.surface._patch import Patch
    from sdpgrind.finishing.surface._surface import Surface

FINE = 60  # chosen: facets each way
COLOUR, LINES, TRIMMED = "#b4cbe0", pictures.TRACKED, pictures.LIMIT
THICK = 0.08  # chosen: least width of the drawn box over its greatest, so that a flat surface is visible
ROOM = 0.76  # chosen: share of the panel that the box fills; ticks and labels need the rest
AREA, BAR = 29.0, 1.2  # square inches, inches; chosen: some 7 by 4, and a bar of colours with its label
TICKS = 5  # chosen: ticks along the longest side of the box


def surface(shape: "Surface", ax: Any = None, within: Any = None) -> Any:
    """Draw the surface, shaded, with its knot lines, seen from the tool's side; x, y and z to one scale.

    `within` tells of places (u, v) whether they are left by a trimming: facets elsewhere are clear.
    """
    figure, axes = _axes(ax)
    at_u, at_v = (np.linspace(low, high, FINE + 1) for low, high in shape.domain)
    found = shape.grid(at_u, at_v)
    azimuth, height = _side(shape.outward * np.cross(found.u, found.v).reshape(-1, 3))
    light = need("matplotlib.colors", "plot").LightSource(
        azdeg=30.0 - azimuth, altdeg=np.copysign(55.0, height)
    )
    axes.computed_zorder = False  # lines lie on the surface: rounding would hide them
    # light falls on the outside
    x, y, z = np.moveaxis(found.point if shape.outward < 0 else found.point.swapaxes(0, 1), -1, 0)
    colour: dict[str, Any] = {"color": COLOUR}
    if within is not None:
        left = within(
            *np.meshgrid(at_u[:-1] + 0.5 * np.diff(at_u), at_v[:-1] + 0.5 * np.diff(at_v), indexing="ij")
        )
        colour = {"facecolors": _facets(left if shape.outward < 0 else left.T)}
    axes.plot_surface(
        x, y, z, rcount=FINE, ccount=FINE, linewidth=0, antialiased=False, lightsource=light, **colour
    )
    for line in knot_lines(shape):
        axes.plot(*line.T, color=LINES, lw=0.7, zorder=1.5)
    axes.view_init(elev=height, azim=azimuth)
    _scaled(axes, found.point.reshape(-1, 3))
    if ax is None:
        fill(axes, alone=True)
    return figure


def patch(trimmed: "Patch", ax: Any = None) -> Any:
    """Draw the surface of a patch and its trimming polygons."""
    figure = surface(trimmed.surface, ax, trimmed.contains if trimmed.trim else None)
    axes = figure.axes[-1] if ax is None else ax
    for corners in trimmed.polygons:
        line = trimmed.surface.point(*_along(corners).T)
        axes.plot(*line.T, color=TRIMMED, lw=1.5, zorder=2.0)
    return figure


def _along(corners: checks.Floats) -> checks.Floats:
    """Places (n, 2) of parameters along the sides of a polygon (m, 2): on the surface its sides are bent."""
    sides = len(corners) - 1
    at = np.linspace(0.0, sides, sides * -(-4 * FINE // sides) + 1)
    return np.stack([np.interp(at, np.arange(sides + 1), each) for each in corners.T], axis=1)


def patches(trimmed: Sequence["Patch"], ax: Any, points: checks.Floats) -> Any:
    """Draw several patches in one box with points (m, 3), seen from the tool's side of the largest one."""
    figure, axes = _axes(ax)
    limits, views = [], []
    for each in trimmed:
        patch(each, axes)
        limits.append(_limits(axes))
        views.append((axes.elev, axes.azim))
    low, high = np.moveaxis(np.array(limits), -1, 0)
    _scaled(axes, np.concatenate([low, high, points]))
    height, azimuth = views[int(np.argmax([each.area for each in trimmed]))]
    axes.view_init(elev=height, azim=azimuth)
    return figure


def _facets(left: Any) -> checks.Floats:
    """Colours of facets (n, m, 4); those that are not `left` are clear."""
    colours = np.tile(need("matplotlib.colors", "plot").to_rgba(COLOUR), (*left.shape, 1))
    colours[..., 3] = left
    return np.asarray(colours)


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
        figure = pictures.figure(7, 4.2)
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


def fill(axes: Any, *, alone: bool = False) -> None:
    """Zoom so that the box fills the panel of the axes; matplotlib keeps it within a square.

    A figure with these axes alone, and perhaps a bar of colours, gets the shape of the box.
    """
    figure = axes.figure
    if alone:
        box = _box(axes)  # its proportions are the same in any panel
        width, height = np.sqrt(AREA / box.prod()) * box
        figure.set_size_inches(width + BAR * (len(figure.axes) - 1), height)
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    box = _box(axes)
    panel = axes.get_position(original=True).size * figure.bbox.size
    widths = [float(np.ptp(each)) for each in _limits(axes)]
    axes.set_box_aspect(widths, zoom=float(np.min(ROOM * panel / box)))
    for drawn in (*axes.collections, *axes.lines):
        drawn.set_clip_on(False)  # it would be cut at that square
    figure.set_layout_engine("none")  # it would make the panel smaller for the larger box


def _box(axes: Any) -> checks.Floats:
    """Width and height of the drawn box, pixels."""
    axes.apply_aspect()  # nothing else of drawing moves the box
    corners = np.array(np.meshgrid(*_limits(axes))).reshape(3, -1)
    x, y, _ = need("mpl_toolkits.mplot3d.proj3d", "plot").proj_transform(*corners, axes.get_proj())
    return np.asarray(np.ptp(axes.transData.transform(np.column_stack([x, y])), axis=0))


def _limits(axes: Any) -> list[Any]:
    return [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
