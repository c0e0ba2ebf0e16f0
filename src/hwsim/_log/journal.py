"""The journal of a run: one SQLite file, one transaction a part, readable at any time.

It uses SQLite's rollback journal, not its write-ahead log: between two parts the one file is complete and can
be copied. A process killed inside a transaction loses that part only; the next reader rolls it back.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self

from hwsim._log import journal_file
from hwsim._log.acts import OperatorAct
from hwsim._log.fingerprint import fingerprint, former
from hwsim._log.journal_file import OLD, Row
from hwsim._log.labels import Labels
from hwsim._log.log import Log
from hwsim._log.packed import outcome_json, packed, unpacked
from hwsim._part.part import LivePart
from sdpgrind.base import checks
from sdpgrind.base.records import warn_of_old


class SecondWriterError(RuntimeError):
    """Two runs write the same journal."""


class Journal:
    """Finished parts of a run, on disk.

    ``run(..., journal=path)`` writes it; it can be read while the run goes on and after it was killed. The
    table ``part`` has the outcome of each part as JSON: ``sqlite3 run.db "SELECT number, outcome FROM
    part"``. Each part has a digest that depends on all parts before it: what is read is what was written.

    Parameters
    ----------
    path : str or path
        An existing journal.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    DamagedFileError
        When the file is not as it was written, here or when its parts are read; it names the last good part.
    ValueError
        When the file is no journal, or one of a later version.

    Warns
    -----
    OldFileWarning
        When the file is of version 0.1.0, which wrote no digests.

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
        self._database = journal_file.connected(self.path)
        try:
            self._run = journal_file.run_rows(self._database, self.path)
            self._old = journal_file.version(self._run, self._database, self.path) == OLD
            self._labels, self._prints = journal_file.described(self._run, self.path)
        except BaseException:
            self.close()
            raise
        if self._old:
            warn_of_old(path)

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
            "version": journal_file.VERSION,
            "fingerprints": json.dumps({name: fingerprint(thing) for name, thing in ingredients.items()}),
            "labels": labels.to_json(),
        }
        journal_file.create(path, rows)
        return cls(path)

    @property
    def parts(self) -> int:
        """Number of finished parts."""
        count = journal_file.count(self._database)
        return count if count >= 0 else len(self._rows())  # which tells what is wrong

    @property
    def has_digests(self) -> bool:
        """Whether damage can be seen; False: a journal of version 0.1.0 (private to this package)."""
        return not self._old

    def log(self) -> Log:
        """Log of the finished parts; ValueError when there is none."""
        parts = list(self.read())
        if not parts:
            raise ValueError(f"{str(self.path)!r} holds no finished part yet")
        return Log.of(parts, self._labels)

    def refuse_other(self, ingredients: Mapping[str, Any]) -> None:
        """Refuse a run of other ingredients than those of the journal (private to this package)."""
        written = self._prints
        if other := [name for name, thing in ingredients.items() if not _is_print(written.get(name), thing)]:
            begun = f"{str(self.path)!r} was begun with another {' and '.join(other)}"
            raise ValueError(f"journal must be of this run; {begun}")

    def read(self, limit: int = -1) -> Iterator[LivePart]:
        """Give the first `limit` finished parts; -1: all. All are checked (private to this package)."""
        rows = self._rows()
        return (unpacked(names, arrays) for _, _, names, arrays in rows[: limit if limit >= 0 else None])

    def _rows(self) -> list[Row]:
        """All parts, as they were at one moment; acts of the operator are checked, too."""
        database, run = self._database, self._run
        with journal_file.consistent(database, self.path):
            if self._old:
                return list(journal_file.good_old_rows(database))
            rows = list(journal_file.good_rows(database, run))
            journal_file.acts(database, run)
            return rows

    def add(self, number: int, part: LivePart, acts: Sequence[OperatorAct] = ()) -> None:
        """Write a part and what the operator did durably, in one transaction (private to this package).

        It takes the place of an aborted last part of the same number.
        """
        row = (number, outcome_json(part), *packed(part, deflate=not self._old))
        told = _texts(acts)
        if self._old:
            written = journal_file.append_old(self._database, row)
        else:
            written = journal_file.append(self._database, row, told)
        if not written:
            raise SecondWriterError(
                f"part {number} is in {str(self.path)!r} already: another run is writing there"
            )

    def note(self, acts: Sequence[OperatorAct]) -> None:
        """Write what the operator did where no part follows (private to this package)."""
        journal_file.note(self._database, _texts(acts))

    def ready_for_clock(self) -> None:
        """Refuse a run against the clock into a journal of version 0.1.0 (private to this package)."""
        if self._old:
            raise ValueError(
                "journal must be a new file for a run against the clock; "
                f"{str(self.path)!r} is of version 0.1.0"
            )

    @property
    def acts(self) -> tuple[OperatorAct, ...]:
        """What the operator did in runs against the clock: part, civil and monotonic time (ns), who, what."""
        with journal_file.consistent(self._database, self.path):
            told = [] if self._old else journal_file.acts(self._database, self._run)
        return tuple(OperatorAct(*json.loads(text)) for text in told)

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<hwsim.Journal: {self.parts} parts in {str(self.path)!r}>"


def _texts(acts: Sequence[OperatorAct]) -> list[str]:
    return [json.dumps(act) for act in acts]


def _is_print(written: str | None, thing: Any) -> bool:
    """Whether a fingerprint in a journal, perhaps of version 0.1.0, is that of an ingredient."""
    return written == fingerprint(thing) or written == former(thing)
