"""Points of a surface with their derivatives."""

from typing import NamedTuple, Protocol

import numpy.typing as npt

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


class Differentiable(Protocol):
    """Attributes of a `Surface` that its area and its limits need."""

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]: ...
    @property
    def breaks(self) -> tuple[Floats, Floats]: ...
    @property
    def size(self) -> float: ...
    def derivatives(self, u: npt.ArrayLike, v: npt.ArrayLike) -> SurfaceDerivatives: ...
    def grid(self, u: npt.ArrayLike, v: npt.ArrayLike) -> SurfaceDerivatives: ...
