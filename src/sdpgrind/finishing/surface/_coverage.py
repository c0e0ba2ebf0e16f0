"""Share of a surface's domain without points."""

import numpy as np
from scipy.ndimage import maximum_filter

from sdpgrind.base.checks import Floats

NEAR = 2  # source: finishing-any-robot.md, section 2; knot spans from a place to a point
CELLS = 4  # chosen: cells a knot span, so that the share is exact to a quarter of a span


def empty_share(uv: Floats, spans: tuple[int, int]) -> float:
    """Share of the unit square with no point `uv` (2, m) within two of its knot spans, each way."""
    nu, nv = (CELLS * n for n in spans)
    i, j = (np.minimum((at * n).astype(int), n - 1) for at, n in zip(uv, (nu, nv), strict=True))
    filled = np.zeros((nu, nv), np.uint8)
    filled[i, j] = 1
    return float(np.mean(maximum_filter(filled, 2 * NEAR * CELLS + 1, mode="constant") == 0))
