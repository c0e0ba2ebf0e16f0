"""Blocks of the page of a log that was read: what was read, its ranges, its picture, each part."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Picture, Sentences
from sdpgrind.base.tables import names_of_parts


def of_file(log: Any) -> Iterator[Block]:
    """Yield verdict, range of each column, and picture."""
    table = log[log.tiers[0]]
    rows, seconds = table.sizes["row"], float(np.sum(log.outcome.duration.values))
    parts = counted(len(log), "part")
    yield Sentences(
        [f"{counted(rows, 'row')} of {parts} read from {log.outcome.attrs['plant']}, {seconds:.4g} s in all"],
        strong=True,
    )
    ranges = [_range(name, table[name]) for name in _numbers(table)]
    yield AmountTable("What was read", ranges, ("quantity", "readings", "least", "median", "greatest"))
    yield Heading("Pictures")
    yield Picture(f"All {parts}" if len(log) > 1 else "The part", log.plot)


def each_part(log: Any, shown: int) -> list[Amounts]:
    """Return columns with name, duration, rows and ranges of the first parts."""
    table, outcome = log[log.tiers[0]], log.outcome
    names = names_of_parts(table) or list(map(str, range(shown)))
    columns = [
        Amounts.of("part", names[:shown]),
        Amounts.of("duration", outcome.duration.values[:shown], "s"),
        Amounts.of("rows", outcome.rows.values[:shown].astype(int)),
    ]
    edges = np.searchsorted(table.part.values, np.arange(shown + 1))
    for name in _numbers(table):
        ends = [_ends(table[name].values[a:b]) for a, b in pairwise(edges)]
        unit, words = str(table[name].attrs.get("units", "")), _words(name, table[name])
        columns += [
            Amounts.of(str(name), column, unit, f"{words}, {end}")
            for end, column in zip(("least", "greatest"), zip(*ends, strict=True), strict=True)
        ]
    return columns


def _numbers(table: Any) -> list[Any]:
    """Names of the columns of numbers."""
    return [name for name in table.data_vars if table[name].dtype.kind in "fiu"]


def _range(name: Any, variable: Any) -> Amounts:
    known: Floats = variable.values[np.isfinite(variable.values)]
    least, greatest = _ends(known)
    middle = float(np.median(known)) if known.size else math.nan
    values, unit = [int(known.size), least, middle, greatest], str(variable.attrs.get("units", ""))
    return Amounts.of(str(name), values, unit, _words(name, variable))


def _words(name: Any, variable: Any) -> str:
    """Words of a column: of a command without saying so twice."""
    return str(variable.attrs.get("long_name", name)).replace("_", " ")


def _ends(values: Floats) -> tuple[float, float]:
    """Least and greatest reading; NaN: there is none."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)
