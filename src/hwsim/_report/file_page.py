"""Blocks of the page of a log that was read from a file: what was read, its range, its picture."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Picture, Sentences


def of_file(log: Any) -> Iterator[Block]:
    """Yield verdict, range of each column, and picture."""
    table = log[log.tiers[0]]
    rows, seconds = table.sizes["row"], float(np.sum(log.outcome.duration.values))
    parts = counted(len(log), "part")
    yield Sentences(
        [f"{counted(rows, 'row')} of {parts} read from {log.outcome.attrs['plant']}, {seconds:.4g} s in all"],
        strong=True,
    )
    ranges = [_range(name, table[name]) for name in table.data_vars if table[name].dtype.kind in "fiu"]
    yield AmountTable("What was read", ranges, ("quantity", "readings", "least", "median", "greatest"))
    yield Heading("Pictures")
    yield Picture(f"All {parts}" if len(log) > 1 else "The part", log.plot)


def _range(name: Any, variable: Any) -> Amounts:
    known: Floats = variable.values[np.isfinite(variable.values)]
    ends = [float(each) for each in (known.min(), np.median(known), known.max())] if known.size else ["–"] * 3
    return Amounts.of(str(name), [int(known.size), *ends], str(variable.attrs.get("units", "")))
