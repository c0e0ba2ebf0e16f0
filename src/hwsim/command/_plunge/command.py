"""``hwsim plunge``: plan a cycle (or load its plan), grind parts on a simulated grinder, report."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from hwsim.command.base import AreaCommand

if TYPE_CHECKING:
    from hwsim.command._plunge.toml import Job


class Plunge(AreaCommand):
    """Cycles of plunge grinding: planned, and ground by a controller that learns during and between parts."""

    name = "plunge"
    about = "plan the fastest plunge-grinding cycle and grind parts with it on a simulated grinder"
    more = """
The plan is the bound: nothing is faster. The controller learns from size and power during a part, and hands
on to the next part what it knows of wheel and machine, the roundness that it has to aim at, and the burn
threshold where parts are inspected; with --no-adapt every part begins from the job alone.
With --out the plan, the log, the journal and pictures are kept in a folder. Killed? The same command goes on
after the last finished part, with the results that it would have had; a finished run is reported again.
"""
    library, plans = "sdpgrind.plunge", "CyclePlan"
    made_for = "a plunge cycle"
    presets, units = "simulation, experiment", "mm, s, N, J, W, rad"
    error_unit = "s"
    switches: ClassVar[Mapping[str, str]] = {"--no-adapt": "every part begins from the job alone"}

    def job_of(self, problem: Any, arguments: argparse.Namespace) -> "Job":
        """Put a problem on a grinder equal to its model, with noise."""
        from hwsim.command._plunge.toml import Job
        from hwsim.plants._plunge.plant import PlungeGrinder

        return Job(PlungeGrinder(problem))

    def plan(self, job: Any, arguments: argparse.Namespace, progress: Any) -> Any:
        """Plan a job."""
        from hwsim.command._plunge.toml import planned

        return planned(job.problem, progress)

    def adaptation(self, job: Any, arguments: argparse.Namespace) -> Any:
        """Hand on to the next part what was learned, except with --no-adapt."""
        from sdpgrind import plunge

        return None if arguments.no_adapt else plunge.adaptation(job.problem)


AREA = Plunge()
