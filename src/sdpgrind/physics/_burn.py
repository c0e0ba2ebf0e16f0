"""Burning by Malkin's law, Brown (1988), (4.3), in metric units, and the depths of cut at which it begins."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.physics._power import GrindingPower

_CHIP_ENERGIES = (0.05, 500.0)  # chosen: J/mm^3; of steel some 6, ten times beyond what exists
INCH = 25.4  # mm; source: definition
INCH_POUND = 0.0254 * 4.4482216152605  # J; derived: inch in m times pound-force in N


def malkin_burn_energy(cut_depth: Any, feed_rate: Any, diameter: Any, u0: Any, B: Any) -> Any:
    """Return the energy per area of work at which it burns, J/mm^2; Brown (1988), (4.3).

    It is u0 d + B (D d)^(1/4) V^(-1/2).

    Parameters
    ----------
    cut_depth : float or array
        Depth of cut d, mm.
    feed_rate : float or array
        Feed V along the work, mm/s.
    diameter : float or array
        Wheel diameter D, mm.
    u0 : float or array
        Energy carried away by the chips, J/mm^3.
    B : float or array
        Heat that the surface can take up, J/(mm^2 s^(1/2)).

    Examples
    --------
    >>> malkin_burn_energy(1.0, 4.0, 16.0, u0=6.0, B=7.0)
    13.0
    """
    return u0 * cut_depth + B * (diameter * cut_depth) ** 0.25 / feed_rate**0.5


def malkin_burn_coefficients() -> tuple[float, float]:
    """Return Malkin's printed u0, J/mm^3, and B, J/(mm^2 s^(1/2)).

    The source has 9.0e5 and 4.1e4 in inches, pounds and seconds; those in (D d)^(1/4) V^(-1/2) cancel.

    Examples
    --------
    >>> u0, B = malkin_burn_coefficients()
    >>> round(u0, 4), round(B, 4)
    (6.2053, 7.1802)
    """
    return 9.0e5 * INCH_POUND / INCH**3, 4.1e4 * INCH_POUND / INCH**2


@described("physics.burning_limit")
class BurningLimit(Described):
    """Power at which the work burns: Malkin; Brown (1988), (4.3).

    Per width it is u0 v_w a + B (d_e a)^(1/4) v_w^(1/2): Koren (1989), (29), with the exponent 1/4.

    Parameters
    ----------
    u0 : float
        Energy carried away by the chips, J/mm^3.
    B : float
        Burn threshold: heat that the surface can take up, J/(mm^2 s^(1/2)).

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> BurningLimit(u0=6.0, B=7.0).power(depth_of_cut=1.0, work_speed=4.0, equivalent_diameter=16.0)
    52.0
    """

    u0: float = quantity("J/mm^3", above=0, usual=_CHIP_ENERGIES, typical=6)
    B: float = quantity("J/(mm^2 s^(1/2))", above=0)

    @classmethod
    def published(cls) -> "BurningLimit":
        """Return the limit with Malkin's printed coefficients, J/mm^3 and J/(mm^2 s^(1/2))."""
        return cls(*malkin_burn_coefficients())

    def power(self, *, depth_of_cut: Any, work_speed: Any, equivalent_diameter: Any, width: Any = 1.0) -> Any:
        """Return the power, W; see `GrindingPower` for the arguments."""
        return (
            width
            * work_speed
            * malkin_burn_energy(depth_of_cut, work_speed, equivalent_diameter, self.u0, self.B)
        )


class BurnOnset(NamedTuple):
    """Depths of cut between which the work does not burn.

    Attributes
    ----------
    lower : float
        Smallest depth that does not burn, mm. Lighter cuts burn: ploughing heats a contact too short to carry
        the heat off.
    upper : float
        Greatest depth that does not burn, mm. inf: no limit up to the greatest depth searched. Less than
        `lower`: every depth burns.
    """

    lower: float
    upper: float


def burn_onset(
    power: GrindingPower,
    limit: BurningLimit,
    *,
    work_speed: float,
    wheel_speed: float,
    equivalent_diameter: float,
    wear_flat_area: float,
    depth_max: float = 1.0,
) -> BurnOnset:
    """Return the two depths of cut at which grinding power and burning limit are equal.

    Their difference is convex in the fourth root of the depth: it has two roots or none. For the speeds, the
    diameter and the wear flat area see `GrindingPower.power`.

    Parameters
    ----------
    power : GrindingPower
        Grinding power, W.
    limit : BurningLimit
        Power at which the work burns, W.
    depth_max : float
        Greatest depth searched, mm.

    Examples
    --------
    >>> from sdpgrind.physics import DongSliding
    >>> wheel = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0}
    >>> law = GrindingPower(sliding=DongSliding())
    >>> low, high = burn_onset(law, BurningLimit(u0=6.2, B=3.32), **wheel, wear_flat_area=0.026)
    >>> round(1e3 * low, 3), round(1e3 * high, 2)  # µm
    (0.09, 1.65)
    """
    speeds = {"work_speed": work_speed, "equivalent_diameter": equivalent_diameter}
    wheel = {"wheel_speed": wheel_speed, "wear_flat_area": wear_flat_area}

    def excess(root: float) -> float:
        depth = root**4
        return float(
            power.power(depth_of_cut=depth, **speeds, **wheel) - limit.power(depth_of_cut=depth, **speeds)
        )

    end = checks.positive("depth_max", depth_max, "mm") ** 0.25
    best = float(
        minimize_scalar(excess, bounds=(0.0, end), method="bounded", options={"xatol": 1e-9 * end}).x
    )
    return depths_between(excess, best, end)


def depths_between(excess: Callable[[float], float], best: float, end: float) -> BurnOnset:
    """Return the depths between which nothing burns, mm.

    Parameters
    ----------
    excess : callable
        Power minus limit, any unit: a convex function of the fourth root of the depth, mm^(1/4); > 0: the
        work burns.
    best, end : float
        Fourth roots of the depth of least excess and of the greatest depth searched, mm^(1/4).

    Examples
    --------
    >>> depths_between(lambda root: (root - 1) * (root - 2), best=1.5, end=3.0)
    BurnOnset(lower=1.0, upper=16.0)
    """
    if excess(best) > 0:
        return BurnOnset(np.inf, 0.0)
    lower = brentq(excess, 0.0, best, xtol=1e-15) if excess(0.0) > 0 else 0.0
    upper = brentq(excess, best, end, xtol=1e-15) if excess(end) > 0 else np.inf
    return BurnOnset(lower**4, upper**4)
