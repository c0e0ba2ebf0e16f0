"""Picture of a cylinder: the deviations of its sections, magnified and unrolled."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import pictures, units

if TYPE_CHECKING:
    from centering.roundness._cylinder import Cylinder

_ROOM = 0.8  # chosen: height of the greatest deviation over the distance of two sections
_DIVISIONS = 2  # chosen: least number of such distances in the picture
_FEW = 4  # chosen: points of a height that are drawn as a line; fewer are no section


def plot(cylinder: "Cylinder") -> Any:
    """Draw the deviations over angle and height; return the figure."""
    axis, z = pictures.axes_of(7.0, 5.0), cylinder.points[:, 2]
    sections = list(_sections(z))
    apart = np.ptp(z) / max(len(sections) - 1, _DIVISIONS)
    scale, angle = _ROOM * float(apart) / max(cylinder.cyl_t, 1e-12), _directions(cylinder)
    for section in sections:
        order = section[np.argsort(angle[section])]
        axis.plot(angle[order], z[order] + scale * cylinder.deviation[order], color=pictures.ACTUAL, lw=0.9)
        axis.plot(angle[order], z[order], color="0.6", lw=0.6, ls="--")
    if not sections:
        axis.plot(angle, z + scale * cylinder.deviation, ".", color=pictures.ACTUAL, ms=2)
    _mark(axis, cylinder, angle, scale)
    axis.set(xlabel=pictures.label("angle", "deg"), ylabel=pictures.label("height", "mm"))
    axis.set_title(
        f"{cylinder.kind}: CYLt {cylinder.cyl_t / units.um(1.0):.4g} µm; deviations {scale:.3g} times",
        fontsize=10,
    )
    pictures.opened([axis])
    return axis.figure


def _directions(cylinder: "Cylinder") -> npt.NDArray[np.float64]:
    """Direction of each point about the axis at its height, degrees."""
    middle = cylinder.axis[:2] + cylinder.points[:, 2:] * cylinder.axis[2:]
    across, up = (cylinder.points[:, :2] - middle).T
    return np.asarray(np.degrees(np.arctan2(up, across)) % 360.0)


def _sections(z: npt.NDArray[np.float64]) -> Iterator[npt.NDArray[np.int64]]:
    """Indices of the points of each height; none where heights do not repeat."""
    levels, of_point, counts = np.unique(z, return_inverse=True, return_counts=True)
    for k in range(levels.size if counts.min() >= _FEW else 0):
        yield np.flatnonzero(of_point == k)


def _mark(axis: Any, cylinder: "Cylinder", angle: npt.NDArray[np.float64], scale: float) -> None:
    """Mark the contacts: filled on the outer cylinder, hollow on the inner one."""
    for point, outer in zip(cylinder.contacts, cylinder.outer, strict=True):
        height = cylinder.points[point, 2] + scale * cylinder.deviation[point]
        fill = pictures.LIMIT if outer else "white"
        axis.plot(angle[point], height, "o", color=pictures.LIMIT, markerfacecolor=fill, markersize=5)
