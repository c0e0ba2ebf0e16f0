"""What is known of a path at places along it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats

Ints = npt.NDArray[np.intp]


class PathSamples(NamedTuple):
    """A path at places along it, run by run; a sharp corner is there twice, with the direction before and that after.

    Parameters
    ----------
    run : array (m,) of int
        Number of the smooth run between sharp corners.
    length : array (m,)
        Of the path up to there, mm.
    uv : array (m, 2)
        Parameters of the surface.
    point, tangent : array (m, 3)
        Place (mm) and unit direction of feed.
    curvature_vector : array (m, 3)
        Derivative of the tangent by the length, 1/mm.
    normal : array (m, 3)
        Unit normal of the surface, outward.

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
