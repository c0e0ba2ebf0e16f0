"""Force of a wheel's wear flats, by two printed laws.

Laws use operators alone, so that numbers, arrays and CasADi symbols pass through the same lines.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

from sdpgrind.base.quantities import Described, described, quantity

_STEEPEST = 5.0  # chosen: some five times beyond a force in proportion to the squared contact length


class SlidingLaw(Protocol):
    """Tangential force of the wear flats per width, N/mm: a power of the depth of cut.

    Attributes
    ----------
    areas : (float, float)
        Range of wear flat area that the law is meant for, 0..1.
    exponent : float
        Exponent of the depth of cut, unit 1.
    """

    areas: ClassVar[tuple[float, float]]

    @property
    def exponent(self) -> float:
        """Exponent of the depth of cut, unit 1."""

    def force(
        self,
        *,
        depth_of_cut: Any,
        work_speed: Any,
        wheel_speed: Any,
        equivalent_diameter: Any,
        wear_flat_area: Any,
    ) -> Any:
        """Return the force per width, N/mm.

        Parameters
        ----------
        depth_of_cut : float or array
            Depth of cut per work revolution, mm.
        work_speed, wheel_speed : float or array
            Surface speeds, mm/s.
        equivalent_diameter : float or array
            Equivalent diameter of wheel and work, mm.
        wear_flat_area : float or array
            Worn part of the wheel surface, 0..1.
        """


@described("physics.malkin_sliding")
class MalkinSliding(Described):
    """Sliding force (c2 + c3 v_w/(v_s d_e)) (d_e a)^(1/2) A: Malkin; Brown (1988), (4.2), units corrected.

    The wear flat area A, 0.005 to 0.01, differs from that of `DongSliding` at equal power.

    Parameters
    ----------
    pressure : float
        c2, N/mm^2.
    curvature_pressure : float
        c3, N/mm; its magnitude is doubtful: nothing should depend on its exact value.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> law = MalkinSliding()
    >>> wheel = {"work_speed": 400.0, "wheel_speed": 30e3, "equivalent_diameter": 50.0}
    >>> round(law.force(depth_of_cut=0.01, **wheel, wear_flat_area=0.01), 3)
    4.013
    """

    areas: ClassVar[tuple[float, float]] = (0.0, 0.02)
    exponent: ClassVar[float] = 0.5
    pressure: float = quantity("N/mm^2", at_least=0, default=7.55)
    curvature_pressure: float = quantity("N/mm", at_least=0, default=2.1e6)

    def force(
        self,
        *,
        depth_of_cut: Any,
        work_speed: Any,
        wheel_speed: Any,
        equivalent_diameter: Any,
        wear_flat_area: Any,
    ) -> Any:
        """Return the force per width, N/mm; see `SlidingLaw`."""
        pressure = self.pressure + self.curvature_pressure * work_speed / (wheel_speed * equivalent_diameter)
        return pressure * (equivalent_diameter * depth_of_cut) ** 0.5 * wear_flat_area


@described("physics.dong_sliding")
class DongSliding(Described):
    """Sliding force C (d_e a)^0.85 A: Dong, Danai and Malkin (2004), (6), per width.

    The source prints 0.842 for a wheel 9 mm wide and powers in kW. A is its effective wear flat area, 0.01 to
    0.04.

    Parameters
    ----------
    coefficient : float
        C, N/mm^2.7.
    exponent : float
        Exponent of the squared contact length, unit 1.

    Raises
    ------
    ValueError
        When a value is not positive, or the exponent above 5.

    Examples
    --------
    >>> law = DongSliding()
    >>> wheel = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0}
    >>> round(law.force(depth_of_cut=0.0052, **wheel, wear_flat_area=0.026), 3)
    2.245
    """

    areas: ClassVar[tuple[float, float]] = (0.0, 0.1)
    coefficient: float = quantity("N/mm^2.7", above=0, default=842.0 / 9.0)
    exponent: float = quantity("1", above=0, at_most=_STEEPEST, default=0.85)

    def force(
        self,
        *,
        depth_of_cut: Any,
        work_speed: Any,
        wheel_speed: Any,
        equivalent_diameter: Any,
        wear_flat_area: Any,
    ) -> Any:
        """Return the force per width, N/mm, see `SlidingLaw`; speeds have no effect."""
        return self.coefficient * (equivalent_diameter * depth_of_cut) ** self.exponent * wear_flat_area


SLIDING: Mapping[str, type] = {"dong": DongSliding, "malkin": MalkinSliding}
"""Sliding laws by the names that files give them."""
