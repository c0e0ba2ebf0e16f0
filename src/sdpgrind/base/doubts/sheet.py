"""Doubts on a page for colleagues and in a notebook: intervals as a table, the rest as the text says it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sdpgrind.base import notebook
from sdpgrind.base.doubts.asked_of import data_lines
from sdpgrind.base.doubts.page import (
    believed,
    named,
    remarks,
    stake_cells,
    stake_lines,
    summary,
    told,
    told_rows,
    verdict,
)
from sdpgrind.base.sheets.amounts import Amounts, Interval
from sdpgrind.base.sheets.blocks import AmountTable, Block, Sentences

_ROUNDING = 1e-9  # chosen: an interval is cut at a bound where its halves differ by more

HEADS = ("value", "believed", "told by the data (95 %)", "verdict")


def blocks(doubts: Any) -> Iterator[Block]:
    """Yield summary, table of intervals, and what else the text says."""
    yield Sentences([*data_lines(doubts), summary(doubts.rows)], strong=True)
    amounts = []
    for row in told_rows(doubts.rows):
        half = row.high - row.told
        ended = row.told - row.low < (1 - _ROUNDING) * half
        interval = Interval(row.told, half, row.low if ended else -np.inf)
        amounts.append(Amounts.of(row.name, [row.believed, interval, verdict(row)], row.unit))
    if amounts:
        yield AmountTable("What the data tell", amounts, HEADS)
    yield from map(Sentences, remarks(doubts.rows, doubts.sentences))
    if doubts.figure:
        yield Sentences(stake_lines(doubts.figure, doubts.stakes))
        if cells := stake_cells(doubts.figure, doubts.stakes):
            yield AmountTable(
                "What the plan makes of it", [Amounts.of(x, y) for x, *y in cells[1:]], cells[0]
            )


def table(doubts: Any) -> str:
    """Return the rows as a table for a notebook."""
    cells = [
        (named(row), believed(row), told(row) if np.isfinite(row.told) else "", verdict(row))
        for row in doubts.rows
    ]
    return notebook.table(repr(doubts), HEADS, cells)
