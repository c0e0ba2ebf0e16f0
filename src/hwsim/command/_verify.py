"""``hwsim verify FILE ...``: whether files are as they were; ``--rerun DIR``: make a page again.

``--salvage OUT`` writes the good parts of a damaged journal.
"""

import argparse
import sqlite3
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hwsim.command._statuses import ENVIRONMENT, FAILED, OK, WRONG_INPUT
from hwsim.command.base import AreaCommand

Parse = Callable[[list[str]], argparse.Namespace]
_SHOWN = "--live"  # switch of a command that changes nothing but what is shown
_PAGES = {".html", ".htm"}


def add_verify(subparsers: Any, areas: Mapping[str, AreaCommand], parse: Parse) -> None:
    """Add the command to the subparsers; `parse` reads the arguments of a command of an area."""
    parser = subparsers.add_parser(
        "verify",
        help="check that files are as they were written, or make a page again",
        description="Recompute the digests of reports, plans, logs and journals; name what was changed since "
        "they were written.",
        epilog="With --rerun the job in the page is planned and run again, and compared to the "
        "bit; other versions than those of the page are told first, and differences counted. Exit status: "
        "0 all as they were, 1 a page changed or different, 2 a file not to be checked, 3 a damaged file.",
    )
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="pages of reports, plans, logs, journals"
    )
    more = parser.add_mutually_exclusive_group()
    more.add_argument(
        "--rerun", type=Path, metavar="DIR", help="make plan and log of the one page again in this new folder"
    )
    more.add_argument(
        "--salvage", type=Path, metavar="OUT", help="write the good parts of the one damaged journal here"
    )
    parser.set_defaults(work=partial(work, areas, parse))


def work(areas: Mapping[str, AreaCommand], parse: Parse, arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, 1 where a page differs, 2 or 3."""
    from hwsim._report.verified import read

    files, folder, target = arguments.files, arguments.rerun, arguments.salvage
    if folder is not None and len(files) > 1:
        raise ValueError(f"--rerun makes one page again; got {len(files)}: give it one report.html")
    if target is not None:
        return _salvaged(files, target)
    if len(files) > 1:
        return max(map(_checked, files))
    if (status := _check(files[0])) or folder is None:
        return status
    data = read(files[0])
    _rerun(data, folder, areas, parse)
    return _compared(data, folder)


def _salvaged(files: list[Path], target: Path) -> int:
    """Write the good parts of a damaged journal and return the exit status: the journal stays damaged."""
    from hwsim._log.salvage import salvage
    from sdpgrind.base.records import is_journal

    if len(files) > 1 or not is_journal(files[0]):
        raise ValueError(f"--salvage needs the journal of a run; got {', '.join(map(str, files))}")
    if (status := _check(files[0])) == ENVIRONMENT:
        parts = salvage(files[0], target)
        print(f"{target}: the first {parts} parts of {files[0]}", flush=True)
    else:
        print(f"{target}: not written, since no damage of {files[0]} is known", flush=True)
    return status


def _checked(file: Path) -> int:
    """Check one of several files: one that cannot be checked (2) does not keep the others from it."""
    try:
        return _check(file)
    except (OSError, ValueError, sqlite3.Error) as error:
        print(f"{file}: not checked, {error}", flush=True)
        return WRONG_INPUT


def _check(file: Path) -> int:
    """Print what was changed in a file, or that nothing was."""
    if file.suffix.lower() in _PAGES:
        return _check_page(file)
    from sdpgrind.base.damaged import DamagedFileError

    try:
        kind, sealed = _examined(file)
    except DamagedFileError as error:
        print(f"{file}: damaged, {error.wrong}; {error.salvage}", flush=True)
        return ENVIRONMENT
    if sealed:
        print(f"{file}: {kind}, as it was written", flush=True)
        return OK
    print(f"{file}: {kind}, not checked: version 0.1.0 wrote no digest; it can be read", flush=True)
    return WRONG_INPUT


def _examined(file: Path) -> tuple[str, bool]:
    """The kind of a plan, a log or a journal, and whether a digest says that it is as it was written."""
    from hwsim._log.journal import Journal
    from sdpgrind.base import records
    from sdpgrind.base.damaged import OldFileWarning

    if not file.is_file():
        raise FileNotFoundError(f"FILE must be an existing file; got {str(file)!r}")
    if not records.is_journal(file):
        return records.examine(file)
    with warnings.catch_warnings(action="ignore", category=OldFileWarning), Journal(file) as journal:
        return f"journal of {len(list(journal.read()))} parts", journal.has_digests


def _check_page(page: Path) -> int:
    """Print what was changed in a page, or that nothing was."""
    from hwsim._report.verified import verified

    found = verified(page)
    for change in found:
        print(f"{page}: {change}")
    if not found:
        print(f"{page}: as it was written, every number and picture", flush=True)
    return FAILED if found else OK


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
    return FAILED if found else OK
