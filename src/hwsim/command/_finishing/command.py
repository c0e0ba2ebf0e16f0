"""``hwsim finishing``: plan or load a motion, finish specimens in a simulated cell; or an experiment."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from hwsim.command._run_folder import drawn, paged, refuse_no_folder, with_kept
from hwsim.command._work import announce, tell
from hwsim.command.base import AreaCommand
from sdpgrind.base.whole_files import whole_file

if TYPE_CHECKING:
    from hwsim.command._finishing.toml import Job


class Finishing(AreaCommand):
    """Robot-assisted finishing: a motion over a surface, and a torque axis that presses the tool."""

    name = "finishing"
    about = "plan a robot's finishing motion and finish specimens with it in a simulated cell"
    more = """
The motion is planned within the limits of the joints; the torque axis holds the normal force while it is
played. What the cell really is (friction, torque constant, load torque, a surface that is not as planned)
differs from part to part; with --nominal it does not.
With --study an experiment is run: tool, path, feed and force vary by an orthogonal array L18, one run for
each row; it is analysed, the best settings are confirmed by --confirm runs, and repeated passes are planned
for the scatter that remains.
With --program nothing is finished: the planned motion becomes a program of the robot's controller, which is
read back and compared with the plan before it is written into the folder of --out.
With --out the motion, the log, the journal and pictures are kept in a folder. Killed? The same command goes
on after the last finished part, with the results that it would have had; a finished run is reported again.
"""
    library, plans = "sdpgrind.finishing", "Motion"
    made_for, plan_word = "a finishing job", "motion"
    presets, units = "nominal, specimen", "mm, s, N, N m, A, rad"
    error_unit = "mm"
    switches: ClassVar[Mapping[str, str]] = {
        "--nominal": "every part is as believed (not with a problem.toml)",
        "--study": "vary tool, path, feed and force by an L18, analyse, confirm",
    }
    choices: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "--program": ("write the motion as a program into --out", "urscript", "rapid", "krl", "csv", "ros")
    }
    counts: ClassVar[Mapping[str, str]] = {"--confirm": "with --study: number of runs that confirm it (3)"}

    def read(self, path: Path, arguments: argparse.Namespace) -> Any:
        """Read the job in a TOML file."""
        if arguments.nominal:
            raise ValueError("--nominal must be left out where a problem.toml describes the cell; got both")
        from hwsim.command._finishing.toml import read

        return read(path, arguments.program)

    def refuse(self, arguments: argparse.Namespace) -> None:
        """Refuse options that do not go together with --study or --program, or without."""
        if arguments.study:
            refuse_beside_study(arguments)
        elif arguments.confirm is not None:
            raise ValueError(f"--confirm must be left out without --study; got {arguments.confirm}")
        elif arguments.program is not None:
            refuse_beside_program(arguments)

    def job_of(self, problem: Any, arguments: argparse.Namespace) -> "Job":
        """Put a problem in a default cell."""
        from hwsim.command._finishing.toml import scattered

        return scattered(problem, nominal=arguments.nominal)

    def plan(self, job: Any, arguments: argparse.Namespace, progress: Any) -> Any:
        """Plan a motion."""
        from sdpgrind import finishing

        return finishing.plan(job.problem, method=job.method, progress=progress)

    def instead(self, title: str, job: Any, arguments: argparse.Namespace) -> str | None:
        """Run the designed experiment with --study, write a program with --program."""
        if arguments.study:
            refuse_face_on(job)
            return studied(title, job, arguments)
        if arguments.program is None:
            refuse_face_on(job)
            if arguments.serve is None and arguments.machine is None:
                tell_beyond(job)
            return None
        return programmed(self, title, job, arguments)


def refuse_beside_program(arguments: argparse.Namespace) -> None:
    """Refuse options beside --program, which runs nothing and needs a folder."""
    if arguments.parts is not None:
        raise ValueError(
            f"--parts must be left out with --program, which finishes none; got {arguments.parts}"
        )
    if arguments.out is None:
        raise ValueError("--out must be given with --program, the folder of its files")
    refuse_no_folder(arguments.out)


def refuse_beside_study(arguments: argparse.Namespace) -> None:
    """Refuse options beside --study, which plans motions of its own and runs them once each."""
    if arguments.program is not None:
        raise ValueError(f"--program must be left out with --study; got {arguments.program}")
    if arguments.plan is not None:
        raise ValueError("--motion must be left out with --study, which plans motions of its own")
    if arguments.parts is not None:
        raise ValueError(
            "--parts must be left out with --study (--confirm is of the runs that confirm); "
            f"got {arguments.parts}"
        )
    refuse_no_folder(arguments.out)


def refuse_face_on(job: "Job") -> None:
    """Refuse to finish with a tool that no torque of its motor presses."""
    if job.problem.spin != ():
        raise ValueError(
            "tool.spin must be left out, as no torque of the axis presses a tool that turns about its own"
            " axis; its motion can be written as a program: --program"
        )
    if job.problem.face_on:
        raise ValueError(
            "tool.contact_angle must be < 90 deg, as no torque of the axis presses a tool that is face-on;"
            " its motion can be written as a program: --program"
        )


def tell_beyond(job: Any) -> None:
    """Say on standard error that the model tells no roughness of what will be finished, where it does not."""
    from hwsim.command._finishing.report import beyond_line

    if told := beyond_line(job.problem, float(job.stand.target_force)):
        tell(told)


def programmed(area: Finishing, title: str, job: Any, arguments: argparse.Namespace) -> str:
    """Plan or load the motion, write it and its program, and return what the program keeps."""
    import sdpgrind
    from hwsim.command._finishing.report import corner_lines, placement_lines

    folder = arguments.out
    if arguments.plan is None:
        announce("planning")
        motion = area.plan(job, arguments, arguments.plan_progress)
    else:
        motion = sdpgrind.load(arguments.plan)
    program = motion.program(arguments.program, **job.program)
    found = program.check()
    folder.mkdir(parents=True, exist_ok=True)
    file = f"{program.name}{program.ending}"
    program.save(folder / file, overwrite=False)
    motion.save(folder / "motion.nc")
    lines = [
        f"{title}: {motion!r}",
        *placement_lines(motion.problem),
        *corner_lines(motion),
        f"program: {program!r}",
        f"read back: {found.deviation:.4f} mm and {found.angle_deviation:.2g} rad from the plan",
        "not run on a controller: try it slowly, above the work",
    ]
    return with_kept("\n".join(lines), folder, ["motion.nc", file])


def studied(title: str, job: Any, arguments: argparse.Namespace) -> str:
    """Run the experiment, write its files where a folder is given, and return its report."""
    from hwsim._study.study import finishing_study

    settings = {"method": job.method, "kind": job.settings.get("kind", "lqg"), **job.study}
    if arguments.confirm is not None:
        settings["confirm"] = arguments.confirm
    folder = arguments.out
    announce("planning and running an experiment")
    found = finishing_study(
        job.stand, rng=arguments.rng, folder=folder, progress=arguments.plan_progress, **settings
    )
    text = f"{title}: {found.report(rng=arguments.rng)}"
    return text if folder is None else with_kept(text, folder, _keep(folder, found, text, arguments))


def _keep(folder: Path, found: Any, text: str, arguments: argparse.Namespace) -> list[str]:
    """Write report, confirmation log and pictures; the journals of all runs exist already."""
    with whole_file(folder / "study.txt") as temporary:
        Path(temporary).write_text(f"{text}\n")
    found.confirmation.save(folder / "confirm.nc")
    things = {"study.png": found, "confirm.png": found.confirmation}
    pictures = [] if arguments.no_pictures else drawn(folder, things)
    page = paged(folder, found.study.report)
    return ["study.txt", "run-01.db ... run-18.db", "confirm.db", "confirm.nc", *pictures, *page]


AREA = Finishing()
