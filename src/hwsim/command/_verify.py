"""``hwsim verify report.html ...``: whether pages are as they were; ``--rerun DIR``: make one again."""

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hwsim.command.base import AreaCommand

Parse = Callable[[list[str]], argparse.Namespace]
UNCHECKED = 2  # exit status of a page that cannot be checked; source: that of wrong input to a command
DIFFERENT = 1  # exit status of a page that was changed or comes out otherwise; chosen: 2 is wrong input
_SHOWN = "--live"  # switch of a command that changes nothing but what is shown


def add_verify(subparsers: Any, areas: Mapping[str, AreaCommand], parse: Parse) -> None:
    """Add the command to the subparsers; `parse` reads the arguments of a command of an area."""
    parser = subparsers.add_parser(
        "verify",
        help="check that no number of the pages of reports was changed, or make one again",
        description="Recompute the digests of reports; name what was changed since they were written.",
        epilog="With --rerun the job that stands in the page is planned and run again, and compared to the "
        "bit; other versions than those of the page are told first, and differences counted. Exit status: "
        "0 all as they were, 1 one changed or different, 2 one not to be checked.",
    )
    parser.add_argument(
        "pages", type=Path, nargs="+", metavar="report.html", help="pages of logs, plans or profiles"
    )
    parser.add_argument(
        "--rerun", type=Path, metavar="DIR", help="make plan and log of the one page again in this new folder"
    )
    parser.set_defaults(work=partial(work, areas, parse))


def work(areas: Mapping[str, AreaCommand], parse: Parse, arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, 1 where something differs, 2 as `_checked`."""
    from hwsim._report.verified import read

    pages, folder = arguments.pages, arguments.rerun
    if folder is not None and len(pages) > 1:
        raise ValueError(f"--rerun makes one page again; got {len(pages)}: give it one report.html")
    if len(pages) > 1:
        return max(map(_checked, pages))
    if (status := _check(pages[0])) or folder is None:
        return status
    data = read(pages[0])
    _rerun(data, folder, areas, parse)
    return _compared(data, folder)


def _checked(page: Path) -> int:
    """Check one of several pages: one that cannot be checked (2) does not keep the others from it."""
    try:
        return _check(page)
    except (OSError, ValueError) as error:
        print(f"{page}: not checked, {error}", flush=True)
        return UNCHECKED


def _check(page: Path) -> int:
    """Print what was changed in a page, or that nothing was."""
    from hwsim._report.verified import verified

    found = verified(page)
    for change in found:
        print(f"{page}: {change}")
    if not found:
        print(f"{page}: as it was written, every number and picture", flush=True)
    return DIFFERENT if found else 0


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
    """Arguments of the command of a page, its own options alone; its files are written into the folder."""
    command = job["command"]
    found = [area.name, f"--out={folder}", f"--parts={job['parts']}"]
    valued = ("--preset", "--rng", "--tolerance", *area.counts)
    given = {option: command.get(_named(option)) for option in (*valued, *area.switches)}
    found += [f"{option}={given[option]}" for option in valued if given[option] is not None]
    found += [option for option in area.switches if given[option] and option != _SHOWN]
    if command.get("no_pictures"):
        found.append("--no-pictures")
    for option in area.files:
        if (name := command.get(_named(option))) is not None:  # the page itself may have this name
            found.append(f"{option}={folder / (option.removeprefix('--') + Path(name).suffix)}")
    if command["toml"] is not None:
        file = folder / "problem.toml"
        file.write_text(command["toml"], encoding="utf-8", newline="")
        found.append(str(file))
    return found


def _named(option: str) -> str:
    """Name of an option in a page."""
    return option.removeprefix("--").replace("-", "_")


def _compared(data: Mapping[str, Any], folder: Path) -> int:
    from hwsim._report.again import compared, differences
    from hwsim._report.remade import PAGE
    from hwsim._report.verified import read

    found = differences(data, read(folder / PAGE))
    for difference in found:
        print(f"{folder}: {difference}")
    if not found:
        print(f"{folder}: equal to the bit ({'; '.join(compared(data))})")
    return DIFFERENT if found else 0
