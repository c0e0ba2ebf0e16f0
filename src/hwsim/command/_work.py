"""Command of an area: its arguments, the plan that is made or loaded, the run, its page and report."""

import argparse
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hwsim.command._machine import Stage, add_machine, check_machine, staged
from hwsim.command._run_folder import RunFolder, differences, paged, with_kept
from hwsim.command._statuses import FAILED, OK, ended, of_signal, say
from hwsim.command._times import UNKNOWN, Outlook
from hwsim.command.base import AreaCommand, Job
from sdpgrind.base.brief import counted
from sdpgrind.base.progress import Speaker, portion, redraw, reported, silent

if TYPE_CHECKING:
    from hwsim._log.log import Log


PARTS = 20  # default; chosen: the standard error of a mean is below a quarter of the scatter


def add_to(subparsers: Any, area: AreaCommand) -> None:
    """Add the command of an area to the subparsers."""
    word = area.plan_word
    parser = subparsers.add_parser(
        area.name, help=area.about, description=area.about.capitalize() + ".", epilog=area.more
    )
    parser.add_argument(
        "problem", nargs="?", type=Path, metavar="problem.toml", help=f"the job ({area.units})"
    )
    parser.add_argument("--preset", help=f"a ready problem instead of a file: {area.presets}")
    for switch, meaning in area.switches.items():
        parser.add_argument(switch, action="store_true", help=meaning)
    for count, meaning in area.counts.items():
        parser.add_argument(count, type=int, metavar="N", help=meaning)
    for choice, (meaning, *words) in area.choices.items():
        parser.add_argument(choice, choices=words, help=meaning)
    for file, (meaning, *_) in area.files.items():
        parser.add_argument(file, type=Path, metavar="FILE", help=meaning)
    parser.add_argument(
        f"--{word}",
        dest="plan",
        type=Path,
        metavar="p.nc",
        help=f"follow this saved {word} instead of planning",
    )
    parser.add_argument(
        "--parts", type=int, metavar="N", help=f"number of {area.part}s ({PARTS}; on a --machine 1)"
    )
    parser.add_argument("--rng", type=int, default=0, metavar="S", help="seed of the random numbers (0)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep everything in this folder")
    if area.tolerance:
        parser.add_argument("--tolerance", type=float, help=area.tolerance)
    parser.add_argument("--no-pictures", action="store_true", help="draw nothing")
    add_machine(parser)
    parser.set_defaults(work=partial(work, area), tolerance=None)


def work(area: AreaCommand, arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, or 1 where a part was broken off or aborted."""
    check_machine(arguments)
    simulated = arguments.serve is None and arguments.machine is None
    outlook = _foretold(area, arguments) if simulated else UNKNOWN
    live = getattr(arguments, "live", False)  # it draws on the terminal
    still = live or arguments.serve is not None  # a server has no end that could be told
    known = (0.0, 0.0) if outlook is UNKNOWN else (outlook.whole, outlook.compiling)
    shown = Speaker(shown=not still, known=known)
    with shown as line, reported(None if still else line, lambda: silent) as told:
        arguments.plan_progress = portion(told, 0.0, outlook.ends()[0])
        arguments.run_progress = portion(told, *outlook.ends())
        return _carried_out(area, arguments)


def _foretold(area: AreaCommand, arguments: argparse.Namespace) -> Outlook:
    """Say what will be done and how long it takes; wrong arguments are told later, alone."""
    parts = PARTS if arguments.parts is None else max(arguments.parts, 0)
    if any(getattr(arguments, _key(name)) is not None for name in area.choices):
        parts = 0  # none is run
    outlook = Outlook.of(area.name, arguments, parts, f"{area.plan_word}.nc")
    given = [each for each in (arguments.problem, arguments.preset, arguments.plan) if each is not None]
    there = arguments.problem is None or arguments.problem.exists()
    if outlook is not None and given and there:
        outlook.foretell(parts, area.part)
    return UNKNOWN if outlook is None else outlook


def _carried_out(area: AreaCommand, arguments: argparse.Namespace) -> int:
    area.refuse(arguments)
    job, given = _job(area, arguments)
    _check_numbers(area, arguments)
    title = str(arguments.problem or arguments.preset or arguments.plan)
    if (text := area.instead(title, job, arguments)) is not None:
        print(text)
        return 0
    if arguments.serve is not None:
        return _served(area, job, given, arguments)
    if arguments.parts is None:
        arguments.parts = PARTS if arguments.machine is None else 1
    with ExitStack() as held:
        stage = held.enter_context(staged(job.stand, arguments))
        folder = None
        if arguments.out is not None:
            folder = held.enter_context(RunFolder(arguments.out, area.plan_word, partial(_loaded, area)))
        return _ran(area, job, given, stage, folder, title, arguments)


def _served(area: AreaCommand, job: Job, given: Any, arguments: argparse.Namespace) -> int:
    """Serve the stand of the job, with a controller where it is the machine's own control."""
    from hwsim.command._serving import serve_job

    controller = None
    if arguments.own_control:
        controller = job.controller(_plan(area, job, given, None, arguments))
    return serve_job(job.stand, controller, arguments)


def _ran(
    area: AreaCommand,
    job: Job,
    given: Any,
    stage: Stage,
    folder: RunFolder | None,
    title: str,
    arguments: argparse.Namespace,
) -> int:
    """Plan, run, keep and report; return the exit status."""
    _refuse_others(job, given, stage, folder, arguments)
    plan = _plan(area, job, given, folder, arguments)
    _write_files(area, plan, arguments)
    if folder is not None:
        folder.refuse_other_run(controller=job.controller(plan))
        folder.begin(plan)
        _refuse_others(job, given, stage, folder, arguments)  # another may have begun before it was locked
        folder.refuse_other_run(controller=job.controller(plan))
    from hwsim._report.releases import missed_releases

    log, stopped = _run(area, job, plan, stage, folder, arguments)
    arguments.run_progress(1.0, "pictures and report")
    status = _status(log) if stopped is None else ended(stopped)  # before pictures: is the machine safe?
    kept = [] if folder is None else _kept(area, arguments, folder, title, log, plan)
    text = area.report(title, log, plan, job)
    if late := missed_releases(log):
        text = f"{text}\n{late}"
    if len(log) > arguments.parts:
        held = f"{folder} held {counted(len(log), f'finished {area.part}')} already"
        text = f"{text}\n\n{held}: all of them are reported, not {arguments.parts}"
    print(text if folder is None else with_kept(text, folder, kept))
    return status if stage.live is None else of_signal(stage.live.reason) or status


def _refuse_others(
    job: Job, given: Any, stage: Stage, folder: RunFolder | None, arguments: argparse.Namespace
) -> None:
    """Refuse a folder of another run."""
    if folder is not None:
        folder.refuse_other_plan(job.problem, given)
        folder.refuse_other_run(plant=stage.plant, rng=arguments.rng)


def _kept(
    area: AreaCommand, arguments: argparse.Namespace, folder: RunFolder, title: str, log: "Log", plan: Any
) -> list[str]:
    """Keep the log, its pictures and its page in the folder of the run; return what was kept."""
    pictures: dict[str, Any] = {}
    if not arguments.no_pictures:
        pictures = {f"{area.plan_word}.png": plan, "run.png": log, **area.more_pictures(log)}
    page = partial(run_page, area, arguments, title, log, plan)
    return [*folder.keep(log, pictures), *paged(folder.path, page)]


def run_page(
    area: AreaCommand, arguments: argparse.Namespace, title: str, log: "Log", plan: Any, path: Path
) -> str:
    """Write the page of a run, with the command that ran it."""
    from hwsim._report.log_page import report

    told = f"{title}: {counted(len(log), area.part)}"
    command = _told(area, arguments) if arguments.machine is None else None  # a machine runs nothing again
    return report(log, path, plan, title=told, command=command, pictures=not arguments.no_pictures)


def _told(area: AreaCommand, arguments: argparse.Namespace) -> dict[str, Any]:
    """The command as plain values, the text of its file included."""
    file: Path | None = arguments.problem
    options = [_key(name) for name in (*area.switches, *area.counts)]
    written = {_key(name): getattr(arguments, _key(name)) for name in area.files}
    return {
        "area": area.name,
        "toml": None if file is None else file.read_text(encoding="utf-8"),
        "preset": arguments.preset,
        area.plan_word: None if arguments.plan is None else arguments.plan.name,
        "parts": arguments.parts,
        "rng": arguments.rng,
        "tolerance": arguments.tolerance,
        "no_pictures": arguments.no_pictures,
        **{name: getattr(arguments, name) for name in options},
        **{name: None if path is None else path.name for name, path in written.items()},
    }


def _status(log: "Log") -> int:
    from hwsim._report.worst import broken_off

    return FAILED if any(broken_off(log.outcome)) else OK


def announce(text: str) -> None:
    """Print what begins now on standard error."""
    tell(f"{text} ...")


def tell(text: str) -> None:
    """Print a line on standard error, above the line of progress."""
    if sys.stderr.isatty():
        redraw("")
    say(text)


def _check_numbers(area: AreaCommand, arguments: argparse.Namespace) -> None:
    from sdpgrind.base import checks

    for name in ("--parts", *area.counts):
        if (given := getattr(arguments, name.removeprefix("--"))) is not None:
            checks.count(name, given)
    for name, (_, *endings) in area.files.items():
        if (path := getattr(arguments, _key(name))) is not None:
            checks.one_of(f"ending of {name}", path.suffix, endings)
    checks.whole("--rng", arguments.rng)
    if arguments.tolerance is not None:
        checks.positive("--tolerance", arguments.tolerance, area.error_unit)


def _write_files(area: AreaCommand, plan: Any, arguments: argparse.Namespace) -> None:
    """Write the files that are asked for, each by the method of the plan of its name."""
    for name in area.files:
        if (path := getattr(arguments, _key(name))) is not None:
            getattr(plan, _key(name))(path)


def _key(option: str) -> str:
    """Name of an option among the arguments."""
    return option.removeprefix("--").replace("-", "_")


def _job(area: AreaCommand, arguments: argparse.Namespace) -> tuple[Job, Any]:
    """The stand with its controller, and the given plan or None."""
    word = area.plan_word
    if arguments.problem is not None and arguments.preset is not None:
        raise ValueError("either problem.toml or --preset must be given, not both")
    plan = _loaded(area, arguments.plan) if arguments.plan is not None else None
    if arguments.problem is not None:
        job = area.read(arguments.problem, arguments)
    elif arguments.preset is not None:
        job = area.job_of(area.preset(arguments.preset), arguments)
    elif plan is not None:
        return area.job_of(plan.problem, arguments), plan
    else:
        example = f"hwsim {area.name} --preset {area.presets.split()[0].rstrip(',')}"
        raise ValueError(f"problem.toml, --preset or --{word} must be given; try: {example}")
    if plan is not None and plan.problem != job.problem:
        changed = differences(plan.problem, job.problem)
        raise ValueError(f"--{word} {arguments.plan} is for another problem: {changed} differs")
    return job, plan


def _loaded(area: AreaCommand, path: Path) -> Any:
    import sdpgrind

    plan = sdpgrind.load(path)
    if not isinstance(plan, area.plan_class()):
        saved = f"a saved {area.plan_word} of {area.made_for}"
        raise ValueError(f"--{area.plan_word} must be {saved}; {path} holds a {type(plan).__name__}")
    return plan


def _plan(
    area: AreaCommand, job: Job, given: Any, folder: RunFolder | None, arguments: argparse.Namespace
) -> Any:
    """The given plan, that in the folder, or a new one; refuse an error above the tolerance."""
    if given is not None:
        _check_error(
            area,
            given,
            arguments,
            f"--{area.plan_word} {arguments.plan}",
            f"plan anew, without --{area.plan_word}",
        )
        return given
    kept = None if folder is None else folder.plan
    if kept is None:
        announce("planning")
        return area.plan(job, arguments, arguments.plan_progress)
    _check_error(area, kept, arguments, f"--out {arguments.out}", "choose another folder or tolerance")
    return kept


def _check_error(
    area: AreaCommand, plan: Any, arguments: argparse.Namespace, where: str, advice: str
) -> None:
    """Refuse a plan whose error is unknown or above the tolerance."""
    asked, unit, word = arguments.tolerance, area.error_unit, area.plan_word
    if asked is not None and (plan.error is None or plan.error > asked):
        known = "of unknown error" if plan.error is None else f"known to {plan.error:.2g} {unit}"
        raise ValueError(f"{where} holds a {word} {known}, --tolerance asks for {asked:g} {unit}: {advice}")


def _run(
    area: AreaCommand,
    job: Job,
    plan: Any,
    stage: Stage,
    folder: RunFolder | None,
    arguments: argparse.Namespace,
) -> tuple["Log", Exception | None]:
    """Run the parts; return their log, and why they were stopped where one was aborted."""
    from hwsim._live.live import Aborted
    from hwsim._loop.loop import run

    journal = None if folder is None else folder.journal
    finished = 0 if folder is None else folder.finished
    parts = max(arguments.parts, finished)
    adapt, controller = area.adaptation(job, arguments), area.watched(job.controller(plan), job, arguments)
    if finished < parts:
        act = "listening to" if stage.live is not None and stage.live.shadow else "running"
        announce(f"{act} {counted(parts - finished, area.part)}")
    try:
        log = run(
            stage.plant,
            controller,
            parts=parts,
            rng=arguments.rng,
            adapt=adapt,
            journal=journal,
            live=stage.live,
            progress=arguments.run_progress,
        )
    except Aborted as error:
        if not len(error.log):
            raise
        return error.log, error
    return log, None
