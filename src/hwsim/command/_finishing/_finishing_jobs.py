"""What ``hwsim finishing`` runs: a cell, the method of planning, and how the torque controller is set."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hwsim.plants._finishing.plant import FinishingCell
from sdpgrind import finishing
from sdpgrind.finishing.kernels import CellScatter

NORMAL_FORCE = 1.111  # N: the middle of Wang's three
KIND = "lqg"


@dataclass(frozen=True)
class Job:
    """A cell, what it is believed to be, how its motion is planned, how its controller is set, and what a study varies."""

    stand: FinishingCell
    settings: Mapping[str, Any] = field(default_factory=dict)
    method: str = "trapezoid"
    study: Mapping[str, Any] = field(default_factory=dict)

    @property
    def problem(self) -> finishing.FinishingProblem:
        """What is planned."""
        return self.stand.problem

    def controller(self, plan: finishing.Motion) -> finishing.TorqueController:
        """The controller of every part."""
        return finishing.TorqueController(
            self.stand.torque_axis, plan, **{"normal_force": self.stand.target_force, "kind": KIND} | dict(self.settings)
        )


def scattered(problem: finishing.FinishingProblem, *, nominal: bool) -> Job:
    """A problem in a cell of which nothing is said: parts that differ, or all as believed."""
    scatter = None if nominal else CellScatter()
    return Job(FinishingCell(problem, scatter=scatter, target_force=NORMAL_FORCE))
