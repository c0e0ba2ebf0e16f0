"""``hwsim finishing --study``: the experiment, its report and its folder."""

import argparse
from pathlib import Path
from typing import Any

from hwsim._study.study import finishing_study


def studied(title: str, job: Any, arguments: argparse.Namespace) -> str:
    """Make the experiment, keep it where a folder is given, and say what came of it."""
    from hwsim.command.base import announce
    from sdpgrind.base.progress import TerminalLine

    settings = {"method": job.method, "kind": job.settings.get("kind", "lqg"), **job.study}
    if arguments.plan is not None:
        raise ValueError("--motion must be left out with --study, which plans motions of its own")
    if arguments.parts is not None:
        raise ValueError(f"--parts must be left out with --study (--confirm is of the runs that confirm); got {arguments.parts}")
    if arguments.confirm is not None:
        settings["confirm"] = arguments.confirm
    folder = _folder(arguments.out)
    announce("planning and running an experiment")
    found = finishing_study(job.stand, rng=arguments.rng, folder=folder, progress=TerminalLine(), **settings)
    text = f"{title}: {found.report(rng=arguments.rng)}"
    return text if folder is None else f"{text}\n\nkept in {folder}: {', '.join(_keep(folder, found, text, arguments))}"


def _folder(path: Path | None) -> Path | None:
    if path is not None and path.exists() and not path.is_dir():
        raise ValueError(f"--out must be a folder; {path} is a file")
    return path


def _keep(folder: Path, found: Any, text: str, arguments: argparse.Namespace) -> list[str]:
    """Write report, log of the confirmation and picture; journals of all runs are there already."""
    from sdpgrind.base.records import whole_file

    with whole_file(folder / "study.txt") as temporary:
        Path(temporary).write_text(f"{text}\n")
    found.confirmation.save(folder / "confirm.nc")
    drawn = [] if arguments.no_pictures else _drawn(folder, found)
    return ["study.txt", "run-01.db ... run-18.db", "confirm.db", "confirm.nc", *drawn]


def _drawn(folder: Path, found: Any) -> list[str]:
    """Draw what can be drawn; without matplotlib the experiment is still kept."""
    from hwsim.command._run_folder import drawn

    return drawn(folder, {"study.png": found, "confirm.png": found.confirmation})
