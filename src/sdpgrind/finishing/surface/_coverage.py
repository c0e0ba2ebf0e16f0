"""Share of a surface's domain without points: by knot spans, and by what is usual between the points."""

import numpy as np
from scipy.ndimage import distance_transform_edt, maximum_filter
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Bools, Floats

NEAR = 2  # source: finishing-any-robot.md, section 2; knot spans from a place to a point
CELLS = 4  # chosen: cells a knot span, so that the share is exact to a quarter of a span
# times the distance to a point that a quarter of the places keep, chosen. Of points scattered evenly a disc
# so wide is empty with exp(-41), of points four times as dense on one half with exp(-16) on the other; no
# place is further from scan lines than 4 times that distance
WIDE = 12.0
PLACES = 16_384  # chosen: cells of the domain, as square as they come


def empty_share(uv: Floats, spans: tuple[int, int], sides: Floats | None) -> float:
    """Share of the unit square without points `uv` (2, m): see `_beyond_spans` and `_in_wide_discs`.

    `sides` (2,), mm: of the rectangle; None: discs do not count.
    """
    empty = _beyond_spans(uv, spans)
    return empty if sides is None else max(empty, _in_wide_discs(uv, sides))


def _beyond_spans(uv: Floats, spans: tuple[int, int]) -> float:
    """Share with no point within two knot spans, each way."""
    nu, nv = (CELLS * n for n in spans)
    i, j = (np.minimum((at * n).astype(int), n - 1) for at, n in zip(uv, (nu, nv), strict=True))
    filled = np.zeros((nu, nv), np.uint8)
    filled[i, j] = 1
    return float(np.mean(maximum_filter(filled, 2 * NEAR * CELLS + 1, mode="constant") == 0))


def _in_wide_discs(uv: Floats, sides: Floats) -> float:
    """Share in discs without points that are far wider than is usual between the points."""
    stretch = float(np.clip(np.sqrt(sides[0] / sides[1]), PLACES**-0.5, PLACES**0.5))
    count = np.maximum(np.round(PLACES**0.5 * np.array([stretch, 1 / stretch])), 1).astype(int)
    cell = sides / count
    middles = np.stack(
        np.meshgrid(*((np.arange(n) + 0.5) * w for n, w in zip(count, cell, strict=True)), indexing="ij")
    )
    apart = cKDTree((uv * sides[:, None]).T).query(middles.reshape(2, -1).T)[0].reshape(count)
    return float(np.mean(_within(apart > (radius := WIDE * np.quantile(apart, 0.25)), radius, cell)))


def _within(centres: Bools, radius: float, cell: Floats) -> Bools:
    """Which cells lie in discs around `centres`."""
    if not centres.any():
        return centres
    return np.asarray(distance_transform_edt(~centres, sampling=cell) < radius)
