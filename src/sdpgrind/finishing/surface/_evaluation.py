"""Points and derivatives of a surface: at scattered parameters by a kernel, on a grid by two contractions."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from scipy.interpolate import BSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._bspline_kernels import divide, evaluate, evaluate_points
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives

# derived: derivatives by u and v, in the order of `SurfaceDerivatives`
ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


class Splined(Protocol):
    """Attributes of a `Surface` that make its net."""

    @property
    def control_points(self) -> Floats: ...
    @property
    def weights(self) -> Floats | None: ...
    @property
    def knots(self) -> tuple[Floats, Floats]: ...
    @property
    def degree(self) -> tuple[int, int]: ...


class Net(NamedTuple):
    """Control points (nu, nv, 4) as (w x, w y, w z, w), or as (x, y, z, 0); knots and degrees."""

    points: Floats
    rational: bool
    knots: tuple[Floats, Floats]
    degree: tuple[int, int]


def fitting(**arrays: Floats) -> None:
    """Refuse arrays whose shapes do not broadcast."""
    shapes = [array.shape for array in arrays.values()]
    if len(set(shapes)) == 1:
        return
    try:
        np.broadcast_shapes(*shapes)
    except ValueError:
        got = " and ".join(map(str, shapes))
        raise ValueError(f"{', '.join(arrays)} must be of shapes that fit together; got {got}") from None


def homogeneous(points: Floats, weights: Floats | None) -> Floats:
    """Control points with a fourth column: weighted, or zero."""
    if weights is None:
        return np.concatenate([points, np.zeros((*points.shape[:2], 1))], axis=-1)
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def net_of(surface: Splined) -> Net:
    """Net of a surface."""
    points = homogeneous(surface.control_points, surface.weights)
    return Net(points, surface.weights is not None, surface.knots, surface.degree)


def scattered(net: Net, u: Floats, v: Floats) -> SurfaceDerivatives:
    """Derivatives at each pair (u, v), of shapes that broadcast."""
    u, v = np.broadcast_arrays(u, v)
    out = np.empty((len(ORDERS), u.size, 3))
    evaluate(net.points, net.rational, *net.knots, *net.degree, u.ravel(), v.ravel(), out)
    return SurfaceDerivatives(*out.reshape(len(ORDERS), *u.shape, 3))


def scattered_points(net: Net, u: Floats, v: Floats) -> Floats:
    """Points at each pair (u, v), of shapes that broadcast."""
    u, v = np.broadcast_arrays(u, v)
    out = np.empty((u.size, 3))
    evaluate_points(net.points, net.rational, *net.knots, *net.degree, u.ravel(), v.ravel(), out)
    return out.reshape(*u.shape, 3)


def on_grid(net: Net, u: Floats, v: Floats) -> SurfaceDerivatives:
    """Derivatives at each u with each v: A_u P A_v^T, with the basis of each direction evaluated once."""
    flat = np.stack(_contracted(net, u, v, ORDERS))
    return SurfaceDerivatives(*(_divided(flat) if net.rational else flat))


def tangents_on_grid(net: Net, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Derivatives Q_u, Q_v at each u with each v."""
    if net.rational:
        there = on_grid(net, u, v)
        return there.u, there.v
    by_u, by_v = _contracted(net, u, v, ((1, 0), (0, 1)))
    return by_u, by_v


def _contracted(net: Net, u: Floats, v: Floats, orders: Sequence[tuple[int, int]]) -> list[Floats]:
    """Sums of control points at each u with each v, for derivatives of some orders."""
    points = net.points if net.rational else net.points[..., :3]
    nu, nv, columns = points.shape
    most = 1 + max(map(max, orders))
    bases_u, bases_v = (
        bases(*direction, most) for direction in zip(net.knots, net.degree, (u, v), strict=True)
    )
    across = np.moveaxis(points, 1, 0).reshape(nv, -1)
    lines = [(basis @ across).reshape(-1, nu, columns).swapaxes(0, 1).reshape(nu, -1) for basis in bases_v]
    return [(bases_u[a] @ lines[b]).reshape(u.size, v.size, columns) for a, b in orders]


def bases(knots: Floats, degree: int, x: Floats, count: int = 3) -> list[Floats]:
    """Basis functions at `x` as a matrix (m, n), with the first of their derivatives: `count` matrices."""
    n = len(knots) - degree - 1
    if knots[n - 1] == knots[n]:  # scipy takes the empty span at the right end, where all bases are 0
        x = np.minimum(x, np.nextafter(knots[n], -np.inf))
    spline = BSpline(knots, np.eye(n), degree)
    return [np.ascontiguousarray(spline(x, nu=order)) for order in range(count)]


def _divided(flat: Floats) -> Floats:
    """Quotient rule: (w Q, w) with its derivatives, (6, ..., 4), changed in place, becomes Q with its own."""
    out = np.empty((*flat.shape[:-1], 3))
    divide(flat.reshape(len(ORDERS), -1, 4), out.reshape(len(ORDERS), -1, 3))
    return out
