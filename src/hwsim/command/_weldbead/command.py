"""``hwsim weldbead``: plan a job (or load its policy), grind beads on a simulated stand, report."""

import argparse
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from hwsim.command.base import AreaCommand

if TYPE_CHECKING:
    from hwsim._log.log import Log
    from hwsim.command._weldbead.toml import Job


class WeldBeadCommand(AreaCommand):
    """The sequence of passes over a weld bead, alone or with its two lower tiers."""

    name = "weldbead"
    about = "plan a weld-bead grinding job and run it, pass by pass, on a simulated stand"
    more = """
Three tiers run: the sequence asks for a depth, the pass planner turns it into heights and forces along the
scanned bead, a force loop follows them 60 times a second. With --simple the sequence runs alone; what a pass
takes off is drawn.
With --out the policy, the log, the journal and pictures are kept in a folder. Killed? The same command goes
on after the last finished bead, with the results that it would have had; a finished run is reported again.
"""
    library, plans = "sdpgrind.weldbead", "SequencePolicy"
    made_for, part, plan_word = "a weld bead", "bead", "policy"
    presets = "P1 ... P5, C0"
    tolerance = "of the plan's expected penalty, $ (1e-5, or what suits greater charges)"
    files: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "--operator-table": ("write the plan as a sheet: .html, .txt or .csv", ".html", ".txt", ".csv")
    }
    switches: ClassVar[Mapping[str, str]] = {"--simple": "the sequence alone, on a stand of one draw a pass"}

    def read(self, path: Path, arguments: argparse.Namespace) -> "Job":
        """Read the job in a TOML file."""
        from hwsim.command._weldbead.toml import read

        return read(path, simple=arguments.simple)

    def job_of(self, problem: Any, arguments: argparse.Namespace) -> "Job":
        """Put a problem on a default stand."""
        from hwsim.command._weldbead.toml import job_of

        return job_of(problem, simple=arguments.simple)

    def plan(self, job: Any, arguments: argparse.Namespace, progress: Any) -> Any:
        """Plan a job without warnings; the report says how exact the policy is."""
        from sdpgrind import weldbead

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            tolerance: float | Literal["auto"] = (
                "auto" if arguments.tolerance is None else arguments.tolerance
            )
            return weldbead.plan(job.problem, tolerance=tolerance, progress=progress)

    def report(self, title: str, log: "Log", plan: Any, job: Any) -> str:
        """Return the report as text."""
        from hwsim.command._weldbead.report import report

        return report(title, log, plan, job.start, job.assumed)


AREA = WeldBeadCommand()
