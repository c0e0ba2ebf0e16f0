"""A text read with one separator and one decimal sign: cells, their kinds, the run with most numbers."""

from collections import Counter
from collections.abc import Collection, Sequence
from typing import NamedTuple

from sdpgrind.base.columns import cells


class TextGuess(NamedTuple):
    """Cells of the lines, their kinds as of `cells.kind`, and what the longest run of numbers holds."""

    separator: str
    decimal: str
    rows: Sequence[Sequence[str]]
    kinds: Sequence[str]
    run: Sequence[int]  # lines of the run with most numbers
    told: tuple[int, int]  # numbers in it, and words less than none
    grouped: int  # numbers of it that stand in groups of three

    @property
    def width(self) -> int:
        """Number of cells in a row of the run."""
        return len(self.kinds[self.run[0]])


def guess_of(
    lines: Sequence[str], separator: str, decimal: str, missing: Collection[str], cells_least: int = 2
) -> TextGuess | None:
    """What the lines are with this separator and decimal sign; None: no row of enough cells with a number."""
    if separator == " " and any(map(cells.has_stamp, lines)):
        return None  # the blank between a date and its time separates nothing
    rows = [cells.split(line, separator) if line.strip() else [] for line in lines]
    kinds = ["".join("e" if c in missing else cells.kind(c, decimal) for c in row) for row in rows]
    runs: list[list[int]] = [[]]
    for k, each in enumerate(kinds):
        if not rows[k]:
            continue
        if runs[-1] and len(kinds[runs[-1][-1]]) != len(each):
            runs.append([])
        if len(each) >= cells_least and ("n" in each or "g" in each or "t" in each):
            runs[-1].append(k)
        elif runs[-1]:
            runs.append([])
    counts = [Counter("".join(kinds[k] for k in run)) for run in runs]
    numeric = [count["n"] + count["g"] + count["t"] for count in counts]
    best = max(range(len(runs)), key=lambda k: numeric[k])
    if not runs[best]:
        return None
    told = numeric[best], -counts[best]["w"]
    return TextGuess(separator, decimal, rows, kinds, runs[best], told, counts[best]["g"])


def numeric_columns(guess: TextGuess) -> list[bool]:
    """Columns that hold numbers or times in most rows of the run."""
    columns = [Counter(column) for column in zip(*(guess.kinds[k] for k in guess.run), strict=True)]
    return [c["n"] + c["g"] + c["t"] > c["w"] for c in columns]
