"""Rows of a part: equal ones, two at one time, falls of time, gaps, alignment of commands."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.columns.commands import held
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.table import is_command
from sdpgrind.base.warned import warn

GAP = 3.0  # chosen: medians of the step above which a step is a gap; fewer would note a jitter of the clock
_FULL = [2.0**bits / ticks for bits in (16, 32) for ticks in (1, 1e3, 1e6)]
"""Seconds after which a counter begins again; derived."""
_TICKS = 3  # derived: two of them whose first row is known
_MERGED = 0.5  # chosen: share of the rows at the times of others from which on the clock is too coarse


class PartRows(NamedTuple):
    """Rows of one part: time (s), columns, and the place of each row in its file."""

    label: str
    where: str
    time: Floats
    columns: Mapping[str, Column]
    row: npt.NDArray[np.int64]
    place: Callable[[int], str]
    ready: bool = False  # at common instants already

    def only(self, kept: Bools | npt.NDArray[np.int64] | slice, label: str | None = None) -> "PartRows":
        """Some of the rows."""
        columns = {name: values[kept] for name, values in self.columns.items()}
        return self._replace(
            label=self.label if label is None else label,
            time=self.time[kept],
            columns=columns,
            row=self.row[kept],
        )

    def at(self, k: int) -> str:
        """Row or line in the file."""
        return self.place(int(self.row[k]))


def without_equal(block: PartRows) -> PartRows:
    """Leave out each row that is equal to the one before in every column, time included."""
    if not np.any(block.time[1:] == block.time[:-1]):
        return block
    same = block.time[1:] == block.time[:-1]
    for values in block.columns.values():
        both_missing = (values[1:] != values[1:]) & (values[:-1] != values[:-1])
        same &= (values[1:] == values[:-1]) | both_missing
    return block.only(np.concatenate([[True], ~same]))


def restarts(block: PartRows, on_restart: str, named: bool = False) -> list[PartRows]:
    """Parts of a block: one, or one from each fall of its time on; `named`: by a column of parts."""
    falls = np.flatnonzero(np.diff(block.time) < 0)
    if not falls.size:
        return [block]
    if on_restart == "refuse":
        k = int(falls[0])
        which = f" within part {block.label!r}" if named else " within a part"
        column = "another column of parts" if named else 'part="header" of the part\'s number'
        raise ValueError(
            f"{block.where}: time must rise{which} (s); got {float(block.time[k])!r} and then"
            f' {float(block.time[k + 1])!r} in {block.at(k + 1)}: {column}, or on_restart="new part"'
            f"{of_a_clock(block.time[k] - block.time[k + 1])}{_of_a_counter(block.time, k)}"
        )
    edges = [0, *(falls + 1).tolist(), block.time.size]
    return [block.only(slice(a, b)) for a, b in pairwise(edges)]


def of_a_clock(step: float) -> str:
    """What to add to a refusal where time leaps by an hour, forth or back (s)."""
    if abs(step - 3600.0) > 60.0:  # chosen: a minute; rows are seldom farther apart
        return ""
    return "; an hour: daylight saving? Take stamps in UTC, or with their zone"


def _of_a_counter(time: Floats, k: int) -> str:
    """What to add where a counter of 16 or 32 bits begins again, in ticks of 1 s, ms or us: no part does."""
    step = float(np.median(np.diff(time)))
    span = float(time[k] - time[k + 1]) + step
    full = next((each for each in _FULL if abs(span - each) < step), None)
    if full is None:
        return ""
    return (
        f"; a counter that is full? Add {full:.10g} s to the rows from there on, or say period={step:.3g} (s)"
    )


def one_a_time(block: PartRows, duplicates: str) -> PartRows:
    """Merge different rows at one time as asked, keep or refuse them."""
    again = np.diff(block.time) == 0
    if duplicates == "keep" or not np.any(again):
        return block
    if duplicates == "refuse":
        k, step = int(np.argmax(again)), _even_step(block)
        told = 'duplicates="first", "last" or "mean", or "keep" for the rows of motions'
        if step:  # of a row for each tick the times would be those of the ticks
            even = f"period={step:.3g} (s) instead of time=, if the rows are evenly spaced"
            told = f'{even}, or duplicates="keep" for the rows of motions'
        raise ValueError(
            f"{block.where}: time must rise from row to row (s); {float(block.time[k])!r} stands in"
            f" {block.at(k)} and, with other values, in {block.at(k + 1)}: {told}"
        )
    first = np.flatnonzero(np.concatenate([[True], ~again]))
    if duplicates == "mean":
        means = {name: _means(values, first) for name, values in block.columns.items()}
        return block.only(first)._replace(columns=means)
    return block.only(first if duplicates == "first" else np.append(first[1:], block.time.size) - 1)


def warn_of_most(blocks: Sequence[PartRows], duplicates: str) -> None:
    """Warn once where most rows of parts share their time with others, as of a clock of whole seconds."""
    coarse = [block for block in blocks if not block.ready and _is_coarse(block)]
    if duplicates == "keep" or not coarse:
        return
    rows, steps = sum(block.time.size for block in coarse), [*filter(None, map(_even_step, coarse))]
    times, more = [np.unique(block.time) for block in coarse], ""
    if steps:
        tick = max(float(np.median(np.diff(each))) for each in times if each.size > 1)
        more = (
            f", which are known to {tick:.3g} s alone; if the rows are evenly spaced,"
            f" period={np.median(steps):.3g} (s) instead of time= keeps them all"
        )
    warn(
        f"{coarse[0].where}: duplicates={duplicates!r} leaves {sum(map(len, times))} of {rows} rows, as the"
        f" others stand at the same times{more}"
    )


def _is_coarse(block: PartRows) -> bool:
    """Whether most rows share their time with others."""
    return np.unique(block.time).size <= (1 - _MERGED) * block.time.size


def _even_step(block: PartRows) -> float:
    """Step (s) of rows whose clock counts in coarser steps than they come; 0: the clock is not coarse.

    Counted in rows of the file, as equal ones are left out, from the second tick to the last, whose first row
    is there.
    """
    first = np.flatnonzero(np.diff(block.time, prepend=-np.inf))
    if not _is_coarse(block) or first.size < _TICKS:
        return 0.0
    begin, end = first[1], first[-1]
    return float((block.time[end] - block.time[begin]) / (block.row[end] - block.row[begin]))


def _means(values: Column, first: npt.NDArray[np.int64]) -> Column:
    """Means of runs of rows, without missing ones; words: the first."""
    if values.dtype.kind != "f":
        return values[first]
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        sums = np.add.reduceat(np.where(known, values, 0.0), first)
        return np.asarray(sums / np.add.reduceat(known.astype(float), first))


def gaps(block: PartRows) -> list[tuple[float, float]]:
    """Time and length (s) of each step of more than three medians; rows at one time are one instant."""
    time = np.unique(block.time)
    steps = np.diff(time)
    return [(float(time[k]), float(steps[k])) for k in np.flatnonzero(wide(steps))]


def wide(steps: Floats) -> Bools:
    """Which steps of a time (s) are gaps."""
    return np.asarray(steps > GAP * np.median(steps)) if steps.size > 1 else np.zeros(steps.size, bool)


def aligned(block: PartRows, commands_at: str) -> PartRows:
    """Commands as they hold from their row on, from such as led to it ("end") or are means about it."""
    if commands_at == "begin":
        return block
    columns = {
        name: held(values, commands_at) if is_command(name) and values.dtype.kind == "f" else values
        for name, values in block.columns.items()
    }
    return block._replace(columns=columns)
