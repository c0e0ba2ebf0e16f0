"""``hwsim weldbead``: plan a job (or load its policy), grind beads on a simulated stand, report."""

import argparse
import dataclasses
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hwsim._fingerprint import fingerprint
from hwsim._weldbead_report import report

if TYPE_CHECKING:
    from hwsim._log import Log
    from hwsim._weldbead_jobs import Job

_HELP = "plan a weld-bead grinding job and run it, pass by pass, on a simulated stand"
_MORE = """
Three tiers run: the sequence asks for a depth, the pass planner turns it into heights and forces along the scanned bead,
a force loop follows them 60 times a second. With --simple the sequence runs alone; what a pass takes off is drawn.

With --out the policy, the log, the journal and pictures are kept in a folder. Killed? The same command goes on after
the last finished bead, with the results that it would have had; a finished run is reported again.
"""


def add_to(areas: Any) -> None:
    """Add the command to the parser's subparsers."""
    parser = areas.add_parser("weldbead", help=_HELP, description=_HELP.capitalize() + ".", epilog=_MORE)
    parser.add_argument("problem", nargs="?", type=Path, metavar="problem.toml", help="the job (mm, s, N, J, W)")
    parser.add_argument("--preset", help="a ready problem instead of a file: P1 ... P5, C0")
    parser.add_argument("--simple", action="store_true", help="the sequence alone, on a stand of one draw a pass")
    parser.add_argument("--policy", type=Path, metavar="p.nc", help="follow this saved policy instead of planning")
    parser.add_argument("--parts", type=int, default=20, metavar="N", help="number of beads (20)")
    parser.add_argument("--rng", type=int, default=0, metavar="S", help="seed of the random numbers (0)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep everything in this folder")
    parser.add_argument("--tolerance", type=float, help="of the plan's expected penalty, $ (1e-5, or what suits greater charges)")
    parser.add_argument("--no-pictures", action="store_true", help="draw nothing")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> None:
    """Do what the command line asks for."""
    job, given = _job(arguments)
    _check_numbers(arguments)
    out: Path | None = arguments.out
    if out is not None:
        _check_folder(out, job, given)
        _check_journal(out, plant=job.stand, rng=arguments.rng)
    policy = _policy(job, given, arguments)
    if out is not None:
        _check_journal(out, controller=job.controller(policy))
        out.mkdir(parents=True, exist_ok=True)
        if not (out / "policy.nc").exists():
            policy.save(out / "policy.nc")
    log = _run(job, policy, arguments)
    kept = [] if out is None else _keep(out, log, policy, pictures=not arguments.no_pictures)
    print(report(_title(arguments), log, policy, job.start))
    if len(log) > arguments.parts:
        print(f"\n{out} held {len(log)} finished beads already: all of them are reported, not {arguments.parts}")
    if out is not None:
        print(f"\nkept in {out}: {', '.join(kept)}")


def _keep(out: Path, log: "Log", policy: Any, *, pictures: bool) -> list[str]:
    """Write log and pictures; give the names of everything in the folder."""
    log.save(out / "run.nc")
    return ["policy.nc", "run.nc", "run.db", *(_pictures(out, log, policy) if pictures else [])]


def _title(arguments: argparse.Namespace) -> str:
    return str(arguments.problem or arguments.preset or arguments.policy)


def _check_numbers(arguments: argparse.Namespace) -> None:
    from sdpgrind.base import checks

    checks.count("--parts", arguments.parts)
    checks.count("--rng", arguments.rng, at_least=0)
    if arguments.tolerance is not None:
        checks.positive("--tolerance", arguments.tolerance, "$")


def _job(arguments: argparse.Namespace) -> tuple["Job", Any]:
    """The stand with its controller, and the policy where one is given."""
    from hwsim._weldbead_jobs import job_of

    if arguments.problem is not None and arguments.preset is not None:
        raise ValueError("either problem.toml or --preset must be given, not both")
    policy = _loaded(arguments.policy) if arguments.policy is not None else None
    if arguments.problem is None and arguments.preset is None:
        if policy is None:
            raise ValueError("problem.toml, --preset or --policy must be given; try: hwsim weldbead --preset P1")
        return job_of(policy.problem, simple=arguments.simple), policy
    job = _job_of_file(arguments) if arguments.preset is None else _job_of_preset(arguments)
    if policy is not None and policy.problem != job.problem:
        changed = _differences(policy.problem, job.problem)
        raise ValueError(f"--policy {arguments.policy} is for another problem: {changed} differs")
    return job, policy


def _job_of_preset(arguments: argparse.Namespace) -> "Job":
    from hwsim._weldbead_jobs import job_of
    from sdpgrind import weldbead

    return job_of(weldbead.preset(arguments.preset), simple=arguments.simple)


def _job_of_file(arguments: argparse.Namespace) -> "Job":
    from hwsim._weldbead_toml import read

    return read(arguments.problem, simple=arguments.simple)


def _loaded(path: Path) -> Any:
    import sdpgrind
    from sdpgrind import weldbead

    policy = sdpgrind.load(path)
    if not isinstance(policy, weldbead.SequencePolicy):
        raise ValueError(f"--policy must be a saved policy of a weld bead; {path} holds a {type(policy).__name__}")
    return policy


def _differences(one: Any, other: Any) -> str:
    """Names of the fields in which two problems differ."""
    names = [field.name for field in dataclasses.fields(one)]
    return ", ".join(name for name in names if getattr(one, name) != getattr(other, name))


def _check_folder(out: Path, job: "Job", given: Any) -> None:
    """Refuse a folder that holds something else before anything is computed."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"--out must be a folder; {out} is a file")
    kept = _kept_policy(out)
    if kept is None:
        return
    if kept.problem != job.problem:
        changed = _differences(kept.problem, job.problem)
        raise ValueError(f"--out {out} holds a run of another problem ({changed} differs): choose another folder")
    if given is not None and fingerprint(given) != fingerprint(kept):
        raise ValueError(f"--out {out} holds a run of another policy: choose another folder")


def _kept_policy(out: Path | None) -> Any:
    return _loaded(out / "policy.nc") if out is not None and (out / "policy.nc").exists() else None


def _check_journal(out: Path, **ingredients: Any) -> None:
    """Refuse a folder whose journal is of another run before anything is written there."""
    from hwsim._journal import Journal

    if (out / "run.db").exists():
        with Journal(out / "run.db") as journal:
            journal.refuse_other({name: fingerprint(thing) for name, thing in ingredients.items()})


def _finished(out: Path | None) -> int:
    """Number of beads in the journal of a folder: none of them is thrown away."""
    from hwsim._journal import Journal

    if out is None or not (out / "run.db").exists():
        return 0
    with Journal(out / "run.db") as journal:
        return journal.parts


def _policy(job: "Job", given: Any, arguments: argparse.Namespace) -> Any:
    """The policy that is given, that is kept in the folder, or a new one; no less exact than was asked for."""
    asked: float | None = arguments.tolerance
    if given is not None:
        if asked is not None:
            _check_error(given, asked, f"--policy {arguments.policy}", "plan anew, without --policy")
        return given
    kept = _kept_policy(arguments.out)
    if kept is None:
        return _planned(job, asked)
    if asked is not None:
        _check_error(kept, asked, f"--out {arguments.out}", "choose another folder or tolerance")
    return kept


def _check_error(policy: Any, asked: float, where: str, advice: str) -> None:
    """Refuse a policy that is not known to be as exact as `asked` ($)."""
    if policy.error is None or policy.error > asked:
        known = "of unknown error" if policy.error is None else f"known to {policy.error:.2g} $"
        raise ValueError(f"{where} holds a policy {known}, --tolerance asks for {asked:g} $: {advice}")


def _planned(job: "Job", tolerance: float | None) -> Any:
    """A new policy; how exact it is without a tolerance that was asked for, the report says."""
    from sdpgrind import weldbead
    from sdpgrind.base.progress import TerminalLine

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return weldbead.plan(job.problem, tolerance="auto" if tolerance is None else tolerance, progress=TerminalLine())


def _run(job: "Job", policy: Any, arguments: argparse.Namespace) -> "Log":
    from hwsim._loop import run
    from sdpgrind.base.progress import TerminalLine

    journal = None if arguments.out is None else arguments.out / "run.db"
    parts, rng = max(arguments.parts, _finished(arguments.out)), arguments.rng
    return run(job.stand, job.controller(policy), parts=parts, rng=rng, journal=journal, progress=TerminalLine())


def _pictures(out: Path, log: "Log", policy: Any) -> list[str]:
    """Draw what can be drawn; without matplotlib the run is still kept."""
    from sdpgrind.base.extras import need
    from sdpgrind.base.records import whole_file

    try:
        pyplot = need("matplotlib.pyplot", "plot")
    except ImportError as error:
        return [f"no pictures ({error})"]
    pyplot.switch_backend("agg")
    for name, figure in (("policy.png", policy.plot()), ("run.png", log.plot())):
        with whole_file(out / name) as temporary:
            figure.savefig(temporary, format="png", dpi=150)
        pyplot.close(figure)
    return ["policy.png", "run.png"]
