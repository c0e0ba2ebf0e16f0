"""Part of a scan that a surface is fitted to: a box, or what lies within creases around a seed."""

import math
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, custom, described, quantity


def _box(name: str, value: Any) -> Floats:
    """Return two opposite corners (2, 3), the lesser first."""
    box = checks.finite_array(name, value, "mm")
    if box.shape != (2, 3):
        raise checks.refuse(name, "two corners, (2, 3)", box.shape, "mm")
    if not (box[0] < box[1]).all():
        raise checks.refuse(name, "two corners, all of the first less than those of the second", value, "mm")
    return lasting(box)


def _seed(name: str, value: Any) -> Floats:
    """Return a point (3,)."""
    seed = checks.finite_array(name, value, "mm")
    if seed.shape != (3,):
        raise checks.refuse(name, "a point, three numbers", value, "mm")
    return lasting(seed)


@described("finishing.region", eq=False)
class Region(ByValue, Described):
    """Part of a scan that a surface is fitted to: what lies in a box, what a seed reaches, or both.

    From the triangle nearest to the seed the region spreads over edges at which the normals turn by less than
    `crease`. A seed needs triangles, so STL, PLY or OBJ; a cloud of points is cut by a box.

    Parameters
    ----------
    box : array (2, 3), optional
        Two opposite corners, mm, the lesser first.
    seed : array (3,), optional
        A point on the region, mm.
    crease : float
        Angle of the edges that end the region, rad.
    empty_max : float
        Greatest share of the fitted rectangle that may be without points (dimensionless): more for a part
        with a hole, or without corners, as a disk is.

    Raises
    ------
    ValueError
        When there is neither box nor seed, or a value is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing as fin, units
    >>> fin.Region(seed=(10.0, 20.0, 5.0), crease=units.deg(20))
    Region(seed=(10, 20, 5) mm, crease=0.349066 rad)
    """

    box: Floats | None = custom(_box, unit="mm", default=None)
    seed: Floats | None = custom(_seed, unit="mm", default=None)
    # source: finishing-any-robot.md, section 2: 30 deg, and 5 % of the domain
    crease: float = quantity(
        "rad", above=0, at_most=math.pi, default=math.pi / 6, usual=(1e-3, math.pi), typical=0.5
    )
    empty_max: float = quantity("1", above=0, at_most=1, default=0.05)

    def _check(self) -> None:
        if self.box is None and self.seed is None:
            raise ValueError("a region must have a box or a seed (mm); got neither")

    def holds(self, points: Floats) -> Bools:
        """Whether points (m, 3), mm, lie in the box; all do where there is none."""
        if self.box is None:
            return np.ones(len(points), dtype=bool)
        return np.asarray(((points >= self.box[0]) & (points <= self.box[1])).all(axis=1))
