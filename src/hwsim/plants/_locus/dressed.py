"""One part on the adaptive grinder with a dressed wheel; its roughness is measured when it is ground."""

from collections.abc import Mapping
from math import nan
from typing import Any, NamedTuple

import numpy as np

from hwsim.devices import Gauge
from hwsim.plants._locus.machine import AdaptivePart, AdaptiveRig
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus.kernels import Ranges
from sdpgrind.locus.processes import DressedGrinding, Roughness


class Wheel(NamedTuple):
    """Wheel and roughness gauge of a part; fields as in `AdaptiveGrinder`."""

    dullness: float
    dressing_state: float
    dressing_lead: float | None
    leads: tuple[float, float]  # range of the dresser, mm
    roughness_gauge: Gauge


class DressedPart(AdaptivePart):
    """A live part; see `hwsim.protocols.Machine`. A wheel without a lead is dressed at the first one."""

    def __init__(
        self,
        rig: AdaptiveRig,
        process: DressedGrinding,
        wheel: Wheel,
        ranges: Ranges,
        rng: np.random.Generator,
    ) -> None:
        self._process, self._wheel, self._lead = process, wheel, wheel.dressing_lead
        super().__init__(rig, process.grinding, ranges, rng)

    def _take(self, command: Mapping[str, Any]) -> None:
        if self._lead is None and "dressing_lead" in command:
            self._dress(checks.within("dressing_lead", command["dressing_lead"], *self._wheel.leads, "mm"))
        super()._take(command)
        if self._command > 0 and self._lead is None:
            raise ValueError("dressing_lead must be commanded with the first infeed_rate; got none (mm)")

    def _dress(self, lead: float) -> None:
        self._lead = lead
        area = float(self._process.wear_flat_area(lead, self._wheel.dullness))
        self._begin(self._rig._replace(wear_flat_area=min(1.0, area)))

    @property
    def _law(self) -> Roughness:
        return checks.kind("grinding.roughness", self._process.grinding.roughness, Roughness)

    def _roughness(self) -> float:
        """Roughness of the surface that is ground now, mm; NaN: none is."""
        if self._lead is None or not self._part.rate > 0:
            return nan
        chip = self._process.grinding.specific_removal_rate(self._part.rate)
        chip /= self._process.grinding.wheel_speed
        return float(self._law.roughness(chip, self._lead, self._wheel.dressing_state))

    def _read(self) -> dict[str, float]:
        known, roughness = super()._read(), nan
        if self.done:
            gauge, normal = self._wheel.roughness_gauge, float(self._rng.standard_normal())
            roughness = gauge.read(self._roughness(), normal)
        return {**known, "roughness": roughness, "dressing_lead": nan if self._lead is None else self._lead}

    def _best(self, area: Floats) -> Floats:
        """Best infeed rates, mm/s, at areas of the wheel: without burning and within the roughness."""
        if self._lead is None:
            return np.full(area.shape, nan)
        grinding = self._process.grinding
        thickest = self._law.chip_thickness_max(self._lead, self._wheel.dressing_state)
        rough = float(grinding.infeed_rate(thickest * grinding.wheel_speed))
        return np.minimum(super()._best(area), rough)

    def outcome(self) -> dict[str, Any]:
        """Result of the part; see the plant."""
        roughness = self._roughness()
        return {
            **super().outcome(),
            "roughness": roughness,
            "roughness_slack": self._law.roughness_max - roughness,
            "dressing_lead": nan if self._lead is None else self._lead,
        }
