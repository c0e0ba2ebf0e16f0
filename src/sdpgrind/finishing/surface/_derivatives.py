"""A surface's points with their derivatives."""

from typing import NamedTuple

from sdpgrind.base.checks import Floats


class SurfaceDerivatives(NamedTuple):
    """Points of a surface with their derivatives by the parameters (u, v) to second order.

    Parameters
    ----------
    point : array (..., 3)
        Q(u, v), mm.
    u, v : array (..., 3)
        First derivatives, mm a unit of the parameter.
    uu, uv, vv : array (..., 3)
        Second derivatives, mm a unit of the parameters squared.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.surface.flat_surface(50.0).derivatives(0.25, 0.5).u  # mm
    array([50.,  0.,  0.])
    """

    point: Floats
    u: Floats
    v: Floats
    uu: Floats
    uv: Floats
    vv: Floats
