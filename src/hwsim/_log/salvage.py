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

# source: sqlite.org/fileformat2.html, section 1.3; offset and length of a field, bytes
_MAGIC, _HEADER, _PAGE_SIZE, _PAGES = b"SQLite format 3\0", 100, (16, 2), (28, 4)
_LONGEST = 1 << 34  # bytes; chosen: far above any journal, and a hole takes no space on the disk
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
        run = _run_rows(database, path)
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


def _run_rows(database: sqlite3.Connection, path: Path) -> dict[str, str]:
    try:
        return journal_file.run_rows(database, path)
    except DamagedFileError as error:
        raise DamagedFileError(path, error.wrong, "no part of it can be salvaged") from None


def _copied(path: Path, folder: Path) -> sqlite3.Connection:
    """A copy of a journal: SQLite undoes a broken transaction in the file that it opens."""
    for end in ("", _ROLLBACK):
        if (file := path.with_name(path.name + end)).exists():
            shutil.copyfile(file, folder / f"copy{end}")
    _lengthen(folder / "copy")
    return journal_file.connected(folder / "copy")


def _lengthen(copy: Path) -> None:
    """Put zeros where the end is missing: SQLite opens no file that is shorter than its header says."""
    with copy.open("r+b") as file:
        header = file.read(_HEADER)
        size, pages = (int.from_bytes(header[at : at + length]) for at, length in (_PAGE_SIZE, _PAGES))
        if header.startswith(_MAGIC) and copy.stat().st_size < size * pages <= _LONGEST:
            file.truncate(size * pages)


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
