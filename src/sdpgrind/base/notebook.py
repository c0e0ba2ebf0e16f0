"""Notebooks: a caption and small tables for an object, escaped."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

MOST = 30  # chosen: rows of a table; more push the next cell of a notebook off the screen

Rows = Iterable[Sequence[str]]


def table(caption: str, head: Sequence[str], rows: Rows) -> str:
    """Return a table in HTML; of more than `MOST` rows the last says how many are left out."""
    every = [tuple(row) for row in rows]
    shown = every if len(every) <= MOST else every[: MOST - 1]
    body = [_row("td", row) for row in shown]
    if left := len(every) - len(shown):
        body.append(_row("td", (f"… {left} more", *("",) * (len(head) - 1))))
    caption = f"<caption>{escape(caption)}</caption>"
    return "\n".join(["<table>" + caption, _row("th", head), *body, "</table>"])


def _row(cell: str, texts: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{cell}>{escape(text)}</{cell}>" for text in texts) + "</tr>"


def tables(caption: str, blocks: Iterable[Any]) -> str:
    """Return the tables among the blocks of a page, with their units and sentences, below a caption."""
    from sdpgrind.base.sheets.blocks import AmountTable, Sentences, scales_of

    found = list(blocks)
    scales, shown = scales_of(found), [f"<p>{escape(caption)}</p>"]
    for block in found:
        if isinstance(block, AmountTable):
            shown.append(table(block.caption, block.head(scales), block.rows(scales)))
        elif isinstance(block, Sentences):
            shown += [f"<p>{escape(line)}</p>" for line in block.lines]
    return "\n".join(shown)


def columns(caption: str, dataset: "xr.Dataset") -> str:
    """Return the variables of a dataset, each with its unit, number of values, least, median and greatest."""
    head = ("name", "unit", "values", "least", "median", "greatest")
    return table(caption, head, [_column(name, dataset[name]) for name in dataset.variables])


def _column(name: Any, variable: "xr.DataArray") -> tuple[str, ...]:
    unit = str(variable.attrs.get("units", ""))
    known = variable.values[~np.isnan(variable.values)] if variable.dtype.kind == "f" else variable.values
    ends = ["", "", ""]
    if variable.dtype.kind in "fiu" and known.size:
        ends = [f"{number:.6g}" for number in (known.min(), np.median(known), known.max())]
    return (str(name), "" if unit == "1" else unit, str(variable.size), *ends)
