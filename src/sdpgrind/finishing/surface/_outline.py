"""Trimming of a patch as straight lines in space, and what lies too near to them."""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface._outline_kernels import TOGETHER, clear_of
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._polygons import sides

CHORD = 1e-3  # mm, chosen: distance of a line from the curve in its stead, a fifth of the polygons' own
COARSE = 16  # chosen: lines of at most a 16th of the domain; a curve on one is no S
HALVINGS = 12  # chosen: a line is a 4096th of such a part at the least


class Outline:
    """Border of a patch: straight lines (n, 6) in space, starts and ends, mm."""

    def __init__(self, patch: Patch) -> None:
        self._surface = patch.surface
        ends = self._cut(sides(patch.polygons))
        for _ in range(HALVINGS):
            bent = self._sagitta(ends) > CHORD
            if not bent.any():
                break
            ends = _halved(ends, bent)
        self.lines = np.ascontiguousarray(self._points(ends).reshape(-1, 6))
        self._boxes = _boxes(self.lines)

    def clear(self, points: Floats, margin: float) -> Bools:
        """Return which points (m, 3), mm, are at least a margin (mm) away; following ones best lie near."""
        out = np.empty(len(points), dtype=bool)
        clear_of(self.lines, self._boxes, np.ascontiguousarray(points), margin, out)
        return out

    def _cut(self, ends: Floats) -> Floats:
        """Sides cut into parts of at most a 16th of the domain each way."""
        widths = np.ptp(np.array(self._surface.domain), axis=1)
        reach = np.abs(ends[:, 2:] - ends[:, :2]) / widths
        count = np.maximum(np.ceil(COARSE * reach.max(axis=1)), 1).astype(int)
        which = np.repeat(np.arange(len(ends)), count)
        k = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        start, way = ends[which, :2], ends[which, 2:] - ends[which, :2]
        low, high = (((k + more) / count[which])[:, None] for more in (0, 1))
        return np.hstack([start + low * way, start + high * way])

    def _points(self, ends: Floats) -> Floats:
        """Points (n, 2, 3) at both ends."""
        return self._surface.point(ends[:, ::2], ends[:, 1::2])

    def _sagitta(self, ends: Floats) -> Floats:
        """Distance between the middle of a line and the point of the surface in the middle, mm."""
        middle = (ends[:, :2] + ends[:, 2:]) / 2
        apart = self._surface.point(*middle.T) - self._points(ends).mean(axis=1)
        return np.asarray(np.linalg.norm(apart, axis=1))


def _halved(ends: Floats, bent: Bools) -> Floats:
    """Parts in their sequence, those that are bent in two halves."""
    out = np.repeat(ends, np.where(bent, 2, 1), axis=0)
    first = np.flatnonzero(bent) + np.arange(np.count_nonzero(bent))
    out[first, 2:] = out[first + 1, :2] = (ends[bent, :2] + ends[bent, 2:]) / 2
    return out


def _boxes(lines: Floats) -> Floats:
    """Lowest and highest coordinates (g, 6) of `TOGETHER` following lines each."""
    first = np.arange(0, len(lines), TOGETHER)
    low, high = np.minimum(lines[:, :3], lines[:, 3:]), np.maximum(lines[:, :3], lines[:, 3:])
    return np.hstack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)])
