"""The journal of a run: one SQLite file, one transaction a part, readable at any time.

It uses SQLite's rollback journal, not its write-ahead log: between two parts the one file is complete and can
be copied. A process killed inside a transaction loses that part only; the next reader rolls it back.
"""

import contextlib
import json
import math
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self

import numpy as np

from hwsim._log.acts import OperatorAct
from hwsim._log.fingerprint import fingerprint, former
from hwsim._log.labels import Labels
from hwsim._log.log import Log
from hwsim._part.part import Column, LivePart
from sdpgrind.base import checks
from sdpgrind.base.records import whole_file

_SCHEMA = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE part (number INTEGER PRIMARY KEY, outcome TEXT NOT NULL, names TEXT NOT NULL, \
arrays BLOB NOT NULL);
"""
_ACTS = "CREATE TABLE IF NOT EXISTS act (part INTEGER, civil TEXT, monotonic INTEGER, who TEXT, what TEXT)"
_VERSION = "1"
_PATIENCE = 60.0  # longest wait for a writing process, s; chosen: no part takes as long to write


class SecondWriterError(RuntimeError):
    """Two runs write the same journal."""


class Journal:
    """Finished parts of a run, on disk.

    ``run(..., journal=path)`` writes it; it can be read while the run goes on and after it was killed. The
    table ``part`` has the outcome of each part as JSON: ``sqlite3 run.db "SELECT number, outcome FROM
    part"``.

    Parameters
    ----------
    path : str or path
        An existing journal.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    ValueError
        When the file is no journal.

    Examples
    --------
    >>> import hwsim, pathlib, tempfile
    >>> from sdpgrind import weldbead
    >>> class Leave:
    ...     period = None
    ...     def reset(self): ...
    ...     def step(self, **measured):
    ...         return {"stop": 1.0}
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "run.db")
    ...     log = hwsim.run(stand, Leave(), parts=2, journal=path)
    ...     with hwsim.Journal(path) as journal:
    ...         journal.parts, journal.log().outcome.passes.values
    (2, array([0., 0.]))
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = checks.path("path", path)
        if not self.path.is_file():
            raise FileNotFoundError(f"path must be an existing journal; got {str(path)!r}")
        self._database = sqlite3.connect(self.path, timeout=_PATIENCE, isolation_level=None)
        try:
            self._run = dict(self._database.execute("SELECT key, value FROM run"))
        except sqlite3.Error as error:
            self.close()
            raise ValueError(f"path must be the journal of a run; {str(path)!r} is not ({error})") from None

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Open the journal at `path`; `sdpgrind.load` calls this.

        Parameters
        ----------
        path : str or path
            An existing journal.

        Examples
        --------
        >>> import hwsim
        >>> hwsim.Journal.from_file("none.db")
        Traceback (most recent call last):
            ...
        FileNotFoundError: path must be an existing journal; got 'none.db'
        """
        return cls(path)

    @classmethod
    def create(cls, path: str | os.PathLike[str], ingredients: Mapping[str, Any], labels: Labels) -> Self:
        """Make an empty journal and open it (private to this package); the file appears complete or never."""
        rows = {
            "version": _VERSION,
            "fingerprints": json.dumps({name: fingerprint(thing) for name, thing in ingredients.items()}),
            "labels": labels.to_json(),
        }
        with (
            whole_file(path) as temporary,
            contextlib.closing(sqlite3.connect(temporary)) as database,
            database,
        ):
            database.executescript(_SCHEMA)
            database.executemany("INSERT INTO run VALUES (?, ?)", rows.items())
        return cls(path)

    @property
    def parts(self) -> int:
        """Number of finished parts."""
        return int(self._database.execute("SELECT count(*) FROM part").fetchone()[0])

    def log(self) -> Log:
        """Log of the finished parts; ValueError when there is none."""
        parts = list(self.read())
        if not parts:
            raise ValueError(f"{str(self.path)!r} holds no finished part yet")
        return Log.of(parts, Labels.from_json(self._run["labels"]))

    def refuse_other(self, ingredients: Mapping[str, Any]) -> None:
        """Refuse a run of other ingredients than those of the journal (private to this package)."""
        written = json.loads(self._run["fingerprints"])
        if other := [name for name, thing in ingredients.items() if not _is_print(written.get(name), thing)]:
            begun = f"{str(self.path)!r} was begun with another {' and '.join(other)}"
            raise ValueError(f"journal must be of this run; {begun}")

    def read(self, limit: int = -1) -> Iterator[LivePart]:
        """Give the first `limit` finished parts; -1: all (private to this package)."""
        rows = self._database.execute(
            "SELECT number, names, arrays FROM part ORDER BY number LIMIT ?", (limit,)
        ).fetchall()
        for expected, (number, names, arrays) in enumerate(rows):
            if number != expected:
                raise ValueError(f"{str(self.path)!r} lacks part {expected}")
            yield _unpacked(names, arrays)

    def add(self, number: int, part: LivePart, acts: Sequence[OperatorAct] = ()) -> None:
        """Write a part and what the operator did durably, in one transaction (private to this package)."""
        outcome = {name: _as_json(value) for name, value in part.outcome.items()}
        row = (number, json.dumps(outcome), *_packed(part))
        try:
            with self._database:
                self._database.execute("BEGIN IMMEDIATE")
                self._database.execute("INSERT INTO part VALUES (?, ?, ?, ?)", row)
                if acts:
                    self._database.execute(_ACTS)
                    self._database.executemany("INSERT INTO act VALUES (?, ?, ?, ?, ?)", acts)
        except sqlite3.IntegrityError:
            raise SecondWriterError(
                f"part {number} is in {str(self.path)!r} already: another run is writing there"
            ) from None

    def forget_aborted(self) -> None:
        """Remove a last part that was aborted, so that it is run again (private to this package)."""
        last = self._database.execute(
            "SELECT number, outcome FROM part ORDER BY number DESC LIMIT 1"
        ).fetchone()
        if last is not None and json.loads(last[1]).get("aborted") == 1.0:
            self._database.execute("DELETE FROM part WHERE number = ?", (last[0],))

    @property
    def acts(self) -> tuple[OperatorAct, ...]:
        """What the operator did in a live run: part, civil and monotonic time (ns), who, what."""
        if not self._database.execute("SELECT 1 FROM sqlite_master WHERE name = 'act'").fetchone():
            return ()
        rows = self._database.execute("SELECT part, civil, monotonic, who, what FROM act ORDER BY rowid")
        return tuple(OperatorAct(*row) for row in rows)

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<hwsim.Journal: {self.parts} parts in {str(self.path)!r}>"


def _is_print(written: str | None, thing: Any) -> bool:
    """Whether a fingerprint in a journal, perhaps of version 0.1.0, is that of an ingredient."""
    return written == fingerprint(thing) or written == former(thing)


def _as_json(value: Column) -> Any:
    """A column for JSON, with None for NaN and infinity, which JSON lacks."""
    plain = value.astype(object)
    if value.dtype.kind == "f":
        plain[~np.isfinite(value)] = None
    return plain.tolist()


def _packed(part: LivePart) -> tuple[str, bytes]:
    """Index (name, dtype, shape) and bytes of a part's arrays; names: ``tier/column``, outcomes ``/name``."""
    named: dict[str, Column] = {f"/{name}": value for name, value in part.outcome.items()}
    for tier, table in part.tables.items():
        named |= {f"{tier}/{name}": value for name, value in table.items()}
    index = [(name, value.dtype.str, value.shape) for name, value in named.items()]
    return json.dumps(index), b"".join(value.tobytes() for value in named.values())


def _unpacked(index: str, arrays: bytes) -> LivePart:
    tables: dict[str, dict[str, Column]] = {}
    outcome: dict[str, Column] = {}
    start = 0
    for key, dtype, shape in json.loads(index):
        tier, _, name = key.rpartition("/")
        value = np.frombuffer(arrays, dtype, math.prod(shape), start).reshape(shape)
        (tables.setdefault(tier, {}) if tier else outcome)[name] = value
        start += value.nbytes
    return LivePart(tables, outcome)
