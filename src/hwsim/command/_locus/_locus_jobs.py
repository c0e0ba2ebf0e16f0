"""What ``hwsim locus`` runs: a grinder under adaptive control, and the controller of its first part."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hwsim.plants._adaptive.plant import AdaptiveGrinder
from sdpgrind import locus

PRINTED: Mapping[str, Any] = {
    "gain": 3.3e-6,
    "kp": 5.3e-6,
    "hold": 3.0,
    "at": "command",
    "start": 1e-3,
    "floor": 8e-4,
}  # Koren (36), in mm/(s W), s and mm/s; his gains alone are printed, the rest was calibrated to his 28 s and 4 s

DESIGNED: Mapping[str, Any] = {"margin": 2.0}  # W; what the lags and the dulling of the nominal machine take is 0.9


@dataclass(frozen=True)
class Job:
    """A grinder, what it is believed to be, and how the controller is set."""

    stand: AdaptiveGrinder
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def problem(self) -> locus.Problem:
        """What is planned."""
        return self.stand.problem

    def controller(self, plan: locus.Locus) -> locus.LocusController:
        """The controller of the first part: of designed gain, where nothing is said."""
        return locus.LocusController(plan, **{"along": "infeed_rate", **self.settings})
