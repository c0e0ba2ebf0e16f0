"""Codes for no reading: a value that returns, far from the rows beside it, as -9999 or 0 of a gauge."""

from collections.abc import Mapping, Sequence

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.columns.request import Bound, unit_of_name
from sdpgrind.base.columns.rows import PartRows
from sdpgrind.base.columns.table import is_command

_GAUGES = ("size", "removed", "slide", "probe", "reading", "deviation")
"""Ways and forms, which do not leap and come back to one value."""
_SPEEDS = ("mm/s", "rad/s")
"""Units of what may leap, as a rapid move does."""
_LOADS = ("W", "N", "mm^3/s")
"""Units of what is > 0 in each pass that removes metal, as a roughness is on each surface."""
_FORMS = ("reading", "deviation")
"""Quantities whose last row is beside the first, all around a ring."""
_FAR = 10.0  # chosen: usual steps of a column; those of noise alone are within 4 of them
_SHARE = 0.1  # chosen: of the range of a way; a smaller leap is a disturbance
_BACK = 0.5  # chosen: of a leap, within which a way is where it was
_USUAL = 0.75  # chosen: quantile of the steps, so that codes in each eighth row leave it as it is
_BEYOND = 5.0  # chosen: times the greatest other magnitude
_TWICE = 2  # derived: rows from which on a value returns
_MANY = 0.5  # chosen: of the rows that leap; of dust on a coarse gauge, some leap as far by chance
_FEW = 0.25  # chosen: share of the rows; more zeros are a machine that stands
_SHORT = 3  # chosen: rows; a longer run is an air cut or a pause
_TIED = 0.5  # chosen: distinct values a row, up to which a return to the digit is no surprise
_NEAR = 0.1  # chosen: of the greatest load; where there are others so small, 0 is one of them


def codes(blocks: Sequence[PartRows], bounds: Mapping[str, Bound]) -> list[str]:
    """Return a sentence on each column with a value that may mean that there is no reading."""
    found = []
    for name, each in bounds.items():
        parts = [block.columns[name] for block in blocks]
        unit = unit_of_name(each.request.name)
        if is_command(name) or unit in _SPEEDS or any(values.dtype.kind != "f" for values in parts):
            continue
        recorded = [_known(values / each.factor) for values in parts]
        above = unit in _LOADS or name == "roughness_ra"
        if told := _of_column(recorded, name) or (_of_loads(recorded) if above else None):
            (word, rows, why), header = told, each.heading.header
            found.append(
                f"column {header!r} is {word} in {rows} rows, {why}: if that is no reading,"
                f" {_cure(word, header)}"
            )
    return found


def _known(values: Floats) -> Floats:
    return values[np.isfinite(values)]


def _cure(word: str, header: str) -> str:
    """How a code becomes no reading; 0 stands in other columns, too, and so is no word of the file."""
    if float(word) != 0:
        return f'say missing=["{word}"]'
    return f"make it none in a table: table[{header!r}] = table[{header!r}].mask(table[{header!r}] == 0)"


def _of_column(known: Sequence[Floats], name: str) -> tuple[str, int, str] | None:
    """Value as a file writes it, its number of rows, and what is odd; None: no value leaps and returns."""
    every = np.concatenate(known)
    leapt = np.concatenate([_around(values) if name in _FORMS else _leaps(values) for values in known])
    values, counts = np.unique(every[leapt], return_counts=True)
    greatest = float(np.abs(every[~leapt]).max(initial=0.0))
    again = counts >= _TWICE
    if counts[again].sum() <= _MANY * counts.sum():
        return None
    for k in np.argsort(-counts, kind="stable")[: again.sum()].tolist():
        if name in _GAUGES or values[k] < -_BEYOND * greatest < 0:
            return f"{values[k]:.12g}", int(counts[k]), "far from the rows before and behind them"
    return None


def _of_loads(known: Sequence[Floats]) -> tuple[str, int, str] | None:
    """As `_of_column`, of a value that returns alone below or above loads which are all above 0."""
    every = np.concatenate(known)
    values, counts = np.unique(every, return_counts=True)
    lowest = int(np.argmax(np.where(values <= 0.0, counts, 0))) if values.size else 0
    for k in dict.fromkeys((lowest, values.size - 1)):
        others = np.delete(values, k)
        if not others.size or not _TWICE <= (rows := int(counts[k])) <= _FEW * every.size:
            continue
        odd = _is_below(values[k], others) or _is_above(values[k], others, every.size - rows)
        if odd and max(_longest(each == values[k]) for each in known) <= _SHORT:
            return f"{values[k]:.12g}", rows, odd
    return None


def _is_below(code: float, others: Floats) -> str:
    """What is odd in a value of at most 0 (else "") where no load is near 0."""
    return "and no other is near 0" if code <= 0.0 and others[0] >= _NEAR * others[-1] else ""


def _is_above(code: float, others: Floats, rows: int) -> str:
    """What is odd in the greatest value (else "") where the others, in so many rows, end far below it.

    Loads that seldom meet the same digits have no reason to do it so far above: farther than they are from
    each other. Of coarse ones, which tie by chance, it takes a multiple of the greatest.
    """
    tied = others.size <= _TIED * rows
    gap = (_BEYOND - 1.0) * others[-1] if tied else others[-1] - others[0]
    return "far above all others" if others[0] >= 0.0 and code - others[-1] > gap > 0.0 else ""


def _longest(true: Bools) -> int:
    """Rows of the longest run."""
    ends = np.flatnonzero(~np.concatenate([[False], true, [False]]))
    return int(np.diff(ends).max(initial=1)) - 1


def _around(values: Floats) -> Bools:
    """`_leaps` of a closed line."""
    twice = _leaps(np.concatenate([values, values]))
    return twice[: values.size] | twice[values.size :]


def _leaps(values: Floats) -> Bools:
    """Which rows are runs of one value with a leap before, and one back behind."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    far = np.zeros(values.size, dtype=bool)
    if edges.size < 3:
        return far
    level = values[edges]
    into, back = level[1:-1] - level[:-2], level[2:] - level[1:-1]
    leap = np.minimum(np.abs(into), np.abs(back))
    quiet = np.concatenate([[False], (into * back < 0) & (np.abs(into + back) <= _BACK * leap), [False]])
    steps = np.abs(np.diff(values))
    least = float(steps[steps > 0].min())  # of a coarse gauge most steps are 0, and its next digit is no leap
    usual = max(float(np.quantile(steps, _USUAL)), least)
    spread = float(np.subtract(*np.quantile(values, [_USUAL, 1 - _USUAL])))
    quiet[1:-1] &= (leap > _FAR * usual) & (leap > _SHARE * spread)
    return np.repeat(quiet, np.diff(np.append(edges, values.size)))
