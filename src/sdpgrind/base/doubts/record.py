"""The record of doubts: rows, sentences and stakes; prints, is written as a table, drawn and saved."""

import csv
import io
import json
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.by_name import called
from sdpgrind.base.columns.source import Source
from sdpgrind.base.doubts.alignment import Alignment
from sdpgrind.base.doubts.asked_of import asked_of, data_lines
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake
from sdpgrind.base.records import Record
from sdpgrind.base.reported import Reported
from sdpgrind.base.whole_files import whole_file

if TYPE_CHECKING:
    import xarray as xr

    from sdpgrind.base.sheets.blocks import Block

_NUMBERS = ("told", "low", "high", "chance")


class Doubts(Reported, Record):
    """What data say about a problem, what they do not say, and what it costs not to know.

    ``problem.doubts(log)`` gives it; ``print`` shows the page. Nothing in it is a recommendation to grind.

    Attributes
    ----------
    subject : str
        Problem and data in one line.
    rows : tuple
        For each number of the model, and each assumption of the reader: ``name``, ``unit``, ``believed``,
        ``told`` by the data with its 95 % interval ``low`` to ``high``, ``verdict`` ("agrees", "differs",
        "not told", "assumed"), ``chance`` of a difference as large if the believed value is true (unit 1),
        and a ``note``: what would tell it.
    sentences : tuple of str
        What readings and residuals show, and which experiment would tell the rest.
    aligned : tuple or None
        The ``preferred`` place of a command in its row, and the ``decisiveness`` of the data, unit 1: excess
        of the second-best sum of squares in variances of the noise; from 4 on they tell. None: no commands.
    alignment : str
        The preferred place: "begin", "centre", "end" or "not sure".
    figure : tuple or None
        What a plan is judged by: ``name``, ``unit``, ``value`` with the believed model.
    stakes : tuple
        The plan solved again at both ends of each interval, largest change first: ``name``, ``low``,
        ``high``, and the figure ``at_low``, ``at_high``. Last those of several values as told: "all of them",
        or of a locus the pairs that explain the readings.
    source : Source or None
        Origin of the data: files with their SHA-256; None: not read from a file.
    parts : tuple of str
        Words of the file for the parts of the data; empty: not known.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import plunge
    >>> time = np.arange(200) * 0.05
    >>> rate = np.where(time < 4.0, 0.04, 0.0)
    >>> infeed = np.concatenate([[0.0], np.cumsum(rate[:-1] * 0.05)])
    >>> lag = 0.04 * 1.5 * (np.exp(-np.maximum(time - 4.0, 0.0) / 1.5) - np.exp(-time / 1.5))
    >>> size = infeed - lag + np.random.default_rng(0).normal(0.0, 3e-4, 200)
    >>> found = plunge.preset("simulation").doubts({"time": time, "size": size, "command_rate": rate})
    >>> found["time_constant"].verdict, round(found["time_constant"].told, 2), found.alignment
    ('differs', 1.5, 'begin')
    """

    kind = "identify.doubts"
    _title = "Doubts"

    def __init__(
        self,
        subject: str,
        rows: Sequence[Doubt],
        sentences: Sequence[str] = (),
        aligned: Alignment | None = None,
        figure: Figure | None = None,
        stakes: Sequence[Stake] = (),
        source: Source | None = None,
        parts: Sequence[str] = (),
    ) -> None:
        self.subject, self.rows, self.sentences = subject, tuple(rows), tuple(sentences)
        self.aligned, self.figure, self.stakes = aligned, figure, tuple(stakes)
        self.source, self.parts = source, tuple(parts)

    @property
    def alignment(self) -> str:
        """Alignment of the commands that the data prefer, a word without unit; empty: no commands."""
        return self.aligned.preferred if self.aligned else ""

    def __getitem__(self, name: str) -> Doubt:
        """Return the row of that name."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"name must be one of {', '.join(row.name for row in self.rows)}; got {name!r}")

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all rows as a table with a header, numbers in full, each in the unit of its row.

        Parameters
        ----------
        path : str or path
            File in an existing folder.
        """
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(Doubt._fields)
        table.writerows(self.rows)
        with whole_file(path) as temporary:
            temporary.write_text(text.getvalue(), encoding="utf-8")

    def plot(self) -> Any:
        """Draw intervals relative to believed values (unit 1), and the stakes; return the figure."""
        return pictures.drawn("sdpgrind.base.doubts.picture:drawn_doubts", self)

    def _headline(self) -> str:
        return self.subject

    def _figures(self) -> "Iterable[Block]":
        from sdpgrind.base.doubts.sheet import blocks

        return blocks(self)

    def _repr_html_(self) -> str:
        from sdpgrind.base.doubts.sheet import table

        return table(self)

    def _written(self) -> "xr.Dataset":
        import xarray as xr

        columns = {name: ("row", np.array([getattr(row, name) for row in self.rows])) for name in _NUMBERS}
        names = {
            name: ("row", [str(getattr(row, name)) for row in self.rows])
            for name in ("name", "unit", "verdict")
        }
        source = self.source and self.source.to_json()
        held = [
            self.subject,
            self.rows,
            self.sentences,
            self.aligned,
            self.figure,
            self.stakes,
            source,
            self.parts,
        ]
        return xr.Dataset(columns | names, attrs={"doubts": json.dumps(held)})

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        """Return the doubts of a `dataset` read from a file, values in their units."""
        subject, rows, sentences, aligned, figure, stakes, *data = json.loads(dataset.attrs["doubts"])
        source, parts = data or (None, ())  # not in files of earlier versions
        return cls(
            subject,
            [Doubt(*row) for row in rows],
            sentences,
            aligned and Alignment(*aligned),
            figure and Figure(*figure),
            [Stake(*stake) for stake in stakes],
            source and Source.from_json(source),
            parts,
        )

    def __str__(self) -> str:
        from sdpgrind.base.doubts.page import page

        return page(self.subject, self.rows, self.sentences, self.figure, self.stakes, data_lines(self))

    def __repr__(self) -> str:
        counts = [(word, sum(row.verdict == word for row in self.rows)) for word in ("agrees", "differs")]
        told = ", ".join(f"{count} {word}" for word, count in counts)
        return f"Doubts({self.subject}: {told} of {len(self.rows)} rows)"


def asked(function: str, problem: Any, data: Any, **options: Any) -> Doubts:
    """Return the doubts of a problem by the function named ``"package.module:function"``, with its options.

    A problem does not import what identifies its model.
    """
    found: Doubts = called(function, problem, data, **options)
    found.source, found.parts = asked_of(data)
    return found
