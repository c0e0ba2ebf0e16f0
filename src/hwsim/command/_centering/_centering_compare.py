"""``hwsim centering --source``: the same parts with the source's controller and with ours."""

import argparse
from pathlib import Path
from typing import Any

_PARTS = 20


def compared(area: Any, title: str, job: Any, arguments: argparse.Namespace) -> str:
    """Run both, keep what came of it where a folder is given, and say it."""
    from hwsim._loop.compare import compare
    from hwsim.command._centering.report import side_by_side
    from hwsim.command.base import announce
    from sdpgrind.base.progress import TerminalLine

    if arguments.live:
        raise ValueError("--live must be left out with --source, which runs every part twice")
    folder = _folder(arguments.out)
    plan = _strategy(area, job, arguments)
    both = {"source": job.source(plan), "ours": job.controller(plan)}
    parts = _PARTS if arguments.parts is None else arguments.parts
    announce(f"running {parts} part{'s' if parts > 1 else ''} twice")
    log = compare(job.stand, both, parts=parts, rng=arguments.rng, progress=TerminalLine())
    text = side_by_side(title, log, plan)
    return text if folder is None else f"{text}\n\nkept in {folder}: {', '.join(_keep(folder, plan, log, arguments))}"


def _strategy(area: Any, job: Any, arguments: argparse.Namespace) -> Any:
    """The strategy that is given (of this problem, as was looked at before), or a new one."""
    import sdpgrind
    from hwsim.command.base import announce
    from sdpgrind.base.progress import TerminalLine

    if arguments.plan is not None:
        return sdpgrind.load(arguments.plan)
    announce("planning")
    return area.plan(job, arguments, TerminalLine())


def _folder(path: Path | None) -> Path | None:
    """An empty or new folder: one of another run is not written into."""
    if path is None:
        return None
    if path.exists() and not path.is_dir():
        raise ValueError(f"--out must be a folder; {path} is a file")
    if path.exists() and any(path.iterdir()):
        raise ValueError(f"--out must be a new or empty folder with --source; {path} holds something")
    return path


def _keep(folder: Path, plan: Any, log: Any, arguments: argparse.Namespace) -> list[str]:
    from hwsim.command._run_folder import drawn

    folder.mkdir(parents=True, exist_ok=True)
    plan.save(folder / "strategy.nc")
    log.save(folder / "compare.nc")
    pictures = {} if arguments.no_pictures else {"strategy.png": plan, "compare.png": log}
    return ["strategy.nc", "compare.nc", *(drawn(folder, pictures) if pictures else [])]
