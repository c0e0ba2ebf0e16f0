"""Samples of a path."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools, Floats

Ints = npt.NDArray[np.intp]


class PathSamples(NamedTuple):
    """Samples of a path, run by run; a sharp corner has two, with the direction before and after.

    Parameters
    ----------
    run : array (m,) of int
        Number of the smooth run between sharp corners.
    length : array (m,)
        Length of path up to the sample, mm.
    uv : array (m, 2)
        Parameters of the surface.
    point, tangent : array (m, 3)
        Place (mm) and unit direction of feed.
    curvature_vector : array (m, 3)
        Derivative of the tangent by the length, 1/mm.
    normal : array (m, 3)
        Outward unit normal of the surface. In the air tangent and normal are those of the tool.
    clearance : array (m,)
        Height of the tool over the work in a lift, mm; 0 in contact.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> samples = finishing.hilbert(finishing.surface.flat_surface(8.0), 1).sample(per_leg=1)
    >>> samples.length.round(9), samples.run  # mm
    (array([ 0.,  4.,  4.,  8.,  8., 12.]), array([0, 0, 1, 1, 2, 2]))
    """

    run: Ints
    length: Floats
    uv: Floats
    point: Floats
    tangent: Floats
    curvature_vector: Floats
    normal: Floats
    clearance: Floats

    @property
    def contact(self) -> Bools:
        """Whether the tool is on the work: clearance 0 mm, (m,)."""
        return self.clearance <= 0.0
