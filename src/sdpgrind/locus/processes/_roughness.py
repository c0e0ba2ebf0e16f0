"""Roughness of a ground surface by chip thickness and dressing."""

from dataclasses import KW_ONLY
from typing import Any

from sdpgrind.base.quantities import Described, described, quantity

ROUGHEST = 0.1  # chosen: mm; a greater roughness is in another unit


@described("locus.roughness")
class Roughness(Described):
    """Roughness R_a = rho R_0 (s_d/s_ref)^(1/2) (a_d/a_ref)^(1/4) (h/h_ref)^gamma, h = Z'/V_s, and its limit.

    The user must know R_0 and gamma: no source prints them. The dressing state rho is hidden.

    Parameters
    ----------
    roughness_max : float
        Greatest roughness R_a, mm: units.um(0.8).
    base : float
        R_0, roughness at reference lead, depth and chip thickness and at rho = 1, mm.
    exponent : float
        gamma, unit 1.
    chip_thickness : float
        h_ref, equivalent chip thickness of `base`, mm.
    lead : float
        s_d, dressing lead per turn of the wheel where it is no control, mm.
    lead_reference : float
        s_ref, mm.
    depth_ratio : float
        a_d/a_ref, dressing depth over that of `base`, unit 1.

    Raises
    ------
    ValueError
        When a value is not positive, or typical of micrometres.

    Examples
    --------
    >>> from sdpgrind import units
    >>> law = Roughness(roughness_max=units.um(0.8), base=units.um(0.5), exponent=0.4)
    >>> round(law.roughness(chip_thickness=2e-4, lead=0.1, state=1.0), 7)  # mm
    0.0006598
    """

    _: KW_ONLY
    roughness_max: float = quantity("mm", above=0)
    base: float = quantity("mm", above=0)
    exponent: float = quantity("1", above=0)
    chip_thickness: float = quantity("mm", above=0, usual=(1e-8, 0.05), typical=1e-4, default=1e-4)
    lead: float = quantity("mm", above=0, usual=(1e-3, 20.0), typical=0.1, default=0.1)
    lead_reference: float = quantity("mm", above=0, usual=(1e-3, 20.0), typical=0.1, default=0.1)
    depth_ratio: float = quantity("1", above=0, default=1.0)

    def _check(self) -> None:
        for name, value in (("roughness_max", self.roughness_max), ("base", self.base)):
            if value >= ROUGHEST:
                raise ValueError(
                    f"{name} must be in mm, < {ROUGHEST:g}; units.um(...) for micrometres; got {value!r}"
                )

    def roughness(self, chip_thickness: Any, lead: Any, state: Any) -> Any:
        """Return R_a (mm) for a chip thickness Z'/V_s (mm), dressing lead (mm), dressing state (unit 1)."""
        dressed = (lead / self.lead_reference) ** 0.5 * self.depth_ratio**0.25
        return state * self.base * dressed * (chip_thickness / self.chip_thickness) ** self.exponent

    def chip_thickness_max(self, lead: Any, state: Any) -> Any:
        """Return the chip thickness Z'/V_s (mm) of the greatest roughness, for a lead (mm) and state."""
        room = self.roughness_max / self.roughness(self.chip_thickness, lead, state)
        return self.chip_thickness * room ** (1 / self.exponent)
