"""Doubts on a page for colleagues and in a notebook: intervals as a table, the rest as the text says it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sdpgrind.base import notebook
from sdpgrind.base.doubts.page import believed, named, remarks, summary, told, told_rows, verdict
from sdpgrind.base.sheets.amounts import Amounts, Interval
from sdpgrind.base.sheets.blocks import AmountTable, Block, Listing, Sentences

HEADS = ("value", "believed", "told by the data (95 %)", "verdict")


def blocks(doubts: Any) -> Iterator[Block]:
    """Yield summary, table of intervals, and what else the text says."""
    yield Sentences([summary(doubts.rows)])
    amounts = []
    for row in told_rows(doubts.rows):
        interval = Interval(row.told, (row.high - row.low) / 2)
        amounts.append(Amounts.of(row.name, [row.believed, interval, verdict(row)], row.unit))
    if amounts:
        yield AmountTable("What the data tell", amounts, HEADS)
    yield Listing("\n\n".join(remarks(doubts.rows, doubts.sentences, doubts.figure, doubts.stakes)))


def table(doubts: Any) -> str:
    """Return the rows as a table for a notebook."""
    cells = [
        (named(row), believed(row), told(row) if np.isfinite(row.told) else "", verdict(row) or row.note)
        for row in doubts.rows
    ]
    return notebook.table(repr(doubts), HEADS, cells)
