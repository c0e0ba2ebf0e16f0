"""Laws for whole tables: partial moments from Taylor series of the unit law about the centres of its cells.

Their error is a rounding of the amounts themselves, in the tails too, where that of the law is relative; they
take a tenth of its time.
"""

import copy
from functools import lru_cache
from math import factorial

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions import quick_kernels as _kernels
from sdpgrind.sdp._distributions.empirical import Rectified
from sdpgrind.sdp._distributions.law import Law, WrappedLaw, checked_power
from sdpgrind.sdp._distributions.normal import HALF_PI, LogNormal, Normal, normal_density
from sdpgrind.sdp._distributions.quick_kernels import UnitTable
from sdpgrind.sdp._distributions.rayleigh import RAYLEIGH_SD, Rayleigh

# derived: of a unit; seven terms leave 4e-21 of a moment and 8e-17 of a probability half a cell off a centre
CELLS, TERMS = 128.0, 7
END = 9.0  # derived: P(Rho > 9) and P(Z > 9) are below 1e-17


def quick(law: Law) -> Law:
    """Return the law of shape (..., 1) with quick moments at points on a line; itself if none are known."""
    if isinstance(law, Rayleigh):
        return _Quick(law, (law._location, law._scale), rayleigh_table())
    if isinstance(law, Normal):
        return _Quick(law, (law._location, law._scale), normal_table())
    if isinstance(law, LogNormal):
        return _QuickLogNormal(law, (law.mean, law._sigma), normal_table())
    if isinstance(law, Rectified):
        rectified = copy.copy(law)
        rectified._base = quick(law._base)
        return rectified
    return law


def hats(law: Law, x: Floats, place: Floats) -> Floats:
    """Return the weights (P, nodes) of nodes after a fall from points x by laws of shape (P,) or ().

    `place`: coordinates of the nodes, rising, and one more at either end. A weight is the expectation of the
    hat function of its node: a second difference of E (y - D)+ below the mean, of E (D - y)+ above it, each
    accurate there.
    """
    known = quick(law)
    if isinstance(known, _Quick):
        return known.hats(x, place)
    y, h = x - place[:, None], np.diff(place)
    below, above = (
        np.diff(np.diff(curve, axis=0) / h[:, None], axis=0) for curve in (law.under(y), law.over(y))
    )
    weight = np.where(y[1:-1] <= law.mean, below, above)
    return np.broadcast_to(weight, (place.size - 2, *x.shape)).T.copy()


class _Quick(WrappedLaw):
    """A law ``location + scale U``, given as (location, scale)."""

    def __init__(self, law: Law, numbers: tuple[Floats, Floats], table: UnitTable) -> None:
        self.shape, self.mean, self.sd = law.shape, law.mean, law.sd
        self._law, self._numbers, self._table = law, numbers, table

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        known = self._looked_up(np.asarray(y, dtype=float), checked_power(power), over=False)
        return super().under(y, power) if known is None else known

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        known = self._looked_up(np.asarray(y, dtype=float), checked_power(power), over=True)
        return super().over(y, power) if known is None else known

    def hats(self, x: Floats, place: Floats) -> Floats:
        """Return what `hats` does."""
        out = np.zeros((x.size, place.size - 2))
        # Writable and of their own, as all that kernels get: else they would be compiled once more.
        first, second = (np.broadcast_to(each, x.shape).copy() for each in self._numbers)
        self._fill_hats(x.copy(), place.copy(), first, second, out)
        return out

    def _fill_hats(self, x: Floats, place: Floats, first: Floats, second: Floats, out: Floats) -> None:
        _kernels.placed_hats(x, place, first, second, self._table, out)

    def _looked_up(self, y: Floats, power: int, over: bool) -> Floats | None:
        """Moments of laws (..., 1) at points on a line; None: not by look-ups."""
        if power == 2 or y.ndim != 1 or self.shape[-1:] != (1,):
            return None
        out = np.empty((*self.shape[:-1], y.size))
        first, second = (each.ravel() for each in self._numbers)
        self._fill(y, first, second, (power == 0, over), out.reshape(-1, y.size))
        return out

    def _fill(self, y: Floats, first: Floats, second: Floats, kind: tuple[bool, bool], out: Floats) -> None:
        _kernels.placed(y, first, second, self._table, *kind, out)


class _QuickLogNormal(_Quick):
    """A log-normal law, given as (mean, standard deviation of the logarithm)."""

    def _fill(self, y: Floats, first: Floats, second: Floats, kind: tuple[bool, bool], out: Floats) -> None:
        logs = np.log(y, out=np.full(y.shape, -np.inf), where=y > 0)
        _kernels.log_normal(y, logs, first, second, self._table, *kind, out)

    def _fill_hats(self, x: Floats, place: Floats, first: Floats, second: Floats, out: Floats) -> None:
        _kernels.log_normal_hats(x, place, first, second, self._table, out)


@lru_cache(maxsize=1)
def rayleigh_table() -> UnitTable:
    """Return the table of the unit Rayleigh law."""
    u = _centres(0.0, END)
    tail = np.exp(-0.5 * u * u)
    further = [(-1) ** n * he * -tail for n, he in enumerate(_hermite(u, TERMS - 1))][1:]
    unit = Rayleigh(HALF_PI, RAYLEIGH_SD)
    under, over = [unit.under(u), unit.under(u, 0), *further], [unit.over(u), -tail, *further]
    return UnitTable(_series(under), _series(over), 0.0, CELLS, HALF_PI)


@lru_cache(maxsize=1)
def normal_table() -> UnitTable:
    """Return the table of the standard normal law."""
    u = _centres(-END, END)
    further = [(-1) ** n * he * normal_density(u) for n, he in enumerate(_hermite(u, TERMS - 2))]
    unit = Normal(0.0, 1.0)
    under, over = [unit.under(u), unit.under(u, 0), *further], [unit.over(u), -unit.over(u, 0), *further]
    return UnitTable(_series(under), _series(over), -END, CELLS, 0.0)


def _centres(low: float, high: float) -> Floats:
    return np.asarray(low + (np.arange(round((high - low) * CELLS)) + 0.5) / CELLS)


def _hermite(u: Floats, count: int) -> list[Floats]:
    """Hermite's polynomials He_0, He_1, ...: (-1)^n He_n f is the n-th derivative of f = exp(-u^2/2)."""
    found = [np.ones_like(u), u]
    while len(found) < count:
        found.append(u * found[-1] - (len(found) - 1) * found[-2])
    return found


def _series(derivatives: list[Floats]) -> Floats:
    """Series by derivatives at the centres, by powers of distances in cells."""
    terms = [each / (CELLS**n * factorial(n)) for n, each in enumerate(derivatives)]
    return np.ascontiguousarray(np.transpose(terms))
