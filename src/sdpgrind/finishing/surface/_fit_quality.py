"""How well a fitted surface holds the points that it was fitted to."""

from typing import Any

import numpy as np

from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, custom, described, quantity, text

MOST = 99.0  # source: finishing-any-robot.md, section 2; percent of the points that tolerance is asked of


@described("finishing.fit_quality", eq=False)
class FitQuality(ByValue, Described):
    """Distances of points from the surface that was fitted to them.

    Parameters
    ----------
    distances : array (m,)
        Of the points, mm, > 0 on the side of the tool.
    feet : array (m, 2)
        Parameters (u, v) of their feet on the surface (1).
    tolerance : float
        Distance that 99 % of the points were to keep, mm.
    net : (int, int)
        Control points along u and v.
    empty : float
        Share of the domain that is farther than two knot spans from any point (1).
    neighbours : float
        Correlation of the distances of neighbouring points (1): noise that is independent from
        point to point has 0, form that the net cannot follow has up to 1.
    status : str
        Why the net is not finer.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> at = np.linspace(0.0, 1.0, 30)
    >>> scan = fin.surface.nominal_surface().point(at[:, None], at).reshape(-1, 3)
    >>> found = fin.Surface.fit(scan, tolerance=0.01).fit
    >>> found.error < 0.01, found.net, found.status  # mm
    (True, (6, 6), '99 % of the points keep the tolerance')
    """

    distances: Floats = array("mm")
    feet: Floats = array("1")
    tolerance: float = quantity("mm", above=0)
    net: tuple[int, int] = custom()
    empty: float = quantity("1", at_least=0, at_most=1, default=0.0)
    neighbours: float = quantity("1", default=0.0)
    status: str = text(default="")

    def _check(self) -> None:
        if self.distances.ndim != 1 or not self.distances.size:
            raise self._refused("distances", "of shape (m,), one a point", self.distances.shape)
        if self.feet.shape != (self.distances.size, 2):
            raise self._refused("feet", "of shape (m, 2), one for each of the distances", self.feet.shape)
        object.__setattr__(self, "net", tuple(int(n) for n in self.net))

    @property
    def error(self) -> float:
        """Greatest distance of a point, mm."""
        return float(np.abs(self.distances).max())

    @property
    def rms(self) -> float:
        """Root of the mean squared distance, mm."""
        return root_mean_square(self.distances)

    @property
    def most(self) -> float:
        """Distance that 99 % of the points keep, mm."""
        return kept_by_most(self.distances)

    def __repr__(self) -> str:
        nu, nv = self.net
        return (
            f"FitQuality(error={self.error:.3g} mm, rms={self.rms:.3g} mm, {self.distances.size} points,"
            f" {nu} x {nv} control points, empty={self.empty:.3g}: {self.status})"
        )


def root_mean_square(distances: Floats) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(distances**2)))


def kept_by_most(distances: Floats) -> float:
    """Distance that 99 % keep."""
    return float(np.percentile(np.abs(distances), MOST))


def agreement(distances: Floats, pairs: Any) -> float:
    """Correlation of the distances of `pairs` (2, k), about 0, which a fit leaves as their mean."""
    one, other = distances[pairs]
    square = float(np.mean(one**2 + other**2))
    return float(2.0 * np.mean(one * other) / square) if square else 0.0
