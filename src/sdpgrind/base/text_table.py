"""Tables as plain text, in aligned columns."""

from collections.abc import Iterable, Sequence


def aligned(rows: Iterable[Sequence[str]], sides: str = "<") -> list[str]:
    """Return rows as lines, their columns two blanks apart.

    `sides`: a sign for each column, "<" left, ">" right; the last one also serves the columns after it.
    """
    table = [tuple(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    padded = [str.rjust if side == ">" else str.ljust for side in sides.ljust(len(widths), sides[-1])]
    return [
        "  ".join(pad(cell, width) for pad, cell, width in zip(padded, row, widths, strict=True)).rstrip()
        for row in table
    ]
