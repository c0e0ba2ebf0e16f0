"""``hwsim centering``: plan a strategy of pushes (or load it), centre parts on a simulated machine."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from hwsim.command.base import AreaCommand

if TYPE_CHECKING:
    from hwsim._log.log import Log
    from hwsim.command._centering.toml import Job


class Centering(AreaCommand):
    """Cycles of centering: measure, push, measure, until the ring is on the axis of the table."""

    name = "centering"
    about = "plan the pushes that centre a ring, and centre rings with them on a simulated machine"
    more = """
The strategy is planned on a model of the push; the machine has slide, probe, force sensor, table and the
tasks of its computer, and friction that differs from part to part and from push to push.
With --live each cycle is shown on a log-polar chart, in the time that the machine takes; on a terminal only.
With --source the source's controller works on the same parts, at the same table speeds, and both are
reported.
With --out the strategy, the log, the journal and pictures (a film strip of the last part among them) are kept
in a folder. Killed? The same command goes on after the last finished part, with the results that it would
have had; a finished run is reported again.
"""
    library, plans = "centering", "Strategy"
    made_for, plan_word = "centering pushes", "strategy"
    presets, units = "printed, identified", "mm, s, N, kg, rad"
    error_unit = "s"
    switches: ClassVar[Mapping[str, str]] = {
        "--live": "show the centre while it is pushed, on a terminal",
        "--source": "the same parts with the source's controller, too",
    }

    def job_of(self, problem: Any, arguments: argparse.Namespace) -> "Job":
        """Put a problem on a machine equal to its model, with its scatter."""
        from hwsim.command._centering.toml import Job
        from hwsim.plants._centering.plant import CenteringMachine

        return Job(CenteringMachine(problem))

    def plan(self, job: Any, arguments: argparse.Namespace, progress: Any) -> Any:
        """Plan a job."""
        from hwsim.command._centering.toml import planned

        return planned(job, progress)

    def watched(self, controller: Any, job: Any, arguments: argparse.Namespace) -> Any:
        """Show the controller's reports with --live."""
        if not arguments.live:
            return controller
        from hwsim.command._centering.live import LiveView, watched

        return watched(controller, LiveView(job.problem))

    def more_pictures(self, log: "Log") -> Mapping[str, Any]:
        """Draw the last part as a film strip."""
        from hwsim.command._centering.film import FilmStrip

        return {"film.png": FilmStrip(log)}

    def instead(self, title: str, job: Any, arguments: argparse.Namespace) -> str | None:
        """Run both controllers on the same parts with --source."""
        if not arguments.source:
            return None
        from hwsim.command._centering.report import compared

        return compared(self, title, job, arguments)

    def report(self, title: str, log: "Log", plan: Any, job: Any) -> str:
        """Return the report as text."""
        from hwsim.command._centering.report import report

        return report(title, log, plan)


AREA = Centering()
