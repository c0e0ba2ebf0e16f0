"""The good parts of a damaged journal, written to a new one; the damaged file is never changed."""

import contextlib
import shutil
import sqlite3
import tempfile
from pathlib import Path

from hwsim._log import journal_file
from hwsim._log.journal_file import VERSION, BrokenError, Row
from sdpgrind.base.damaged import DamagedFileError
from sdpgrind.base.whole_files import whole_file

_ROLLBACK = "-journal"  # what SQLite appends to the name of the file that undoes a broken transaction


def salvage(path: Path, target: Path) -> int:
    """Write the parts before the damage to a new journal and return their number.

    Parameters
    ----------
    path : path
        The damaged journal.
    target : path
        The new journal; it must not exist.

    Raises
    ------
    ValueError
        When `target` exists or `path` is no journal.
    DamagedFileError
        When there is no good part, or the table of the run is damaged.
    """
    if target.exists():
        raise ValueError(f"--salvage must be a new file; {str(target)!r} exists")
    with tempfile.TemporaryDirectory() as folder, contextlib.closing(_copied(path, Path(folder))) as database:
        run = journal_file.run_rows(database, path)
        rows, wrong = _good(database, run)
        acts = _good_acts(database, run)
    if not rows:
        raise DamagedFileError(path, wrong, "no part of it can be salvaged")
    journal_file.described(run, path)
    with whole_file(target) as temporary:
        journal_file.create(temporary, {**journal_file.own(run), "version": VERSION})
        with contextlib.closing(journal_file.connected(temporary)) as database:
            for number, row in enumerate(rows):
                journal_file.append(database, row, acts if number == 0 else ())
    return len(rows)


def _copied(path: Path, folder: Path) -> sqlite3.Connection:
    """A copy of a journal: SQLite undoes a broken transaction in the file that it opens."""
    for end in ("", _ROLLBACK):
        if (file := path.with_name(path.name + end)).exists():
            shutil.copyfile(file, folder / f"copy{end}")
    return journal_file.connected(folder / "copy")


def _good(database: sqlite3.Connection, run: dict[str, str]) -> tuple[list[Row], str]:
    """The parts before the damage, and what is wrong."""
    old = journal_file.is_old(run, database)
    found = journal_file.good_old_rows(database) if old else journal_file.good_rows(database, run)
    rows: list[Row] = []
    try:
        for row in found:
            rows.append(row)  # noqa: PERF402 those before the damage stay
    except BrokenError as broken:
        return rows, broken.wrong
    return rows, "it holds no part"


def _good_acts(database: sqlite3.Connection, run: dict[str, str]) -> list[str]:
    """What the operator did; none where it is not as it was written."""
    with contextlib.suppress(BrokenError):
        return [] if journal_file.is_old(run, database) else journal_file.acts(database, run)
    return []
