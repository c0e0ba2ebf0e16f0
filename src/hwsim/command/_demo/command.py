"""``hwsim demo``: from the file of a measured bore to doubts, a plan, simulated parts and a report."""

import argparse
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hwsim.command._run_folder import refuse_no_folder
from hwsim.command._times import Outlook

BORE = Path(__file__).with_name("bore.csv")
PARTS = 5  # chosen: enough to see that parts differ, in a tenth of a second
_NEXT = ("what it says about the machine", "the fastest cycle", "simulated parts and the report", "done")
_ENDS = (0.25, 0.5, 0.55, 1.0)  # measured: shares of the CPU time of a warm run at which the steps end
_COLUMNS: dict[str, Any] = {"time": "t", "size": "X", "command_rate": "v", "grinding_power": "P"}


def add_demo(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "see the whole way once: file, doubts, plan, simulated parts, report"
    parser = subparsers.add_parser(
        "demo",
        help=about,
        description="Read the trace of a bore, tell what it says about the machine, plan the fastest cycle "
        "for that machine, grind five simulated parts, and write a report. The same in Python: "
        "docs/commissioning/bore.py.",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", default=Path("demo"), help="its folder (demo)")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status 0."""
    outlook = Outlook.alone("demo")
    outlook.foretell()
    out = arguments.out
    refuse_no_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    from sdpgrind.base.progress import Speaker, reported

    with Speaker(known=(outlook.whole, outlook.compiling)) as line, reported(line) as tell:
        for end, text, following in zip(_ENDS, _steps(out), _NEXT, strict=True):
            print(text, flush=True)
            tell(end, following)
    return 0


def _steps(out: Path) -> Iterator[str]:
    """Go the way; give a text after each step."""
    import hwsim
    from sdpgrind import plunge

    file = Path(shutil.copyfile(BORE, out / BORE.name))
    log = hwsim.Log.read(file, **_COLUMNS)
    yield f"1. The file\n\n{log.source}\n"
    problem = plunge.preset("simulation")
    doubts = problem.doubts(log)
    yield f"2. What it says about the machine\n\n{doubts}\n"
    lag = plunge.identify(log, "time_constant")
    mine = problem.replace(linear_time_constant=lag["time_constant"])  # as the doubts advise
    plan = plunge.plan(mine)
    yield f"3. The fastest cycle for this machine\n\n{plan}\n"
    run = hwsim.run(hwsim.PlungeGrinder(mine), plunge.CycleController(mine), parts=PARTS, rng=0)
    kept = [BORE.name, *_kept(out, doubts=doubts, plan=plan, run=run)]
    yield _summary(out, log, lag, plunge.plan(problem), plan, run, kept)


def _kept(out: Path, *, doubts: Any, plan: Any, run: Any) -> list[str]:
    """Write files and pages, and return their names."""
    doubts.to_csv(out / "doubts.csv")
    plan.save(out / "cycle.nc")
    run.save(out / "run.nc")
    try:
        plan.report(out / "plan.html")
        run.report(out / "report.html", plan=plan)
    except ImportError as error:
        return ["doubts.csv", "cycle.nc", "run.nc", f"no pages ({error})"]
    return ["doubts.csv", "cycle.nc", "run.nc", "plan.html", "report.html"]


def _summary(out: Path, log: Any, lag: Any, believed: Any, plan: Any, run: Any, kept: list[str]) -> str:
    """Return the last lines: a fact a line."""
    ((low, high),) = lag.interval()
    rows = log["data"].sizes["row"]
    time, confidence = run.outcome.time.values, run.outcome.attrs["confidence"]
    burned, oval = (int(run.outcome[name].values.sum()) for name in ("burned", "out_of_round"))
    page = out / "report.html"
    return "\n".join(
        [
            f"file     {BORE.name}: {rows} readings of size, commanded rate and power, units from its header",
            f"machine  time constant {lag['time_constant']:.3f} s, 95 % from {low:.3f} to {high:.3f} s;"
            f" believed {believed.problem.time_constant:.3f} s",
            f"plan     {plan.time:.2f} s a part; with the machine as believed {believed.time:.2f} s;"
            f" burn threshold {plan.problem.uncertainty.burn_threshold}",
            f"run      {PARTS} simulated parts, confidence {confidence:g}: {time.mean():.2f} s on average,"
            f" the slowest {time.max():.2f} s; {burned or 'none'} burned, {oval or 'none'} out of round",
            "",
            f"kept in {out}: {', '.join(kept)}",
            f"next     open {page} in a browser; hwsim verify {page} checks it;",
            "         your own file: docs/data.rst, or hwsim.Log.read(path, time=..., size=...)",
        ]
    )
