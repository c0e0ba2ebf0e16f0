"""Motions of one part of a log, each at the row of its command.

A table of rows knows the time of a command, not its row: motions that a tier commanded at one time, between
two events, stand there one after the other, and the sizes in the tier's table tell where one ends. Rows that
an earlier part holds are found by the digests and sizes of all motions at one time.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hwsim._log.log import Log, rows
from hwsim._part.motions import Column, command_column, digest_name

_At = tuple[int, float]  # part, time (s)
_Told = tuple[tuple[float, float], ...]  # digest and number of rows of each motion at one time


def motions(log: Log, tier: str, name: str, part: int) -> Iterator[tuple[int, Column]]:
    """Yield row (in the table of the part) and rows of each motion that the log holds."""
    table = rows(log, tier, name)
    if table is None:
        return
    kept = dict(_blocks(table))
    places, told = _commanded(log[tier], name)
    fitting = {at: kept[at] for at in told if at in kept and len(kept[at]) == _total(told[at])}
    known = {told[at]: block for at, block in fitting.items() if not np.isnan(told[at]).any()}
    for at, steps in places.items():
        block = fitting.get(at, known.get(told[at]))
        if at[0] == part and block is not None:
            ends = np.cumsum([size for _, size in told[at]]).astype(int)
            yield from zip(steps, np.split(block, ends[:-1]), strict=True)


def _total(told: _Told) -> float:
    return sum(size for _, size in told)


def _commanded(steps: Any, name: str) -> tuple[dict[_At, list[int]], dict[_At, _Told]]:
    """Rows of motions in the tables of their parts, and what they were, by part and time."""
    number, time = steps["part"].values, steps["time"].values
    sizes, column = steps[command_column(name)].values, command_column(digest_name(name))
    # written before digests were: a motion is known at its own time alone
    digests = steps[column].values if column in steps else np.full(sizes.size, np.nan)
    is_motion = (sizes > 0) & (~np.isnan(digests) if column in steps else True)
    places, told = dict[_At, list[int]](), dict[_At, _Told]()
    first = {each: int(np.argmax(number == each)) for each in np.unique(number).tolist()}
    for row in np.flatnonzero(is_motion).tolist():
        at = int(number[row]), float(time[row])
        places.setdefault(at, []).append(row - first[at[0]])
        told[at] = (*told.get(at, ()), (float(digests[row]), float(sizes[row])))
    return places, told


def _blocks(table: Any) -> Iterator[tuple[_At, Column]]:
    """Rows of a table of motions by part and time (s) of the command."""
    (values,) = (variable.values for variable in table.data_vars.values())
    places = np.rec.fromarrays([table["part"].values, table["time"].values])
    begins = np.flatnonzero(np.r_[True, places[1:] != places[:-1]][: places.size])
    for begin, end in zip(begins, [*begins[1:], places.size], strict=True):
        yield places[begin].tolist(), values[begin:end]
