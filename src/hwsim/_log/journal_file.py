"""The file of a journal: its tables, its versions, its rows read as far as they are as they were written."""

import contextlib
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from hwsim._log import chain
from hwsim._log.labels import Labels, aborted
from hwsim._log.packed import unpacked
from sdpgrind.base import records
from sdpgrind.base.damaged import DamagedFileError
from sdpgrind.base.whole_files import whole_file

VERSION, OLD = "2", "1"
"""Version that is written, and that of 0.1.0, which has no digests."""
PATIENCE = 60.0  # longest wait for a writing process, s; chosen: no part takes as long to write
_RUN, _PART = records.JOURNAL_TABLES
_SCHEMA = f"""
CREATE TABLE run ({_RUN}) WITHOUT ROWID;
CREATE TABLE part ({_PART}, names TEXT NOT NULL, arrays BLOB NOT NULL, digest TEXT NOT NULL);
CREATE TABLE act (number INTEGER PRIMARY KEY, told TEXT NOT NULL, digest TEXT NOT NULL);
"""
_ROW = (int, str, str, bytes, str)  # number, outcome, names, arrays, digest
_HEAD_OF, _ACTS_OF = (f"SELECT value FROM run WHERE key = '{key}'" for key in (chain.HEAD, chain.ACTS))
# a message of SQLite that quotes a damaged name is no UTF-8
_FAULTS = (sqlite3.Error, UnicodeDecodeError)
# faults of the computer, not of the file
_ENVIRONMENT = {
    sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_READONLY, sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR,
}  # fmt: skip
Row = tuple[int, str, str, bytes]
"""A part: number, outcome, names, arrays."""


class BrokenError(Exception):
    """The first place at which a journal is not as it was written."""

    def __init__(self, wrong: str, good: int) -> None:
        super().__init__(wrong, good)
        self.wrong, self.good = wrong, good  # good: number of parts before

    def told(self, path: str | os.PathLike[str]) -> DamagedFileError:
        """Return the error that a user sees."""
        if self.good == 0:
            return DamagedFileError(path, self.wrong, "no part of it can be salvaged")
        last = f"part {self.good - 1} is the last good one"
        command = f"hwsim verify {os.fspath(path)} --salvage good.db"
        return DamagedFileError(path, self.wrong, f"{last}; {command} writes the parts up to it")


def create(path: str | os.PathLike[str], run: Mapping[str, str]) -> None:
    """Make a journal without parts, of the rows of ``run`` but those of the chain; complete or not at all."""
    begun = chain.begun(run)
    none = chain.head(0, begun)
    rows = {**run, chain.BEGUN: begun, chain.HEAD: none, chain.ACTS: none}
    with (
        whole_file(path) as temporary,
        contextlib.closing(sqlite3.connect(temporary)) as database,
        database,
    ):
        database.executescript(_SCHEMA)
        database.executemany("INSERT INTO run VALUES (?, ?)", rows.items())


def connected(path: Path) -> sqlite3.Connection:
    """Open the database of a journal."""
    return sqlite3.connect(path.absolute(), timeout=PATIENCE, isolation_level=None)


def count(database: sqlite3.Connection) -> int:
    """Number of parts as table and head tell it; -1: they do not agree, or cannot be read."""
    try:
        parts, head = database.execute(f"SELECT (SELECT count(*) FROM part), ({_HEAD_OF})").fetchone()
    except _FAULTS:
        return -1
    return int(parts) if head is None or str(head).startswith(f"{parts}:") else -1


def append(database: sqlite3.Connection, row: Row, acts: Sequence[str] = ()) -> bool:
    """Write a part, acts of the operator and the heads in one transaction; False: not the next part.

    An aborted last part of the same number is replaced.
    """
    with database:
        database.execute("BEGIN IMMEDIATE")
        if _last_aborted(database) == row[0]:
            _drop_last(database)
        count, _, last = str(database.execute(_HEAD_OF).fetchone()[0]).partition(":")
        if int(count) != row[0]:
            return False
        digest = chain.following(last, *row)
        database.execute("INSERT INTO part VALUES (?, ?, ?, ?, ?)", (*row, digest))
        _set(database, chain.HEAD, chain.head(row[0] + 1, digest))
        _note(database, acts)
    return True


def _set(database: sqlite3.Connection, key: str, value: str) -> None:
    database.execute("UPDATE run SET value = ? WHERE key = ?", (value, key))


def note(database: sqlite3.Connection, acts: Sequence[str]) -> None:
    """Write acts of the operator in one transaction."""
    with database:
        database.execute("BEGIN IMMEDIATE")
        _note(database, acts)


def _note(database: sqlite3.Connection, acts: Sequence[str]) -> None:
    """Write acts of the operator, within a transaction."""
    count, _, last = str(database.execute(_ACTS_OF).fetchone()[0]).partition(":")
    number = int(count)
    for told in acts:
        last = chain.following_act(last, number, told)
        database.execute("INSERT INTO act VALUES (?, ?, ?)", (number, told, last))
        number += 1
    _set(database, chain.ACTS, chain.head(number, last))


def _last_aborted(database: sqlite3.Connection) -> int:
    """Number of the last part where it was aborted; -1 otherwise."""
    last = database.execute("SELECT number, outcome FROM part ORDER BY number DESC LIMIT 1").fetchone()
    return int(last[0]) if last and aborted(json.loads(last[1])) else -1


def _drop_last(database: sqlite3.Connection) -> None:
    """Remove the last part, and set the head to the one before, within a transaction."""
    database.execute("DELETE FROM part WHERE number = (SELECT max(number) FROM part)")
    begun = database.execute("SELECT value FROM run WHERE key = ?", (chain.BEGUN,)).fetchone()[0]
    last = database.execute("SELECT number, digest FROM part ORDER BY number DESC LIMIT 1").fetchone()
    number, digest = last or (-1, begun)
    _set(database, chain.HEAD, chain.head(number + 1, digest))


@contextlib.contextmanager
def consistent(database: sqlite3.Connection, path: Path) -> Iterator[None]:
    """Read at one moment; what is broken is told as a `DamagedFileError`."""
    with database:
        database.execute("BEGIN")
        try:
            yield
        except BrokenError as broken:
            raise broken.told(path) from None


def acts(database: sqlite3.Connection, run: Mapping[str, str]) -> list[str]:
    """Return the acts of the operator; `BrokenError` where one is not as it was written."""
    last, found = chain.begun(run), list[str]()
    with _readable("the parts", 0):
        good = len(list(database.execute("SELECT number FROM part")))
    with _readable("the acts of the operator", good):
        rows = database.execute("SELECT number, told, digest FROM act ORDER BY number").fetchall()
        head = database.execute(_ACTS_OF).fetchone()
    for count, (number, told, digest) in enumerate(rows):
        if number != count or not isinstance(told, str):
            raise BrokenError("the acts of the operator are not as they were written", good)
        last = chain.following_act(last, number, told)
        if digest != last:
            raise BrokenError(f"act {count} of the operator is not as it was written", good)
        found.append(told)
    if head is None or head[0] != chain.head(len(found), last):
        raise BrokenError("acts of the operator are missing", good)
    return found


def append_old(database: sqlite3.Connection, row: Row) -> bool:
    """Write a part into a journal of version 0.1.0; False: it is there already."""
    try:
        database.execute("INSERT INTO part VALUES (?, ?, ?, ?)", row)
    except sqlite3.IntegrityError:
        return False
    return True


def run_rows(database: sqlite3.Connection, path: Path) -> dict[str, str]:
    """Return the table ``run``; refuse what is no journal, and one whose table cannot be read."""
    try:
        found = dict(database.execute("SELECT key, value FROM run"))
    except _FAULTS as error:
        if _of_environment(error):
            raise
        if records.was_journal(path.read_bytes()):
            broken = BrokenError(f"its table of the run cannot be read ({error})", 0)
            raise (_whole_refused(broken, path) if _corrupt(error) else broken.told(path)) from None
        raise ValueError(f"path must be the journal of a run; {str(path)!r} is not ({error})") from None
    if not all(isinstance(text, str) for pair in found.items() for text in pair):
        raise BrokenError("its table of the run holds what is no text", 0).told(path)
    return found


def _corrupt(error: Exception) -> bool:
    """Whether SQLite refuses the whole file, as one that lost its end."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF == sqlite3.SQLITE_CORRUPT


def _whole_refused(broken: BrokenError, path: Path) -> DamagedFileError:
    command = f"hwsim verify {os.fspath(path)} --salvage good.db"
    return DamagedFileError(
        path, broken.wrong, f"{command} writes the parts before the damage, if there are any"
    )


def version(run: Mapping[str, str], database: sqlite3.Connection, path: Path) -> str:
    """Return the version of a journal from its table ``run``, whose digest must be right."""
    told = run.get("version", "")
    sealed = run.get(chain.BEGUN) == chain.begun(run)
    if is_old(run, database) or (told == VERSION and sealed):
        return told
    if sealed or not (has_digests(run) or _has_digest_column(database)):
        known = f"of version {OLD} or {VERSION}"
        raise ValueError(f"path must be a journal {known}; {str(path)!r} is of version {told or 'unknown'}")
    good = 0
    with contextlib.suppress(BrokenError):
        for number, *_ in good_rows(database, run):
            good = number + 1
    raise BrokenError("its table of the run is not as it was written", good).told(path)


def is_old(run: Mapping[str, str], database: sqlite3.Connection) -> bool:
    """Whether a journal is of version 0.1.0."""
    return run.get("version") == OLD and not (has_digests(run) or _has_digest_column(database))


def _has_digest_column(database: sqlite3.Connection) -> bool:
    """Whether the table of parts has digests, which version 0.1.0 did not write."""
    try:
        return any(row[1] == "digest" for row in database.execute("PRAGMA table_info(part)"))
    except _FAULTS:
        return False


def described(run: Mapping[str, str], path: Path) -> tuple[Labels, dict[str, str]]:
    """Labels and fingerprints of the run; those of version 0.1.0 have no digest."""
    try:
        return Labels.from_json(run["labels"]), dict(json.loads(run["fingerprints"]))
    except Exception as error:  # whatever stands in a damaged text
        raise BrokenError(f"its table of the run cannot be read ({error!r})", 0).told(path) from None


def own(run: Mapping[str, str]) -> dict[str, str]:
    """Rows of the table ``run`` but those of the chain."""
    return {key: value for key, value in run.items() if key not in chain.OWN}


def has_digests(run: Mapping[str, str]) -> bool:
    """Whether the table ``run`` has rows of the chain."""
    return any(key in run for key in chain.OWN)


def good_rows(database: sqlite3.Connection, run: Mapping[str, str]) -> Iterator[Row]:
    """Yield the parts of a journal in order; `BrokenError` at the first that is not as it was written."""
    last, count = chain.begun({**run, "version": VERSION}), 0
    for number, outcome, names, arrays, digest in _rows(database, "digest"):
        last = chain.following(last, number, outcome, names, arrays)
        if digest != last:
            raise BrokenError(f"part {count} is not as it was written", count)
        count += 1
        yield number, outcome, names, arrays
    with _readable("its head", count):
        head = database.execute(_HEAD_OF).fetchone()
    if head is None or head[0] != chain.head(count, last):
        raise BrokenError(_lost("" if head is None else str(head[0]), count), count)


def _lost(head: str, count: int) -> str:
    told = head.partition(":")[0]
    if told.isdecimal() and int(told) > count:
        return f"it had {told} parts, {count} are left"
    return f"its head is not that of its {count} parts"


def good_old_rows(database: sqlite3.Connection) -> Iterator[Row]:
    """Yield the parts of a journal of version 0.1.0 as far as they can be read."""
    for number, outcome, names, arrays, _ in _rows(database, "''"):
        try:
            unpacked(names, arrays)
        except Exception as error:  # whatever stands in a damaged part
            raise BrokenError(f"part {number} cannot be read ({error})", number) from None
        yield number, outcome, names, arrays


def _rows(database: sqlite3.Connection, digest: str) -> Iterator[tuple[int, str, str, bytes, str]]:
    """Yield the rows of the table of parts, without a gap and of the right types."""
    query, count = f"SELECT number, outcome, names, arrays, {digest} FROM part ORDER BY number", 0
    with _readable("part 0", 0):
        rows = database.execute(query)
    while True:
        with _readable(f"part {count}", count):
            row = rows.fetchone()
        if row is None:
            return
        if tuple(map(type, row)) != _ROW:
            raise BrokenError(f"part {count} is not as it was written", count)
        if row[0] != count:
            raise BrokenError(f"part {count} is missing", count)
        count += 1
        yield row


@contextlib.contextmanager
def _readable(what: str, good: int) -> Iterator[None]:
    """Turn an error of SQLite that tells of the file into a `BrokenError`."""
    try:
        yield
    except _FAULTS as error:
        if _of_environment(error):
            raise
        raise BrokenError(f"{what} cannot be read ({error})", good) from None


def _of_environment(error: Exception) -> bool:
    """Whether an error tells of the computer (full, locked), not of the file; its low byte is the kind."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF in _ENVIRONMENT
