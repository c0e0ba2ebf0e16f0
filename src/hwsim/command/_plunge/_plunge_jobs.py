"""What ``hwsim plunge`` runs: a grinder, and the controller of its first part."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hwsim.plants._plunge.plant import PlungeGrinder
from sdpgrind import plunge

_SHARE = 0.05  # of the stock: the margin of the first part, where nothing is said


@dataclass(frozen=True)
class Job:
    """A grinder, what it is believed to be, and how the controller is set."""

    stand: PlungeGrinder
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def problem(self) -> plunge.CycleProblem:
        """What is planned."""
        return self.stand.problem

    def controller(self, plan: plunge.CyclePlan) -> plunge.CycleController:
        """The controller of the first part."""
        settings = {"safety_margin": _SHARE * plan.problem.stock} | dict(self.settings)
        return plunge.CycleController(plan.problem, **settings)


def planned(problem: plunge.CycleProblem) -> plunge.CyclePlan:
    """The fastest cycle, by the most exact method that there is for it."""
    wear = problem.model.wear
    if wear is None or wear.growth == 0:
        return plunge.plan(problem)
    return plunge.plan(problem, method="dp" if wear.exponent == 0 else "collocation")
