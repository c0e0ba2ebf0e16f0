"""What ``hwsim centering`` runs: a machine, table speeds of the strategy, and how the controller is set."""

import warnings
from dataclasses import dataclass, field
from typing import Any

import centering
from hwsim.plants._centering.plant import CenteringMachine


@dataclass(frozen=True)
class Job:
    """A machine, the table speed of its strategy (rad/s, or that it is scheduled), and settings of its controller."""

    stand: CenteringMachine
    spindle_speed: str | float = "scheduled"
    settings: centering.CycleSettings = field(default_factory=centering.CycleSettings)

    @property
    def problem(self) -> centering.CenteringProblem:
        """What is planned."""
        return self.stand.problem

    def controller(self, plan: centering.Strategy) -> centering.CenteringController:
        """The controller of every part."""
        return centering.CenteringController(plan, settings=self.settings)

    def source(self, plan: centering.Strategy) -> centering.PrintedController:
        """The source's controller, at the table speeds of a strategy."""
        return centering.PrintedController(self.problem, scheduled=plan, settings=self.settings)


def planned(job: Job, progress: Any) -> centering.Strategy:
    """The strategy of a job; that its tolerance is finer than what stick and slip allow is said in the report."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*stick and slip.*", category=UserWarning)
        return centering.plan(job.problem, spindle_speed=job.spindle_speed, progress=progress)
