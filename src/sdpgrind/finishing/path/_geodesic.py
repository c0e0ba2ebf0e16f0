"""Level sets of the distance on a surface from one of its borders, as passes.

The distance d is the viscosity solution of the eikonal equation g^ij d_i d_j = 1 in the surface's metric: the
least one where fronts of two parts of the border meet, or go round a corner of it.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._eikonal_kernels import refine, sweep
from sdpgrind.finishing.path._square import Square

# of the grid on each side; measured: twice as many change 50 mm by 0.001 mm. Where the grid is so skewed that
# nodes take other steps than its own (`_eikonal_kernels`) twice as many make passes of 0.5 mm 1.02 pitches
# apart instead of 1.08
NODES = 257
# chosen: limit of the rounds of sweeps; 100 have done where lines of the grid meet at 0.05 rad and more, 106
# on a strip of 58 mm by 2 mm whose ends are 31 degrees askew; of one 1 mm wide 200 do not
ROUNDS = 200
REFINEMENTS = 2  # chosen: passes of second order


@dataclass(frozen=True, eq=False)
class Field:
    """Distance (n, m) from the border c = 0 at places s (n,) along it and c (m,) across, mm."""

    s: Floats
    c: Floats
    distance: Floats

    @cached_property
    def columns(self) -> list[PchipInterpolator]:
        """Place across as a function of the distance, for each place along."""
        return [PchipInterpolator(distance, self.c) for distance in self.distance]


@lru_cache(maxsize=2)  # chosen: for other pitches, or with lifts; some 15 MB each
def distance_field(square: Square, nodes: int = NODES) -> Field:
    """Return the distance on the surface from the border c = 0; on skewed grids by twice as many nodes."""
    s = c = np.linspace(0.0, 1.0, nodes)
    E, F, G = _metric(square, s)
    if np.any(np.abs(F) > np.minimum(E, G)):
        s = c = np.linspace(0.0, 1.0, 2 * nodes - 1)
        E, F, G = _metric(square, s)
    return Field(s, c, solved(E, F, G))


def _metric(square: Square, side: Floats) -> tuple[Floats, Floats, Floats]:
    """E, F, G for steps of the grid with the same places on both sides."""
    by_s, by_c = square.tangents(side[:, None], side)
    E, F, G = (
        side[1] ** 2 * np.einsum("ijc,ijc->ij", x, y) for x, y in ((by_s, by_s), (by_s, by_c), (by_c, by_c))
    )
    return E, F, G


def solved(E: Floats, F: Floats, G: Floats) -> Floats:
    """Distance from the nodes (i, 0) in a metric for steps of the grid: sweeps, then second order."""
    d = np.full(E.shape, np.inf)
    d[:, 0] = 0.0
    fixed = d.ravel() == 0.0
    if sweep(E, F, G, d, ROUNDS) > ROUNDS:
        angle, ratio = _most_skewed(E, F, G)
        raise ValueError(
            "mapping must be another one than 'geodesic' on a grid whose lines are nearly parallel, or on a"
            f" strip with ends askew: distances still fall after {ROUNDS} rounds; got lines that meet at"
            f" {angle:.2g} rad, with steps of 1 : {ratio:.3g}"
        )
    known = np.where(d == 0.0, 0.0, np.inf)
    for _ in range(REFINEMENTS):
        refine(E, F, G, d, known, np.argsort(d, axis=None, kind="stable"), fixed)
    return d


def _most_skewed(E: Floats, F: Floats, G: Floats) -> tuple[float, float]:
    """Angle between lines of the grid, rad, and ratio of its steps, where the shorter ones reach farthest."""
    least = np.minimum(E, G)
    k = np.argmax(np.divide(np.abs(F), least, out=np.zeros_like(least), where=least > 0.0))
    e, f, g = (float(each.flat[k]) for each in (E, F, G))
    angle = np.arctan2(np.sqrt(max(e * g - f**2, 0.0)), abs(f))
    return float(angle), float(np.sqrt(max(e, g) / min(e, g)))


def refuse_folds(field: Field, along: str) -> None:
    """Raise where a pass would turn back, as the distance falls across the surface."""
    falls = np.argwhere(np.diff(field.distance, axis=1) <= 0)
    if falls.size:
        i, j = falls[0]
        a, b = (field.s[i], field.c[j]) if along == "u" else (field.c[j], field.s[i])
        raise ValueError(
            "mapping must be another one than 'geodesic', or along the other side: the distance from the"
            f" border falls at (a, b) = ({a:.3f}, {b:.3f}) of the square, where a pass of equal distance"
            f" would turn back; got along={along!r}"
        )


def level_sets(field: Field, levels: Floats) -> Floats:
    """Places c (n, levels) of distances in each column; NaN beyond the far border."""
    found = np.full((field.s.size, levels.size), np.nan)
    for i, column in enumerate(field.columns):
        inside = levels <= field.distance[i, -1]
        found[i, inside] = column(levels[inside])
    return found
