"""Roughness of a dressed wheel and the dressing lead: Dong, Danai and Malkin (2004), (10)."""

from math import pi, prod

from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity

_METHODS = ("solved", "printed")


@described("plunge.roughness_law")
class RoughnessLaw(Described):
    """Roughness R_a = R_0 s_d^x a_d^y (pi d_w v/v_s)^gamma of a wheel dressed with lead s_d and depth a_d.

    All lengths are in mm; pi d_w v/v_s is the thickness of the layer that passes the wheel. Dong, Danai and
    Malkin print the form without constants. The exponents have the order that Malkin gives for single-point
    dressing; R_0 is *calibrated* to a lead of 0.1 mm at their 0.0255 mm/s. Measure your own.

    Parameters
    ----------
    roughness_scale : float
        R_0: roughness at a lead, a depth and a layer of 1 mm each, mm.
    lead_exponent, depth_exponent, layer_exponent : float
        x, y and gamma, unit 1.

    Raises
    ------
    ValueError
        If a value is not positive.

    Examples
    --------
    >>> from sdpgrind import units
    >>> law, wheel = RoughnessLaw(), {"work_diameter": 70.0, "wheel_speed": units.m_per_s(37.0)}
    >>> lead = law.dressing_lead(units.um(0.7), dressing_depth=0.01, infeed_rate=0.0255, **wheel)
    >>> round(lead, 4)  # mm a turn
    0.0999
    >>> round(1e3 * law.roughness(lead, dressing_depth=0.01, infeed_rate=0.0255, **wheel), 9)  # µm
    0.7
    """

    roughness_scale: float = quantity("mm", above=0, usual=(0.0, 10.0), typical=0.1, default=units.um(98.0))
    lead_exponent: float = quantity("1", above=0, default=0.5)
    depth_exponent: float = quantity("1", above=0, default=0.25)
    layer_exponent: float = quantity("1", above=0, default=0.3)

    def roughness(
        self,
        dressing_lead: float,
        *,
        dressing_depth: float,
        infeed_rate: float,
        work_diameter: float,
        wheel_speed: float,
    ) -> float:
        """Return the roughness R_a, mm.

        Parameters
        ----------
        dressing_lead : float
            Dressing lead per turn of the wheel, mm.
        dressing_depth : float
            Depth of one dressing pass, mm.
        infeed_rate : float
            Infeed rate of the work, mm/s.
        work_diameter : float
            Diameter of the work, mm.
        wheel_speed : float
            Surface speed of the wheel, mm/s.
        """
        lead = checks.positive("dressing_lead", dressing_lead, "mm")
        depth = checks.positive("dressing_depth", dressing_depth, "mm")
        layer = _layer(infeed_rate, work_diameter, wheel_speed)
        shares = lead**self.lead_exponent, depth**self.depth_exponent, layer**self.layer_exponent
        return float(self.roughness_scale * prod(shares))

    def dressing_lead(
        self,
        roughness: float,
        *,
        dressing_depth: float,
        infeed_rate: float,
        work_diameter: float,
        wheel_speed: float,
        method: str = "solved",
    ) -> float:
        """Return the dressing lead per turn of the wheel (mm) for a roughness: (10).

        Parameters
        ----------
        roughness : float
            R_a, mm: units.um(0.7).
        dressing_depth, work_diameter, wheel_speed : float
            See `roughness`.
        infeed_rate : float
            Infeed rate of the work, mm/s; the greatest of the cycle is the safe choice, as the finish is
            ground more slowly.
        method : {"solved", "printed"}
            The law solved for the lead; or (10) as printed, with a_d^(1/y) in place of a_d^(-y), for which
            the lead vanishes.
        """
        wanted = checks.positive("roughness", roughness, "mm")
        depth = checks.positive("dressing_depth", dressing_depth, "mm")
        printed = checks.one_of("method", method, _METHODS) == "printed"
        power = 1 / self.depth_exponent if printed else -self.depth_exponent
        layer = _layer(infeed_rate, work_diameter, wheel_speed)
        inner = wanted / self.roughness_scale * layer**-self.layer_exponent * depth**power
        return float(inner ** (1 / self.lead_exponent))


def _layer(infeed_rate: float, work_diameter: float, wheel_speed: float) -> float:
    """Thickness of the layer that passes the wheel, pi d_w v/v_s, relative to 1 mm."""
    speed = checks.positive("wheel_speed", wheel_speed, "mm/s")
    rate = checks.positive("infeed_rate", infeed_rate, "mm/s")
    diameter = checks.positive("work_diameter", work_diameter, "mm")
    return pi * diameter * rate / speed
