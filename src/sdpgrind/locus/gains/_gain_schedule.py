"""Gain inverse to the loop slope."""

from typing import Any

import numpy as np

from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.locus._path.stretch import Stretch


@described()
class GainSchedule(Described):
    """Gain inverse to the loop slope: ``k(s) = theta / |e_s(s)|``.

    Parameters
    ----------
    stretch : Stretch
        Stretch with the loop slope, per unit of the coordinate.
    theta : float
        Share of deadbeat, in (0, 1].

    Examples
    --------
    >>> from sdpgrind import locus
    >>> stretch = locus.plan(locus.preset("koren-example")).stretch("v")
    >>> round(locus.gains.GainSchedule(stretch, theta=0.9)(3.0), 3)  # 0.9/1.5
    0.6
    """

    stretch: Stretch = custom()
    theta: float = quantity("1", above=0, at_most=1, default=1.0)

    def __call__(self, s: Any) -> Any:
        """Return the gain at a coordinate, clamped to the stretch; units of coordinate over response.

        Parameters
        ----------
        s : float or array
            Coordinate.
        """
        k = self.theta / np.abs(self.stretch.slopes.at(s)[..., 0])
        return k if np.ndim(s) else float(k)
