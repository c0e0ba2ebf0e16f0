"""A patch: a surface within trimming polygons."""

from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, custom, described, part, text
from sdpgrind.finishing.surface._fit_quality import FitQuality
from sdpgrind.finishing.surface._polygons import Bands, banded, closed, inside, ordered, signed_area
from sdpgrind.finishing.surface._surface import Surface
from sdpgrind.finishing.surface._trimmed_area import area_within


@described("finishing.patch", eq=False)
class Patch(Described):
    """A surface with the polygons that trim it, in its parameters.

    Parameters
    ----------
    surface : Surface
        The whole surface, mm.
    trim : sequence of array (n, 2)
        Closed polygons of (u, v), the last place the first: an outer one counter-clockwise, holes clockwise.
        Without an outer one the border of the domain is it; (): all of the surface.
    name : str
        Name of the face in its file, or its number.

    Raises
    ------
    ValueError
        When a polygon is open, leaves the domain, crosses itself or another one, or a hole is outside.

    Examples
    --------
    A square of 50 mm with a triangular hole:

    >>> from sdpgrind import finishing as fin
    >>> hole = [(0.2, 0.2), (0.2, 0.6), (0.6, 0.2), (0.2, 0.2)]
    >>> patch = fin.surface.Patch(fin.surface.flat_surface(50.0), [hole])
    >>> round(patch.area, 6), patch.contains([0.3, 0.7], 0.3).tolist()  # mm^2
    (2300.0, [False, True])
    """

    surface: Surface = part(Surface)
    trim: tuple[Floats, ...] = custom(default=())
    name: str = text(default="")

    def _check(self) -> None:
        if isinstance(self.trim, str) or not hasattr(self.trim, "__iter__"):
            raise checks.refuse("trim", "a sequence of polygons (n, 2)", self.trim)
        domain = np.array(self.surface.domain)
        polygons = [closed(f"trim[{k}]", each, domain) for k, each in enumerate(self.trim)]
        object.__setattr__(self, "trim", ordered(polygons))

    def __repr__(self) -> str:
        told = f"{self.name}, " if self.name else ""
        count = len(self.trim)
        loops = f"{count} trimming loop{'s' if count > 1 else ''}" if count else "not trimmed"
        return f"Patch({told}{loops}, {self.area:.6g} mm^2, {self.surface!r})"

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, Patch) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[Any, ...]:
        return (self.surface, self.name, tuple(each.tobytes() for each in self.trim))

    @cached_property
    def polygons(self) -> tuple[Floats, ...]:
        """All closed polygons (n, 2) (dimensionless), the outer one first, the domain's border included."""
        if self.trim and signed_area(self.trim[0]) > 0:
            return self.trim
        (u0, u1), (v0, v1) = self.surface.domain
        border = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1), (u0, v0)])
        return (border, *self.trim)

    @cached_property
    def _bands(self) -> Bands:
        return banded(self.polygons)

    @cached_property
    def area(self) -> float:
        """Area within the polygons, mm^2, by Gauss points along them and over each knot span."""
        if self.trim and signed_area(self.trim[0]) > 0:
            return area_within(self.surface, self.trim)
        return self.surface.area + area_within(self.surface, self.trim)

    @property
    def fit(self) -> FitQuality:
        """Quality of the fit of a surface to a scan, mm."""
        return self.surface.fit

    def contains(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Bools:
        """Return whether places (u, v) of the surface are within the trimming, by the rule of even and odd.

        Parameters
        ----------
        u, v : array (...)
            Parameters (dimensionless).

        Raises
        ------
        ValueError
            When a parameter is not finite.
        """
        pair = np.broadcast_arrays(checks.finite_array("u", u), checks.finite_array("v", v))
        if not self.trim:
            domain = np.array(self.surface.domain)
            return np.asarray(
                (pair[0] >= domain[0, 0]) & (pair[0] <= domain[0, 1])
                & (pair[1] >= domain[1, 0]) & (pair[1] <= domain[1, 1])
            )  # fmt: skip
        places = np.stack([each.ravel() for each in pair], axis=-1)
        return inside(self._bands, places).reshape(pair[0].shape)

    def outline(self) -> tuple[Floats, ...]:
        """Return the polygons on the surface, each (n, 3), mm."""
        return tuple(self.surface.point(each[:, 0], each[:, 1]) for each in self.polygons)

    def moved(self, translation: npt.ArrayLike) -> Self:
        """Return the patch moved by `translation` (3,), mm."""
        return self.replace(surface=self.surface.moved(translation))

    def plot(self, ax: Any = None) -> Any:
        """Draw surface and trimming, mm, into 3-D axes `ax` or a new figure; return the figure."""
        return pictures.drawn("sdpgrind.finishing.surface._picture:patch", self, ax)
