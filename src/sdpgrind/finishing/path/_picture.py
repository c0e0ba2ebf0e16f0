"""A path in three dimensions, on its surface."""

from typing import Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.surface._picture import fill, patches

PIECES = 20_000  # chosen: straight pieces of the line, at most about
COLOURS = "plasma"
FAR = 0.82  # share of the colour scale in use, chosen: the rest is too pale on paper
AWAY = 0.18  # chosen: opacity of the line on the far side


def plot(path: Path | LiftedCourse, ax: Any = None) -> Any:
    """Draw a path on its surface, coloured by the length behind; see `Path.plot`."""
    collections = need("mpl_toolkits.mplot3d.art3d", "plot")
    own = ax is None
    if own:
        ax = pictures.figure(7.6, 4.6).add_subplot(projection="3d")
    samples = path.sample(per_leg=max(1, min(8, PIECES // len(path.nodes))))
    figure = work(path, ax, samples.point)
    every = slice(None, None, max(1, len(samples.length) // (2 * PIECES)))
    point, faces = samples.point[every], _faces(samples.normal[every], ax)
    line = collections.Line3DCollection(_pieces(point), linewidths=_width(path), capstyle="round", zorder=3)
    line.set(array=samples.length[every][1:], alpha=np.where(faces[1:], 1.0, AWAY), **_colours(path))
    ax.add_collection3d(line)
    for k, sign in ((0, "o"), (-1, "s")):
        ax.plot(*samples.point[[k]].T, sign, color="black", markersize=4, zorder=4)
    bar = figure.colorbar(line, ax=ax, shrink=0.6, pad=0.12, label="length, from the dot to the square [mm]")
    bar.solids.set_alpha(1.0)
    how = path.pattern if path.pattern == "zigzag" else f"{path.pattern}, {path.mapping.replace('_', ' ')}"
    ax.set_title(f"{how}: {path.length:.4g} mm, mean pitch {path.pitch:.3g} mm")
    if own:
        fill(ax, alone=True)
    return figure


def work(path: Path | LiftedCourse, ax: Any, points: Floats) -> Any:
    """Draw the work under a path, in a box with points (m, 3) in the air: its surface, or its patches."""
    return patches(path.patches, ax, points) if isinstance(path, LiftedCourse) else path.surface.plot(ax)


def _pieces(point: Floats) -> Floats:
    """Straight pieces (m - 1, 2, 3)."""
    return np.stack([point[:-1], point[1:]], axis=1)


def _width(path: Path | LiftedCourse) -> float:
    """Width of the line, points: thinner where passes are close."""
    surfaces = [each.surface for each in path.patches] if isinstance(path, LiftedCourse) else [path.surface]
    return float(np.clip(60.0 * path.pitch / np.sqrt(sum(each.area for each in surfaces)), 0.3, 1.6))


def _faces(normal: Floats, ax: Any) -> Floats:
    """Whether normals face the eye."""
    azimuth, height = np.radians([ax.azim, ax.elev])
    eye = np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)
    return np.asarray(normal @ eye > 0)


def _colours(path: Path | LiftedCourse) -> dict[str, Any]:
    """Colour map and its ends."""
    colors = need("matplotlib.colors", "plot")
    scale = need("matplotlib", "plot").colormaps[COLOURS](np.linspace(0.0, FAR, 256))
    return {"cmap": colors.ListedColormap(scale), "norm": colors.Normalize(0.0, path.length)}
