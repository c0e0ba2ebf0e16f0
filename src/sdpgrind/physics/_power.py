"""Power of a wheel at the work in three parts: chips, ploughing and sliding. Numbers, arrays or symbols of CasADi."""

from typing import Any

from sdpgrind.base.quantities import Described, described, law, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.physics._sliding import SLIDING, MalkinSliding, SlidingLaw


@described("physics.grinding_power")
class GrindingPower(Described):
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
    >>> from sdpgrind.physics import DongSliding
    >>> law = GrindingPower(sliding=DongSliding())
    >>> point = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0, "wear_flat_area": 0.026}
    >>> round(law.power(depth_of_cut=0.0052, width=9.0, **point))
    1778
    """

    specific_energy: float = quantity("J/mm^3", above=0, default=13.8)
    ploughing_force: float = quantity("N/mm", at_least=0, default=0.962)
    sliding: SlidingLaw = law(
        SLIDING, "a sliding law, such as physics.DongSliding()", "force", default_factory=MalkinSliding
    )

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
