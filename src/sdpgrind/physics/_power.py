"""Power of a wheel at the work in three parts, chips, ploughing and sliding, and the power at which the work burns.

Laws are written with operators alone, so that numbers, arrays and symbols of CasADi go through the same lines.
"""

import dataclasses
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.physics._burn import malkin_burn_coefficients, malkin_burn_energy

N_MM_S_PER_W = 1000.0


class SlidingLaw(Protocol):
    """What the wear flats of a wheel add to its tangential force, N/mm, by a power of the depth of cut.

    Attributes
    ----------
    areas : (float, float)
        Range of wear flat area that the law is meant for, 0..1.
    exponent : float
        Of the depth of cut, unit 1.
    """

    areas: ClassVar[tuple[float, float]]

    @property
    def exponent(self) -> float:
        """Exponent of the depth of cut, unit 1."""

    def force(
        self, *, depth_of_cut: Any, work_speed: Any, wheel_speed: Any, equivalent_diameter: Any, wear_flat_area: Any
    ) -> Any:
        """Return the force for each width, N/mm.

        Parameters
        ----------
        depth_of_cut : float or array
            In one turn of the work, mm.
        work_speed, wheel_speed : float or array
            Speeds at the surface, mm/s.
        equivalent_diameter : float or array
            Of wheel and work, mm.
        wear_flat_area : float or array
            Worn part of the wheel's surface, 0..1.
        """


@stored("physics.malkin_sliding")
@dataclasses.dataclass(frozen=True)
class MalkinSliding(Frozen):
    """Sliding force (c2 + c3 v_w/(v_s d_e)) (d_e a)^(1/2) A: Malkin, as Brown (1988) prints it in (4.2), with its units mended.

    A is the worn part of the wheel's surface, some 0.005 to 0.01. At equal power it is not the A of `DongSliding`.

    Parameters
    ----------
    pressure : float
        c2, N/mm^2.
    curvature_pressure : float
        c3, N/mm: its magnitude is in doubt, and nothing should depend on its exact value.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> law = MalkinSliding()
    >>> round(law.force(depth_of_cut=0.01, work_speed=400.0, wheel_speed=30e3, equivalent_diameter=50.0, wear_flat_area=0.01), 3)
    4.013
    """

    areas: ClassVar[tuple[float, float]] = (0.0, 0.02)
    exponent: ClassVar[float] = 0.5
    pressure: float = 7.55
    curvature_pressure: float = 2.1e6

    def __post_init__(self) -> None:
        checks.nonnegative("pressure", self.pressure, "N/mm^2")
        checks.nonnegative("curvature_pressure", self.curvature_pressure, "N/mm")

    def force(
        self, *, depth_of_cut: Any, work_speed: Any, wheel_speed: Any, equivalent_diameter: Any, wear_flat_area: Any
    ) -> Any:
        """Return the force for each width (N/mm) of a depth (mm), speeds (mm/s), a diameter (mm) and an area (0..1).

        Parameters
        ----------
        depth_of_cut : float or array
            In one turn of the work, mm.
        work_speed, wheel_speed : float or array
            Speeds at the surface, mm/s.
        equivalent_diameter : float or array
            Of wheel and work, mm.
        wear_flat_area : float or array
            Worn part of the wheel's surface, 0..1.
        """
        pressure = self.pressure + self.curvature_pressure * work_speed / (wheel_speed * equivalent_diameter)
        return pressure * (equivalent_diameter * depth_of_cut) ** 0.5 * wear_flat_area


@stored("physics.dong_sliding")
@dataclasses.dataclass(frozen=True)
class DongSliding(Frozen):
    """Sliding force C (d_e a)^0.85 A: Dong, Danai and Malkin (2004), (6), for each width.

    The source prints 0.842 for a wheel of 9 mm and powers in kW. A is its effective wear flat area, some 0.01 to 0.04.

    Parameters
    ----------
    coefficient : float
        C, N/mm^2.7.
    exponent : float
        Of the squared length of contact, unit 1.

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> law = DongSliding()
    >>> wheel = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0}
    >>> round(law.force(depth_of_cut=0.0052, **wheel, wear_flat_area=0.026), 3)
    2.245
    """

    areas: ClassVar[tuple[float, float]] = (0.0, 0.1)
    coefficient: float = 842.0 / 9.0
    exponent: float = 0.85

    def __post_init__(self) -> None:
        checks.positive("coefficient", self.coefficient, "N/mm^2.7")
        checks.positive("exponent", self.exponent)

    def force(
        self, *, depth_of_cut: Any, work_speed: Any, wheel_speed: Any, equivalent_diameter: Any, wear_flat_area: Any
    ) -> Any:
        """Return the force for each width (N/mm) of a depth (mm), speeds (mm/s), a diameter (mm) and an area (0..1).

        Parameters
        ----------
        depth_of_cut : float or array
            In one turn of the work, mm.
        work_speed, wheel_speed : float or array
            Speeds at the surface, mm/s; this law does not use them.
        equivalent_diameter : float or array
            Of wheel and work, mm.
        wear_flat_area : float or array
            Effective worn part of the wheel's surface, 0..1.
        """
        return self.coefficient * (equivalent_diameter * depth_of_cut) ** self.exponent * wear_flat_area


@stored("physics.grinding_power")
@dataclasses.dataclass(frozen=True)
class GrindingPower(Frozen):
    """Power of chips, ploughing and sliding: u v_w a + (f + sliding) v_s for each width, after Malkin; Brown (1988), (4.2).

    Parameters
    ----------
    specific_energy : float
        Energy to form chips u, J/mm^3.
    ploughing_force : float
        Force that only ploughs f, for each width, N/mm.
    sliding : SlidingLaw
        Force of the wear flats, N/mm.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> law = GrindingPower(sliding=DongSliding())
    >>> point = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0, "wear_flat_area": 0.026}
    >>> round(law.power(depth_of_cut=0.0052, width=9.0, **point))
    1778
    """

    specific_energy: float = 13.8
    ploughing_force: float = 0.962
    sliding: SlidingLaw = dataclasses.field(default_factory=MalkinSliding)

    def __post_init__(self) -> None:
        checks.positive("specific_energy", self.specific_energy, "J/mm^3")
        checks.nonnegative("ploughing_force", self.ploughing_force, "N/mm")

    def power(
        self,
        *,
        depth_of_cut: Any,
        work_speed: Any,
        wheel_speed: Any,
        equivalent_diameter: Any,
        wear_flat_area: Any,
        width: Any = 1.0,
    ) -> Any:
        """Return the power, W.

        Parameters
        ----------
        depth_of_cut : float or array
            In one turn of the work, mm.
        work_speed, wheel_speed : float or array
            Speeds at the surface, mm/s.
        equivalent_diameter : float or array
            Of wheel and work, mm.
        wear_flat_area : float or array
            Worn part of the wheel's surface as the sliding law means it, 0..1.
        width : float or array
            Of the cut, mm.
        """
        sliding = self.sliding.force(
            depth_of_cut=depth_of_cut, work_speed=work_speed, wheel_speed=wheel_speed,
            equivalent_diameter=equivalent_diameter, wear_flat_area=wear_flat_area,
        )  # fmt: skip
        chips = self.specific_energy * work_speed * depth_of_cut
        return width * (chips + (self.ploughing_force + sliding) * wheel_speed / N_MM_S_PER_W)


@stored("physics.burning_limit")
@dataclasses.dataclass(frozen=True)
class BurningLimit(Frozen):
    """Power at which the work burns: u0 v_w a + B (d_e a)^(1/4) v_w^(1/2) for each width, Malkin; Brown (1988), (4.3).

    Koren's (1989) (29) is the same with the exponent 1/4.

    Parameters
    ----------
    u0 : float
        Energy that leaves with the chips, J/mm^3.
    B : float
        Heat that the surface stands, J/(mm^2 s^(1/2)).

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> BurningLimit(u0=6.0, B=7.0).power(depth_of_cut=1.0, work_speed=4.0, equivalent_diameter=16.0)
    52.0
    """

    u0: float
    B: float

    def __post_init__(self) -> None:
        checks.positive("u0", self.u0, "J/mm^3")
        checks.positive("B", self.B, "J/(mm^2 s^(1/2))")

    @classmethod
    def published(cls) -> "BurningLimit":
        """Return the limit with Malkin's printed coefficients, J/mm^3 and J/(mm^2 s^(1/2))."""
        return cls(*malkin_burn_coefficients())

    def power(self, *, depth_of_cut: Any, work_speed: Any, equivalent_diameter: Any, width: Any = 1.0) -> Any:
        """Return the power, W.

        Parameters
        ----------
        depth_of_cut : float or array
            In one turn of the work, mm.
        work_speed : float or array
            Speed of the work's surface, mm/s.
        equivalent_diameter : float or array
            Of wheel and work, mm.
        width : float or array
            Of the cut, mm.
        """
        return width * work_speed * malkin_burn_energy(depth_of_cut, work_speed, equivalent_diameter, self.u0, self.B)


class BurnOnset(NamedTuple):
    """Depths of cut between which the work does not burn.

    Attributes
    ----------
    lower : float
        Below it light cuts burn, as ploughing needs power and the contact is too short to carry it away, mm.
    upper : float
        Above it the work burns, mm; infinite where it does not up to the greatest depth asked for. Less than `lower` where it
        burns at every depth.
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
    """Return both depths of cut at which the work begins to burn: where power and limit are equal.

    In the fourth root of the depth the difference is convex: two roots, or none.

    Parameters
    ----------
    power : GrindingPower
        What the wheel needs, W.
    limit : BurningLimit
        What the work stands, W.
    work_speed, wheel_speed : float
        Speeds at the surface, mm/s.
    equivalent_diameter : float
        Of wheel and work, mm.
    wear_flat_area : float
        Worn part of the wheel's surface, 0..1.
    depth_max : float
        Greatest depth that is looked at, mm.

    Examples
    --------
    >>> wheel = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0}
    >>> law = GrindingPower(sliding=DongSliding())
    >>> low, high = burn_onset(law, BurningLimit(u0=6.2, B=3.32), **wheel, wear_flat_area=0.026)
    >>> round(1e3 * low, 3), round(1e3 * high, 2)  # um
    (0.09, 1.65)
    """
    speeds = {"work_speed": work_speed, "equivalent_diameter": equivalent_diameter}
    wheel = {"wheel_speed": wheel_speed, "wear_flat_area": wear_flat_area}

    def excess(root: float) -> float:
        depth = root**4
        return float(power.power(depth_of_cut=depth, **speeds, **wheel) - limit.power(depth_of_cut=depth, **speeds))

    end = checks.positive("depth_max", depth_max, "mm") ** 0.25
    best = float(minimize_scalar(excess, bounds=(0.0, end), method="bounded", options={"xatol": 1e-9 * end}).x)
    if excess(best) > 0:
        return BurnOnset(np.inf, 0.0)
    lower = brentq(excess, 0.0, best, xtol=1e-15) if excess(0.0) > 0 else 0.0
    upper = brentq(excess, best, end, xtol=1e-15) if excess(end) > 0 else np.inf
    return BurnOnset(lower**4, upper**4)
