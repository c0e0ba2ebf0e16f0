"""``hwsim verify report.html``: whether a page is as it was written; ``--rerun DIR``: make it again."""

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hwsim.command.base import AreaCommand

Parse = Callable[[list[str]], argparse.Namespace]
DIFFERENT = 1  # exit status of a page that was changed or comes out otherwise; chosen: 2 is wrong input
_SHOWN = "--live"  # switch of a command that changes nothing but what is shown


def add_verify(subparsers: Any, areas: Mapping[str, AreaCommand], parse: Parse) -> None:
    """Add the command to the subparsers; `parse` reads the arguments of a command of an area."""
    parser = subparsers.add_parser(
        "verify",
        help="check that no number of a page of a report was changed, or make it again",
        description="Recompute the digests of a report; name what was changed since it was written.",
        epilog="With --rerun the job that stands in the page is planned and run again, and compared to the "
        "bit; other versions than those of the page are told first, and differences counted. Exit status: "
        "0 as it was, 1 changed or different, 2 not to be checked.",
    )
    parser.add_argument("page", type=Path, metavar="report.html", help="page of a log, a plan or a profile")
    parser.add_argument(
        "--rerun", type=Path, metavar="DIR", help="make plan and log again in this new folder"
    )
    parser.set_defaults(work=partial(work, areas, parse))


def work(areas: Mapping[str, AreaCommand], parse: Parse, arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, or 1 where something is different."""
    from hwsim._report.verified import read, verified

    found = verified(arguments.page)
    for change in found:
        print(f"{arguments.page}: {change}")
    if not found:
        print(f"{arguments.page}: as it was written, every number and picture", flush=True)
    if found or arguments.rerun is None:
        return DIFFERENT if found else 0
    data = read(arguments.page)
    _rerun(data, arguments.rerun, areas, parse)
    return _compared(data, arguments)


def _rerun(data: Mapping[str, Any], folder: Path, areas: Mapping[str, AreaCommand], parse: Parse) -> None:
    """Tell what is different here, then make plan, log and page in a new folder."""
    from hwsim._report.again import other_versions
    from hwsim._report.job import JOB
    from hwsim._report.remade import make, refuse_unable
    from sdpgrind.base.extras import need

    need("jinja2", "report")
    refuse_unable(data)
    area = _area(data[JOB]["command"], areas) if JOB in data else None
    _refuse_used(folder)
    for sentence in other_versions(data):
        print(f"before it starts: {sentence}", flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    if area is None:
        make(data, folder)
    else:
        again = parse(_arguments(area, data[JOB], folder))
        again.work(again)


def _area(command: Mapping[str, Any] | None, areas: Mapping[str, AreaCommand]) -> AreaCommand | None:
    """The area of the command of a page; None: its run was started by a program."""
    if command is None:
        return None
    if command["area"] not in areas:
        raise ValueError(f"--rerun needs a page of an area of hwsim; got {command['area']!r}")
    area = areas[command["area"]]
    if (file := command.get(area.plan_word)) is not None:
        told = f"the {area.plan_word} of this one came from {file!r}"
        raise ValueError(f"--rerun needs a page that holds its whole job; {told}")
    return area


def _refuse_used(folder: Path) -> None:
    """Refuse a folder in which a run would go on instead of being made again."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"--rerun must be a new or an empty folder; got {str(folder)!r}")


def _arguments(area: AreaCommand, job: Mapping[str, Any], folder: Path) -> list[str]:
    """Arguments of the command of a page, its own options alone; its file is written into the folder."""
    command = job["command"]
    found = [area.name, f"--out={folder}", f"--parts={job['parts']}"]
    valued = ("--preset", "--rng", "--tolerance", *area.counts)
    given = {option: command.get(_named(option)) for option in (*valued, *area.switches)}
    found += [f"{option}={given[option]}" for option in valued if given[option] is not None]
    found += [option for option in area.switches if given[option] and option != _SHOWN]
    if command["toml"] is not None:
        file = folder / "problem.toml"
        file.write_text(command["toml"], encoding="utf-8", newline="")
        found.append(str(file))
    return found


def _named(option: str) -> str:
    """Name of an option in a page."""
    return option.removeprefix("--").replace("-", "_")


def _compared(data: Mapping[str, Any], arguments: argparse.Namespace) -> int:
    from hwsim._report.again import compared, differences
    from hwsim._report.remade import PAGE
    from hwsim._report.verified import read

    found = differences(data, read(arguments.rerun / PAGE))
    for difference in found:
        print(f"{arguments.rerun}: {difference}")
    if not found:
        print(f"{arguments.rerun}: equal to the bit ({'; '.join(compared(data))})")
    return DIFFERENT if found else 0
