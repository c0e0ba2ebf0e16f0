"""Grinding with the dressing lead as third control."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Any, ClassVar

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, part, quantity
from sdpgrind.locus._problem.process import Varying
from sdpgrind.locus.processes._grinding import Grinding
from sdpgrind.locus.processes._roughness import Roughness


@described("locus.dressed_grinding")
class DressedGrinding(Described):
    """Plunge grinding without burning and within a roughness; after Malkin and Koren (1980).

    Controls: ``infeed_rate`` (mm/s), ``work_rotation`` (rad/s), ``dressing_lead`` s_d (mm). A fine lead gives
    a smooth work and large wear flats: A = A_ref (s_d/s_ref)^-y x. Hidden states: ``dullness`` x and
    ``dressing_state`` rho (both unit 1). At the optimum both limits are active, which fixes Z' and s_d; the
    work speed is that of the locus of `Grinding` at this Z'.

    Parameters
    ----------
    grinding : Grinding
        Wheel, work, power, burning and roughness.
    area : float
        A_ref, wear flat area at the reference lead of the roughness and dullness 1, 0..1.
    area_exponent : float
        y, unit 1.

    Raises
    ------
    ValueError
        When the grinding has no roughness, or a value is out of range.

    Examples
    --------
    >>> from sdpgrind import units
    >>> roughness = Roughness(roughness_max=units.um(0.8), base=units.um(0.5), exponent=0.4)
    >>> wheel = Grinding(
    ...     wheel_diameter=300.0, work_diameter=60.0, width=9.3, wheel_speed=units.m_per_s(30),
    ...     roughness=roughness)
    >>> process = DressedGrinding(grinding=wheel, area=0.006, area_exponent=0.35)
    >>> round(process.wear_flat_area(dressing_lead=0.2, dullness=1.5), 6)
    0.007061
    >>> [varying.name for varying in process.constraints]
    ['grinding_power', 'roughness']
    """

    _inside: ClassVar[str] = "grinding"
    _: KW_ONLY
    grinding: Grinding = part(Grinding, " (see locus.processes.Grinding)")
    area: float = quantity("1", above=0, at_most=1)
    area_exponent: float = quantity("1", above=0)

    def _check(self) -> None:
        if self.grinding.roughness is None:
            raise ValueError(
                "grinding must have a roughness (see locus.processes.Roughness):"
                " the coarsest lead is best without; got none"
            )

    def check(
        self, controls: Mapping[str, tuple[float, float]], hidden: Mapping[str, tuple[float, float]]
    ) -> None:
        """Refuse ranges (low, high) of controls and hidden states in another unit (rad/s), see `Grinding`."""
        self.grinding.check(controls, hidden)

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Grinding power <= burning power (W), roughness <= its greatest value (mm)."""
        burning = Varying(response=self._power, limit=self._burning, name="grinding_power", unit="W")
        return burning, Varying(
            response=self._roughness, limit=self._roughness_limit, name="roughness", unit="mm"
        )

    @property
    def units(self) -> Mapping[str, str]:
        """Units of controls, hidden states and cost."""
        return {
            "infeed_rate": "mm/s", "work_rotation": "rad/s", "dressing_lead": "mm",
            "dullness": "1", "dressing_state": "1", "cost": "mm^2/s",
        }  # fmt: skip

    @property
    def job(self) -> Mapping[str, object]:
        """Wheel and work (mm, mm/s), which plan and machine must share."""
        return self.grinding.job

    def cost(self, s: Any, c: Any) -> Any:
        """Return -Z' (mm^2/s) for controls ``c``; it does not depend on the hidden states ``s``."""
        return self.grinding.cost(s, c)

    def wear_flat_area(self, dressing_lead: Any, dullness: Any) -> Any:
        """Return A = A_ref (s_d/s_ref)^-y x (0..1) for a dressing lead (mm) and a dullness (unit 1)."""
        return self.area * (dressing_lead / self._law.lead_reference) ** -self.area_exponent * dullness

    def lead_at_roughness(self, infeed_rate: Any, dressing_state: Any) -> Any:
        """Return the lead (mm) of the greatest roughness for an infeed rate (mm/s) and dressing state."""
        law, reference = self._law, self._law.lead_reference
        chip = self.grinding.specific_removal_rate(infeed_rate) / self.grinding.wheel_speed
        return reference * (law.roughness_max / law.roughness(chip, reference, dressing_state)) ** 2

    @property
    def _law(self) -> Roughness:
        return checks.kind("grinding.roughness", self.grinding.roughness, Roughness)

    def _power(self, s: Any, c: Any) -> Any:
        area = self.wear_flat_area(c.dressing_lead, s.dullness)
        return self.grinding.grinding_power(c.infeed_rate, c.work_rotation, area)

    def _burning(self, s: Any, c: Any) -> Any:
        return self.grinding.burning_power(c.infeed_rate, c.work_rotation)

    def _roughness(self, s: Any, c: Any) -> Any:
        chip = self.grinding.specific_removal_rate(c.infeed_rate) / self.grinding.wheel_speed
        return self._law.roughness(chip, c.dressing_lead, s.dressing_state)

    def _roughness_limit(self, s: Any, c: Any) -> Any:
        return self._law.roughness_max
