"""Grinding power as the sum of chips, ploughing and sliding, for numbers, arrays or CasADi symbols."""

from typing import Any, ClassVar

from sdpgrind.base.quantities import Described, described, law, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.physics._sliding import SLIDING, MalkinSliding, SlidingLaw


@described("physics.grinding_power")
class GrindingPower(Described):
    """Grinding power u v_w a + (f + sliding) v_s per width: Malkin; Brown (1988), (4.2).

    Parameters
    ----------
    specific_energy : float
        Chip formation energy u, J/mm^3.
    ploughing_force : float
        Ploughing force f per width, N/mm.
    sliding : SlidingLaw
        Law of the force on the wear flats, N/mm.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind.physics import DongSliding
    >>> law = GrindingPower(sliding=DongSliding())
    >>> wheel = {"work_speed": 1100.0, "wheel_speed": 37e3, "equivalent_diameter": 175.0}
    >>> round(law.power(depth_of_cut=0.0052, width=9.0, **wheel, wear_flat_area=0.026))
    1778
    """

    _inside: ClassVar[str] = "sliding"
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
            Depth of cut per work revolution, mm.
        work_speed, wheel_speed : float or array
            Surface speeds, mm/s.
        equivalent_diameter : float or array
            Equivalent diameter of wheel and work, mm.
        wear_flat_area : float or array
            Worn part of the wheel surface, as the sliding law defines it, 0..1.
        width : float or array
            Width of cut, mm.
        """
        sliding = self.sliding.force(
            depth_of_cut=depth_of_cut, work_speed=work_speed, wheel_speed=wheel_speed,
            equivalent_diameter=equivalent_diameter, wear_flat_area=wear_flat_area,
        )  # fmt: skip
        chips = self.specific_energy * work_speed * depth_of_cut
        return width * (chips + (self.ploughing_force + sliding) * wheel_speed / N_MM_S_PER_W)
