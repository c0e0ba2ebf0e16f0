"""A B-spline surface of a STEP file: parameters of places by foot points."""

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.elementary import AS_TOLD, Meaning, Pole
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.splines import SplineNet
from sdpgrind.finishing.surface._surface import Surface

LOOKS = 6  # chosen: places in each knot span, each way, from which foot points are sought
LEAST, MOST = 40, 400  # chosen: places each way
STEPS = 40  # chosen: steps to a foot point; five are usual
SETTLED = 1e-14  # of the domain, chosen: length of the last step
DAMPED = 1e-12  # of the trace, chosen: keeps steps finite at a pole
CLOSED = 1e-7  # of the surface's size, chosen: two sides are one line, or a side one place
NEARER = 1e-9  # mm, chosen: rounding of a distance from the surface
PLACES = 33  # chosen: places along a side for that


class Sculpted:
    """A B-spline surface with the parameters of places near it."""

    longest_step = np.inf

    def __init__(self, net: SplineNet) -> None:
        self._given = net
        self.surface = Surface(net.points, net.degree, net.knots, net.weights)
        self._low, self._high = np.transpose(self.surface.domain)

    @cached_property
    def _sides(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Places (k, 3) on the sides of least and greatest u, and v."""
        u, v = (np.linspace(*ends, PLACES) for ends in self.surface.domain)
        across, along = self.surface.grid(u[[0, -1]], v).point, self.surface.grid(u, v[[0, -1]]).point
        return (across[0], across[1]), (along[:, 0], along[:, 1])

    @cached_property
    def periods(self) -> tuple[float | None, float | None]:
        """Widths of the domain where its sides meet, None without."""
        least = CLOSED * self.surface.size
        first, second = (
            float(high - low) if np.abs(side[1] - side[0]).max() <= least else None
            for side, low, high in zip(self._sides, self._low, self._high, strict=True)
        )
        return first, second

    @cached_property
    def poles(self) -> tuple[Pole, ...]:
        """Sides that are one place."""
        least = CLOSED * self.surface.size
        return tuple(
            Pole(axis, float(place))
            for axis, pair in enumerate(self._sides)
            for side, place in zip(pair, (self._low[axis], self._high[axis]), strict=True)
            if np.ptp(side, axis=0).max() <= least
        )

    @cached_property
    def _starts(self) -> tuple[cKDTree, Floats]:
        """Places of a grid to start from, with their parameters."""
        u, v = (
            np.linspace(ends[0], ends[-1], int(np.clip(LOOKS * (ends.size - 1), LEAST, MOST)))
            for ends in self.surface.breaks
        )
        pairs = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
        return cKDTree(self.surface.grid(u, v).point.reshape(-1, 3)), pairs

    def uv(self, points: Floats) -> Floats:
        """Return the parameters (n, 2) of the foot points of points (n, 3)."""
        tree, pairs = self._starts
        uv = self._feet(pairs[tree.query(points)[1]], points)
        for axis, period in enumerate(self.periods):
            at_seam = (uv[:, axis] <= self._low[axis]) | (uv[:, axis] >= self._high[axis])
            if period is not None and at_seam.any():
                uv[at_seam] = self._beyond(uv[at_seam], points[at_seam], axis)
        return uv

    def _beyond(self, uv: Floats, points: Floats, axis: int) -> Floats:
        """Feet of points whose search ended at a seam, sought from its other side, too."""
        other = uv.copy()
        other[:, axis] = self._low[axis] + self._high[axis] - uv[:, axis]
        other = self._feet(other, points)
        here, there = (
            np.linalg.norm(self.surface.point(*each.T) - points, axis=1, keepdims=True)
            for each in (uv, other)
        )
        return np.where(there < here - NEARER, other, uv)

    def _feet(self, uv: Floats, points: Floats) -> Floats:
        """Parameters of the feet from those of a start, both (n, 2)."""
        for _ in range(STEPS):
            step = self._step(uv, points)
            after = np.clip(uv + step, self._low, self._high)
            moved = np.abs(after - uv).max(initial=0.0)
            uv = after
            if moved <= SETTLED * float((self._high - self._low).max()):
                break
        return uv

    def _step(self, uv: Floats, points: Floats) -> Floats:
        """Newton's steps of first order, (n, 2), from Qu s + Qv t = P - Q in the least squares."""
        there = self.surface.derivatives(uv[:, 0], uv[:, 1])
        tangents = np.stack([there.u, there.v], axis=1)
        # a side that blocks the way of one parameter leaves the other its own step
        normal = np.asarray(tangents @ np.swapaxes(tangents, 1, 2), dtype=float)
        right = np.einsum("nkc,nc->nk", tangents, points - there.point)
        blocked = ((uv <= self._low) & (right < 0)) | ((uv >= self._high) & (right > 0))
        normal[blocked[:, :, None] | blocked[:, None, :]] = 0.0
        least = DAMPED * np.trace(normal, axis1=1, axis2=2) + 1e-300
        normal[:, (0, 1), (0, 1)] += least[:, None] + blocked
        found = np.linalg.solve(normal, np.where(blocked, 0.0, right)[..., None])
        return np.asarray(found[..., 0], dtype=float)

    def points(self, uv: Floats) -> Floats:
        """Return the points (n, 3), mm; beyond a seam those of the other side."""
        inside = uv.copy()
        for axis, period in enumerate(self.periods):
            if period is not None:
                past = (uv[:, axis] - self._low[axis]) % period + self._low[axis]
                beyond = (uv[:, axis] < self._low[axis]) | (uv[:, axis] > self._high[axis])
                inside[:, axis] = np.where(beyond, past, uv[:, axis])
        inside = np.clip(inside, self._low, self._high)
        return self.surface.point(inside[:, 0], inside[:, 1])

    def net(self, box: Floats) -> SplineNet:
        """Return the net of the file, whatever the box."""
        return self._given

    def parameters(self, uv: Floats, box: Floats) -> Floats:
        """Return the parameters of the patch: those of the surface."""
        return uv

    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]:
        """Return what the file's parameters are: those here."""
        return AS_TOLD, AS_TOLD

    @property
    def domain(self) -> Floats:
        """Domain [[u0, v0], [u1, v1]]."""
        return np.stack([self._low, self._high])
