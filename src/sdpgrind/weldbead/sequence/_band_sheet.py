"""The sheet of a simplified plan: bands of height by time left, for the printer and as CSV."""

import csv
import os
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from itertools import groupby, pairwise
from math import inf, nan
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.text_table import aligned
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._sheet_file import write_sheet

_COLUMNS = ("time_left [s]", "above [mm]", "up_to [mm]", "duration [s]", "normal_force [N]")


@dataclass(frozen=True)
class Band:
    """One pass, or to stop, for heights above `above` up to and with `up_to`, mm.

    Attributes
    ----------
    time_left : float
        Time left from which on it holds, up to the next one of the sheet, s.
    above, up_to : float
        Heights, mm.
    duration : float
        Duration of the pass, s; 0: stop.
    normal_force : float
        Normal force, N; NaN: stop.
    """

    time_left: float
    above: float
    up_to: float
    duration: float
    normal_force: float


@dataclass(frozen=True)
class BandSheet:
    """A simplified plan as a sheet: one line of bands (mm, s, N) for each time left.

    Made by `SimplifiedPolicy.operator_table`, or read from a CSV file by `operator_table`.

    Attributes
    ----------
    bands : tuple of Band
        By time left, and from the target up.
    sentences : tuple of str
        How the sheet is read, and what following it costs.
    """

    bands: tuple[Band, ...]
    sentences: tuple[str, ...] = ()

    @property
    def times(self) -> tuple[float, ...]:
        """Times left that have a line, rising, s."""
        return tuple(dict.fromkeys(band.time_left for band in self.bands))

    def action(self, height: float, time_left: float) -> tuple[float, float]:
        """Return duration (s; 0: stop) and force (N; NaN: stop) at a height (mm) and a time left (s).

        Above the highest band it holds; below the first time, stop.
        """
        line = self.line(time_left)
        duration, force = at_height(line, height) if height > 0 else (0.0, nan)
        return (duration, force) if duration > 0 else (0.0, nan)

    def line(self, time_left: float) -> list[tuple[float, float, float]]:
        """Return (up to, mm; duration, s; force, N) of the bands at a time left, s."""
        below = [time for time in self.times if time <= time_left + 1e-9]
        held = [band for band in self.bands if below and band.time_left == below[-1]]
        return [(band.up_to, band.duration, band.normal_force) for band in held] or [(0.0, 0.0, nan)]

    def check(self, problem: SequenceProblem) -> None:
        """Refuse durations (s) and forces (N) that a problem does not admit."""
        for band in self.bands:
            if band.duration == 0:
                continue
            checks.one_of("duration", band.duration, problem.durations)
            low, high = problem.force_interval(band.duration)
            if band.duration > band.time_left + 1e-9:
                rule = f"<= time_left, {band.time_left:g} s: the pass would end late"
                raise checks.refuse("duration", rule, band.duration, "s")
            if not low < band.normal_force <= high * (1 + 1e-9):
                rule = f"above {low:.4g} and <= {high:.4g} in a pass of {band.duration:g} s"
                raise checks.refuse("normal_force", rule, band.normal_force, "N")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file, complete or not at all: ``.csv``, ``.txt``, or ``.html`` for the printer.

        Parameters
        ----------
        path : path
            File in an existing folder. A ``.csv`` has one line a band: time left (s), heights (mm), duration
            (s), normal force (N).

        Raises
        ------
        ValueError
            For another ending.
        ImportError
            For HTML without jinja2 (extra ``report``).
        """
        write_sheet(self, path)

    def _lines(self) -> Iterator[str]:
        yield ",".join(_COLUMNS)
        for band in self.bands:
            told = [repr(value) for value in astuple(band)]
            yield ",".join([*told[:4], "" if band.duration == 0 else told[4]])

    def _rows(self) -> Iterator[tuple[str, str]]:
        for time, line in groupby(self.bands, key=lambda band: band.time_left):
            yield f"{time:g}", "; ".join(map(_cell, line))

    def _blocks(self) -> Iterator[Any]:
        from sdpgrind.base.sheets.amounts import Amounts
        from sdpgrind.base.sheets.blocks import AmountTable, Sentences

        times, cells = zip(*self._rows(), strict=True)
        columns = [
            Amounts.of("time_left", list(times), heading="time left s"),
            Amounts.of("bands", list(cells), heading="up to height mm: duration s, normal force N"),
        ]
        yield AmountTable("Next pass", columns)
        yield Sentences(self.sentences)

    def __str__(self) -> str:
        rows = [["s", "up to height mm: duration s, normal force N"], *map(list, self._rows())]
        return "\n".join(["Next pass", *aligned(rows, "<"), "", *self.sentences, ""])


def _cell(band: Band) -> str:
    if band.duration == 0:
        return f"{band.up_to:.4g}: stop"
    return f"{band.up_to:.4g}: {band.duration:g}, {band.normal_force:.4g}"


def at_height(line: list[tuple[float, float, float]], height: float) -> tuple[float, float]:
    """Duration (s) and force (N) of the band at a height, mm; above the highest, of that one."""
    _, duration, force = next((band for band in line if height <= band[0] + 1e-9), line[-1])
    return duration, force


def operator_table(path: str | os.PathLike[str]) -> BandSheet:
    """Read the sheet of a simplified plan, or a shop's own, from a CSV file.

    Parameters
    ----------
    path : path
        File with the columns ``time_left [s]``, ``above [mm]``, ``up_to [mm]``, ``duration [s]`` and
        ``normal_force [N]``; a duration of 0 s and no force: stop.

    Returns
    -------
    BandSheet
        The same bands, bit for bit; `SequencePolicy.following` tells what they cost.

    Raises
    ------
    ValueError
        When a column or its unit is missing, or bands overlap or leave a gap.
    """
    with checks.path("path", path).open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    if not rows or tuple(rows[0]) != _COLUMNS:
        raise checks.refuse(
            "first line of path", ",".join(_COLUMNS), ",".join(rows[0]) if rows else "nothing"
        )
    bands = tuple(_band(k, row) for k, row in enumerate(rows[1:], start=2))
    _refuse_gaps(bands)
    return BandSheet(bands)


def _band(line: int, row: list[str]) -> Band:
    try:
        *numbers, force = row
        time, above, up_to, duration = (_amount(each) for each in numbers)
        return Band(time, above, up_to, duration, float(force) if duration > 0 else nan)
    except ValueError:
        raise checks.refuse(
            f"line {line} of path", "five numbers >= 0, the force empty to stop", ",".join(row)
        ) from None


def _amount(text: str) -> float:
    found = float(text)
    if not 0 <= found < inf:
        raise ValueError
    return found


def _refuse_gaps(bands: tuple[Band, ...]) -> None:
    if not bands:
        raise ValueError("path must have at least one band below its first line; got none")
    lines = {time: list(line) for time, line in groupby(bands, key=lambda band: band.time_left)}
    if list(lines) != sorted(lines) or sum(map(len, lines.values())) != len(bands):
        raise checks.refuse("time_left", "rising, each in one block of lines", list(lines), "s")
    for time, line in lines.items():
        edges = [0.0, *(band.up_to for band in line)]
        starts = [band.above for band in line]
        if starts != edges[:-1] or any(high <= low for low, high in pairwise(edges)):
            rule = "bands from 0 up, each from where the one below ends: no gap, no overlap"
            raise checks.refuse(f"heights at {time:g} s", rule, [(b.above, b.up_to) for b in line], "mm")
