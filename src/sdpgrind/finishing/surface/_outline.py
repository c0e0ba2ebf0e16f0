"""Trimming of a patch as straight lines in space, and what lies too near to them."""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface._outline_kernels import clear_of
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
            ends = np.concatenate([ends[~bent], _halves(ends[bent])])
        self.lines = np.ascontiguousarray(self._points(ends).reshape(-1, 6))

    def clear(self, points: Floats, margin: float) -> Bools:
        """Return which points (m, 3), mm, are at least a margin (mm) away; following ones best lie near."""
        out = np.empty(len(points), dtype=bool)
        clear_of(self.lines, np.ascontiguousarray(points), margin, out)
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


def _halves(ends: Floats) -> Floats:
    middle = (ends[:, :2] + ends[:, 2:]) / 2
    return np.concatenate([np.hstack([ends[:, :2], middle]), np.hstack([middle, ends[:, 2:]])])
