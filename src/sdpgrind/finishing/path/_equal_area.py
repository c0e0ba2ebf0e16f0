"""Equal-area map of the unit square onto a surface: u by the marginal, v by the conditional area.

The area density has kinks at the knots of a surface (that of a bicubic one jumps in its second derivative),
which the map would inherit. It is replaced by a spline with two derivatives wherever the surface has them, on
a mesh that narrows towards the knots. The map is exact for that spline.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._density_axis import PROBES as PLACES
from sdpgrind.finishing.path._density_axis import DensityAxis, fitted
from sdpgrind.finishing.path._equal_area_kernels import carry, carry_sides
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._surface import Surface

PROBES = 7  # chosen: lines in each knot span for the mesh of the other direction


@dataclass(frozen=True)
class EqualArea:
    """Cumulative areas as polynomials, in strips of u and cells of u and v (see `carry`); density's error."""

    breaks_u: Floats
    breaks_v: Floats
    strips: Floats
    across: Floats
    cells: Floats
    error: float

    def carried(self, jets: Floats) -> Floats:
        """Carry jets of (a, b) over into jets of (u, v)."""
        out = np.empty_like(jets)
        carry(self.breaks_u, self.breaks_v, self.strips, self.across, self.cells, jets, out)
        return out

    def sides(self, places: Floats) -> Floats:
        """Carry places (m, 2) over into (u, v) with their derivatives by a and by b, (m, 3, 2)."""
        out = np.empty((len(places), 3, 2))
        carry_sides(self.breaks_u, self.breaks_v, self.strips, self.across, self.cells, places, out)
        return out


@lru_cache(maxsize=8)
def equal_area(surface: Surface) -> EqualArea:
    """Return the map of a surface whose area density is positive inside."""
    lines = [_lines(surface, axis) for axis in (0, 1)]
    u = fitted(DensityAxis.of(surface, 0), lambda at: _density(surface, at, lines[1]))
    v = fitted(DensityAxis.of(surface, 1), lambda at: _density(surface, lines[0], at).T)
    powers = u.powers(_density(surface, u.sites, v.sites))
    # (cells of u, cells of v, powers of u, powers of v)
    powers = v.powers(np.moveaxis(powers, -1, 0)).transpose(2, 0, 3, 1)
    return _integrated(u.breaks, v.breaks, powers, _error(surface, u, v, powers))


def _density(surface: Surface, u: Floats, v: Floats) -> Floats:
    return forms.area_density(surface.grid(u, v))


def _lines(surface: Surface, axis: int) -> Floats:
    """Places inside all knot spans."""
    ends = surface.breaks[axis]
    inside = (np.arange(PROBES) + 0.5) / PROBES
    return np.asarray((ends[:-1, None] + np.diff(ends)[:, None] * inside).ravel())


def _error(surface: Surface, u: DensityAxis, v: DensityAxis, powers: Floats) -> float:
    """Relative error of the density, root mean square by area."""
    true = _density(surface, u.probes, v.probes)
    probed = PLACES[:, None] ** np.arange(powers.shape[-1])
    found = np.einsum("ijab,ka,lb->ikjl", powers, probed, probed, optimize=True).reshape(true.shape)
    area = true * np.repeat(np.diff(u.breaks), 2)[:, None] * np.repeat(np.diff(v.breaks), 2)
    return float(np.sqrt((area * (found / true - 1.0) ** 2).sum() / area.sum()))


def _integrated(breaks_u: Floats, breaks_v: Floats, powers: Floats, error: float) -> EqualArea:
    """Integrate the density by v, and its marginal by u, cumulative over the pieces."""
    cells = _rising(powers, np.diff(breaks_v)[:, None, None])  # (u, v, powers of u, of v)
    across = cells[:, -1].sum(axis=-1)
    strips = _rising(across[None], np.diff(breaks_u)[:, None])[0]
    return EqualArea(breaks_u, breaks_v, strips, across, cells, error)


def _rising(powers: Floats, width: Floats) -> Floats:
    """Antiderivative of polynomials (k, cells, ..., degree + 1) over 0 to 1 in each cell, cumulative."""
    found = np.zeros((*powers.shape[:-1], powers.shape[-1] + 1))
    found[..., 1:] = powers * width / np.arange(1, powers.shape[-1] + 1)
    found[:, 1:, ..., 0] = np.cumsum(found.sum(axis=-1), axis=1)[:, :-1]
    return found
