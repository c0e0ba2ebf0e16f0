"""Control net of a surface: checks of control points, degrees, knots and weights."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats

DIRECTIONS = ("u", "v")


def points(value: npt.ArrayLike) -> Floats:
    """Return control points (nu, nv, 3) that do not all coincide."""
    net = checks.finite_array("control_points", value, "mm")
    if net.ndim != 3 or net.shape[-1] != 3 or not net.size:
        raise checks.refuse("control_points", "of shape (nu, nv, 3)", net.shape)
    if not np.ptp(net.reshape(-1, 3), axis=0).any():
        raise ValueError(
            f"control_points must not all coincide (mm); got {net.reshape(-1, 3)[:1].tolist()} everywhere"
        )
    return lasting(np.ascontiguousarray(net))


def degrees(value: Any, net: Floats) -> tuple[int, int]:
    """Return the two degrees, each below the number of its control points."""
    checked = degree_pair(value)
    _refuse_few(net.shape[:2], checked)
    return checked


def degree_pair(value: Any) -> tuple[int, int]:
    """Return two degrees, whole numbers >= 1."""
    pair = _pair("degree", value)
    return checks.count("degree[0]", pair[0]), checks.count("degree[1]", pair[1])


def size(value: Any, degree: tuple[int, int]) -> tuple[int, int]:
    """Return the numbers of control points along u and v, each above its degree."""
    pair = _pair("net", value)
    net = checks.count("net[0]", pair[0]), checks.count("net[1]", pair[1])
    _refuse_few(net, degree)
    return net


def _refuse_few(net: tuple[int, ...], degree: tuple[int, int]) -> None:
    for name, least, n in zip(DIRECTIONS, degree, net, strict=True):
        if n <= least:
            raise checks.refuse(f"control points along {name}", f"at least degree + 1 = {least + 1}", n)


def knot_vectors(value: Any, degree: tuple[int, int], net: Floats) -> tuple[Floats, Floats]:
    """Return both knot vectors; None: clamped and uniform on [0, 1]."""
    if value is None:
        return clamped(net.shape[0], degree[0]), clamped(net.shape[1], degree[1])
    pair = _pair("knots", value)
    return _knots("knots[0]", pair[0], degree[0], net.shape[0]), _knots(
        "knots[1]", pair[1], degree[1], net.shape[1]
    )


def _pair(name: str, value: Any) -> Any:
    """Return a value with two entries, one for each direction."""
    if not hasattr(value, "__len__") or isinstance(value, str) or len(value) != 2:
        raise checks.refuse(name, "a pair, one entry for u and one for v", value)
    return value


def clamped(n: int, degree: int) -> Floats:
    """Uniform knots on [0, 1] whose ends lie on the outermost control points."""
    inner = np.linspace(0.0, 1.0, n - degree + 1)
    return lasting(np.concatenate([np.zeros(degree), inner, np.ones(degree)]))


def _knots(name: str, value: npt.ArrayLike, degree: int, n: int) -> Floats:
    """Return a knot vector that fits `n` control points of a degree."""
    knots = checks.finite_array(name, value)
    if knots.ndim != 1 or len(knots) != n + degree + 1:
        rule = f"control points + degree + 1 = {n} + {degree} + 1 = {n + degree + 1} numbers"
        raise checks.refuse(name, rule, len(knots) if knots.ndim == 1 else knots.shape)
    falls = np.flatnonzero(np.diff(knots) < 0.0)
    if falls.size:
        k = falls[0]
        raise ValueError(f"{name} must not decrease; got {knots[k + 1]:g} behind {knots[k]:g} at {k + 1}")
    _refuse_repeats(name, knots, degree)
    if knots[degree] >= knots[n]:
        raise ValueError(
            f"{name} must leave a domain, knot {degree} < knot {n}; got {knots[degree]:g} at both"
        )
    return lasting(knots)


def _refuse_repeats(name: str, knots: Floats, degree: int) -> None:
    values, repeats = np.unique(knots, return_counts=True)
    worst = int(repeats.argmax())
    if repeats[worst] > degree + 1:
        raise ValueError(
            f"{name} must hold no knot more than degree + 1 = {degree + 1} times;"
            f" got {values[worst]:g} {repeats[worst]} times"
        )


def weights(value: npt.ArrayLike | None, net: Floats) -> Floats | None:
    """Return weights (nu, nv) > 0, or None."""
    if value is None:
        return None
    array = checks.finite_array("weights", value)
    if array.shape != net.shape[:2]:
        raise checks.refuse("weights", f"of the control points' shape {net.shape[:2]}", array.shape)
    if array.min() <= 0.0:
        i, j = np.unravel_index(array.argmin(), array.shape)
        raise checks.refuse(f"weights[{i}, {j}]", "> 0", float(array.min()))
    return lasting(np.ascontiguousarray(array))
