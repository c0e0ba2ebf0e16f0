"""``hwsim locus``: trace the optimal locus (or load it) and grind parts along it on a simulated grinder."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from hwsim.command.base import AreaCommand

if TYPE_CHECKING:
    from hwsim.command._locus.toml import Job


class LocusCommand(AreaCommand):
    """Grinding along the optimal locus while the wheel dulls."""

    name = "locus"
    about = "trace the curve of best points of a grinding process and walk along it on a simulated grinder"
    more = """
The curve holds the fastest points that do not burn, one for each state of the wheel, which nobody can
measure. The controller walks along it by the power alone; each part begins where the last one ended, unless
--no-adapt says otherwise. The wheel dulls from part to part.
With --out the curve, the log, the journal and pictures are kept in a folder. Killed? The same command goes on
after the last finished part, with the results that it would have had; a finished run is reported again.
"""
    library, plans = "sdpgrind.locus", "Locus"
    made_for, plan_word = "an optimal locus", "curve"
    presets, units = "grinding", "mm, s, N, J, W, rad"
    error_unit = ""
    switches: ClassVar[Mapping[str, str]] = {
        "--no-adapt": "every part begins at the same point",
        "--printed": "with Koren's printed gains, not the designed ones (not with a problem.toml)",
    }

    def read(self, path: Path, arguments: argparse.Namespace) -> Any:
        """Read the job in a TOML file."""
        if arguments.printed:
            raise ValueError("--printed must be left out where a problem.toml sets the controller; got both")
        return super().read(path, arguments)

    def job_of(self, problem: Any, arguments: argparse.Namespace) -> "Job":
        """Put a problem on a grinder equal to its model."""
        from hwsim.command._locus.toml import DESIGNED, PRINTED, Job
        from hwsim.plants._locus.plant import AdaptiveGrinder
        from sdpgrind import locus

        if not isinstance(problem.model, locus.processes.Grinding):
            kind = type(problem.model).__name__
            raise ValueError(
                "the problem must be one of grinding, as the preset grinding is: "
                f"no other machine is here; got {kind}"
            )
        return Job(AdaptiveGrinder(problem), PRINTED if arguments.printed else DESIGNED)

    def adaptation(self, job: Any, arguments: argparse.Namespace) -> Any:
        """Begin each part at the end of the last one, except with --no-adapt."""
        from sdpgrind import locus

        return None if arguments.no_adapt else locus.LearnedStart()


AREA = LocusCommand()
