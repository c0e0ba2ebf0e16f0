"""Points that fold over their plane: found by flat neighbourhoods before a fit, by normals after it.

Neighbourhoods are of means over cubes as wide as the gaps between points: those of a scan line alone, with
its noise, look like a wall.
"""

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._plane import written

STEEPEST = np.deg2rad(80.0)  # source: finishing-any-robot.md, section 2
PLACES, MOST = 400, 20_000  # neighbourhoods, points; chosen: each is a 400th of the area, well above noise
FEWEST = 12  # chosen: points of a neighbourhood that tell a plane
FLAT = 0.05  # chosen: thickness of a flat neighbourhood over its width, and its width over its length
GRID = 40  # chosen: places each way over the plane whose distances from the points tell gaps
SHARE = 0.02  # chosen: of the neighbourhoods; fewer may be outliers, and a step is seen after the fit
ADVICE = "cut it by Region(box=...) into parts that are sheets"


def refuse_folded_points(points: Floats, normal: Floats) -> None:
    """Refuse points of which a share lies on walls or sheets that no height over the plane describes."""
    if len(points) < 2 * FEWEST:
        return
    some = _thinned(points[:: -(-len(points) // MOST)], normal)
    if len(some) < FEWEST:
        return
    at = some[:: max(len(some) // PLACES, 1)]
    near = some[cKDTree(some).query(at, k=max(FEWEST, len(some) // PLACES))[1]]
    flat, own = _planes(near)
    tilt = np.arccos(np.clip(np.abs(own @ normal), 0.0, 1.0))
    folded = flat & (tilt > STEEPEST)
    if folded.sum() > SHARE * len(at):
        _refuse(at[folded][0], tilt[folded][0])


def _thinned(points: Floats, normal: Floats) -> Floats:
    """Means of the points in each cube; its side is the usual distance of lines or points over the plane."""
    across = np.linalg.svd(normal[None])[2][1:]
    plan = points @ across.T
    low, high = plan.min(axis=0), plan.max(axis=0)
    share = np.stack(np.meshgrid(*[(np.arange(GRID) + 0.5) / GRID] * 2), axis=-1).reshape(-1, 2)
    gap = float(np.median(cKDTree(plan).query(low + share * (high - low))[0]))
    if gap == 0.0:
        return points
    cubes = np.floor((points - points.min(axis=0)) / (4 * gap)).astype(np.int64)  # of lines: their distance
    _, cube, count = np.unique(cubes, axis=0, return_inverse=True, return_counts=True)
    sums = [np.bincount(cube.ravel(), weights=each) for each in points.T]
    return np.asarray(np.stack(sums, axis=1) / count[:, None])


def _planes(near: Floats) -> tuple[Floats, Floats]:
    """Which neighbourhoods (k, m, 3) are flat and wide, and their normals (k, 3)."""
    centred = near - near.mean(axis=1, keepdims=True)
    squares, axes = np.linalg.eigh(np.swapaxes(centred, 1, 2) @ centred)
    extents = np.sqrt(np.maximum(squares, 0.0))
    flat = (extents[:, 0] < FLAT * extents[:, 1]) & (extents[:, 1] > FLAT * extents[:, 2])
    return flat, axes[..., 0]


def refuse_folded_surface(d: SurfaceDerivatives, points: Floats, normal: Floats) -> None:
    """Refuse a surface with derivatives `d` at the feet of `points` that turns away from the plane."""
    across = np.cross(d.u, d.v)
    cosine = (across @ normal) / np.sqrt(np.maximum(forms.dot(across, across), np.finfo(float).tiny))
    worst = int(cosine.argmin())
    if cosine[worst] < np.cos(STEEPEST):
        _refuse(points[worst], float(np.arccos(np.clip(cosine[worst], -1.0, 1.0))))


def _refuse(point: Floats, tilt: float) -> None:
    raise ValueError(
        f"points must be a sheet over their plane, at most {np.rad2deg(STEEPEST):g} deg steep;"
        f" near {written(point)} mm they are {np.rad2deg(tilt):.0f} deg steep: {ADVICE}"
    )
