"""What is to be fitted: points, their plane, neighbours among them, and the first net; all checked."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface import _control_net as control_net
from sdpgrind.finishing.surface._folds import refuse_folded_points
from sdpgrind.finishing.surface._plane import Plane, plane_of

SPANS = 3  # chosen: knot spans each way of the first net over a square, those of a ridge or a saddle
LONGEST = 8  # chosen: ratio of the sides up to which knot spans are square
SPARE = 2  # chosen: points for each control point of a net that grows; with fewer it would follow noise
PAIRS = 5_000  # chosen: neighbours, whose correlation is then known to 0.014

Net = tuple[int, int]
Direction = npt.ArrayLike | None


class FitTask(NamedTuple):
    """Points (m, 3), mm, their plane, neighbours (2, k) among them, degrees, tolerance (mm), first net."""

    points: Floats
    plane: Plane
    pairs: npt.NDArray[np.int64]
    degree: tuple[int, int]
    tolerance: float
    net: Net


def task_of(
    points: npt.ArrayLike, net: Net | None, degree: tuple[int, int], tolerance: float, side: Direction
) -> FitTask:
    """Check what the user gave, and find the plane and the first net."""
    cloud, pair = checked_points("points", points), control_net.degree_pair(degree)
    size = None if net is None else control_net.size(net, pair)
    kept = checks.positive("tolerance", tolerance, "mm")
    _refuse_few(len(cloud), size or _least(pair), pair)
    plane = plane_of(cloud, None if side is None else _direction(side))
    refuse_folded_points(cloud, plane.axes[2])
    pairs = _neighbours(plane.parameters(cloud) * plane.sides[:, None])
    return FitTask(cloud, plane, pairs, pair, kept, size or _first_net(plane, pair, len(cloud)))


def checked_points(name: str, value: npt.ArrayLike) -> Floats:
    """Return points (m, 3), mm, without NaN."""
    cloud = checks.finite_array(name, value, "mm")
    if cloud.ndim != 2 or cloud.shape[1] != 3:
        raise checks.refuse(name, "of shape (m, 3)", cloud.shape, "mm")
    return np.ascontiguousarray(cloud)


def _direction(side: npt.ArrayLike) -> Floats:
    """Return a direction (3,) with a length."""
    vector = checks.finite_array("side", side)
    if vector.shape != (3,) or not vector.any():
        raise checks.refuse("side", "a direction towards the tool, three numbers that are not all 0", side)
    return vector


def _least(degree: tuple[int, int]) -> Net:
    """Net of a single span."""
    return degree[0] + 1, degree[1] + 1


def _refuse_few(count: int, net: Net, degree: tuple[int, int]) -> None:
    if count < math.prod(net):
        raise ValueError(
            f"points must be no fewer than the control points of a net of {net[0]} x {net[1]} ="
            f" {math.prod(net)}, here of degree {degree}; got {count}"
        )


def _first_net(plane: Plane, degree: tuple[int, int], count: int) -> Net:
    """Net of about nine spans that are square, or of a single one where points are few."""
    stretch = math.sqrt(min(plane.sides[0] / plane.sides[1], LONGEST))
    net = (round(SPANS * stretch) + degree[0], max(round(SPANS / stretch), 2) + degree[1])
    return net if SPARE * math.prod(net) <= count else _least(degree)


def _neighbours(places: Floats) -> npt.NDArray[np.int64]:
    """Pairs (2, k) of nearest neighbours among `places` (2, m)."""
    count = places.shape[1]
    one = np.arange(0, count, -(-count // PAIRS))
    _, near = cKDTree(places.T).query(places.T[one], k=2)
    other = np.where(near[:, 0] == one, near[:, 1], near[:, 0])
    return np.stack([one, other])
