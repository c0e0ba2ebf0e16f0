"""The data of which doubts were asked: files with their digests, and parts."""

from typing import Any

import numpy as np

from sdpgrind.base.columns.source import Source, source_of
from sdpgrind.base.tables import names_of_parts

_MOST = 10  # parts that are listed; chosen: more fill the page


def asked_of(data: Any) -> tuple[Source | None, tuple[str, ...]]:
    """Return the origin of a log or of its table, and the words for the parts in it."""
    table = data[data.tiers[0]] if hasattr(data, "tiers") else data
    names = names_of_parts(table)
    held = np.unique(table["part"]).tolist() if names else []
    return source_of(table), tuple(names[number] for number in held)


def data_lines(doubts: Any) -> list[str]:
    """Return lines with each file and its SHA-256, and with the parts; empty: the data are of no file."""
    if doubts.source is None:
        return []
    lines = [f"Data: {note.name}, SHA-256 {note.sha256 or 'none'}" for note in doubts.source.files]
    if count := len(doubts.parts):
        more = f" and {count - _MOST} more" if count > _MOST else ""
        lines.append(f"{'Part' if count == 1 else 'Parts'}: {', '.join(doubts.parts[:_MOST])}{more}")
    return lines
