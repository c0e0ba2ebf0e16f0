"""Nodes of a path in the unit square: checks of places and corners."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._legs import turning


def square_nodes(name: str, value: npt.ArrayLike) -> Floats:
    """Return nodes in the unit square, (n, 2), read-only, no two in a row the same."""
    nodes = lasting(checks.finite_array(name, value))
    if nodes.ndim != 2 or nodes.shape[1] != 2 or len(nodes) < 2:
        raise ValueError(f"{name} must be of shape (n, 2) with n >= 2; got shape {nodes.shape}")
    outside = np.flatnonzero(((nodes < 0) | (nodes > 1)).any(axis=1))
    if len(outside):
        raise checks.refuse(f"{name}[{outside[0]}]", "in the unit square", tuple(nodes[outside[0]].tolist()))
    same = np.flatnonzero((nodes[1:] == nodes[:-1]).all(axis=1))
    if len(same):
        raise checks.refuse(
            f"{name}[{same[0] + 1}]", f"apart from {name}[{same[0]}]", tuple(nodes[same[0]].tolist())
        )
    return nodes


def sharp_corners(value: npt.ArrayLike | None, nodes: Floats, smooth: bool) -> Bools | None:
    """Return which nodes are sharp, (n,), read-only, without the ends; straight legs turn only there."""
    if value is None:
        return None
    corners = np.array(value)
    if corners.shape != (len(nodes),) or corners.dtype != bool:
        raise ValueError(
            f"corners must be of shape ({len(nodes)},), true or false;"
            f" got shape {corners.shape}, {corners.dtype}"
        )
    corners[[0, -1]] = False
    missed = np.flatnonzero(turning(nodes) & ~corners)
    if len(missed) and not smooth:
        raise ValueError(
            f"corners[{missed[0]}] must be True, as straight legs turn there; or ask for smooth=True"
        )
    corners.flags.writeable = False
    return corners
