"""Quality of a fitted surface: its distances from the points that it was fitted to."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, custom, described, quantity, text

MOST = 99.0  # source: finishing-any-robot.md, section 2; percent of the points that tolerance is asked of


def _numbers(name: str, value: Any) -> tuple[int, ...]:
    """Return numbers of points, in order."""
    return tuple(sorted({checks.whole(f"{name}[{k}]", each) for k, each in enumerate(value)}))


@described("finishing.fit_quality", eq=False)
class FitQuality(ByValue, Described):
    """Distances of points from the surface that was fitted to them.

    Parameters
    ----------
    distances : array (m,)
        Of all points, mm, > 0 on the side of the tool.
    feet : array (m, 2)
        Parameters (u, v) of their feet on the surface (1).
    tolerance : float
        Distance that 99 % of the points were to keep, mm.
    net : (int, int)
        Control points along u and v.
    empty : float
        Share of the domain (1) that is farther than two knot spans from any point, or in a disc without
        points that is twelve times as wide as is usual between them.
    neighbours : float
        Correlation of the distances of neighbouring points (1): noise that is independent from
        point to point has 0, form that the net cannot follow has up to 1.
    status : str
        Why the net is not finer.
    left_out : tuple of int
        Numbers of the points that are outliers: the surface was fitted to the others alone (1).

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
    left_out: tuple[int, ...] = custom(_numbers, default=())

    def _check(self) -> None:
        if self.distances.ndim != 1 or not self.distances.size:
            raise self._refused("distances", "of shape (m,), one a point", self.distances.shape)
        if self.feet.shape != (self.distances.size, 2):
            raise self._refused("feet", "of shape (m, 2), one for each of the distances", self.feet.shape)
        if self.left_out and self.left_out[-1] >= self.distances.size:
            raise self._refused("left_out", f"numbers of the {self.distances.size} points", self.left_out)
        object.__setattr__(self, "net", tuple(int(n) for n in self.net))

    @property
    def outliers(self) -> int:
        """Number of points that were left out (dimensionless)."""
        return len(self.left_out)

    @property
    def kept(self) -> Floats:
        """Distances of the points that are no outliers, mm."""
        return np.delete(self.distances, np.array(self.left_out, dtype=int))

    @property
    def error(self) -> float:
        """Greatest distance of a point that is no outlier, mm."""
        return float(np.abs(self.kept).max())

    @property
    def rms(self) -> float:
        """Root of the mean squared distance of all points but outliers, mm."""
        return root_mean_square(self.kept)

    @property
    def most(self) -> float:
        """Distance that 99 % of all points but outliers keep, mm."""
        return kept_by_most(self.kept)

    def __repr__(self) -> str:
        nu, nv = self.net
        less = f" less {self.outliers} outlier{'s' if self.outliers > 1 else ''}" if self.outliers else ""
        return (
            f"FitQuality(error={self.error:.3g} mm, rms={self.rms:.3g} mm, {self.distances.size} points{less}"
            f", {nu} x {nv} control points, empty={self.empty:.3g}: {self.status})"
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
