"""Rows of motions of a log: each motion once, at its first command; later commands of it have its digest.

A motion is known by its digest and its number of rows, which together tell its shape. Motions that a tier
commands at one time, between two events, share the rows of that time and count as one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hwsim._part.motions import (
    Column,
    command_column,
    digest_name,
    is_of_rows,
    stacked,
    tier_and_name,
    unpadded_rows,
)
from hwsim._part.part import LivePart

ROWS_MAX = 1_000_000  # chosen: some 60 MB in a file, and 140 different paths of a robot
_Commanded = tuple[tuple[float, float], ...]  # digest and number of rows of each motion at one time


@dataclass
class KeptMotions:
    """Rows that earlier parts of the log hold, by the key of their table and what was commanded."""

    _known: dict[str, dict[_Commanded, Column]] = field(default_factory=dict)
    _rows: int = 0

    def of(self, part: LivePart) -> LivePart:
        """Return a part without the rows of motions that earlier parts hold, or that exceed the limit."""
        tables = {key: table for key, table in part.tables.items() if not is_of_rows(key)}
        for key in part.tables.keys() - tables.keys():
            if (kept := self._kept(key, part.tables)).any():
                tables[key] = {name: values[kept] for name, values in part.tables[key].items()}
        return replace(part, tables={key: tables[key] for key in part.tables if key in tables})

    def whole(self, part: LivePart) -> LivePart:
        """Return a part of `of` with the rows of all its motions, except of those that exceed the limit."""
        tables: dict[str, Mapping[str, Column]] = {}
        for tier, table in part.tables.items():
            if not is_of_rows(tier):
                tables[tier] = table
                for key in self._known:
                    if tier_and_name(key)[0] == tier and (rows := self._restored(key, part.tables)):
                        tables[key] = rows
        return replace(part, tables=tables)

    def _kept(self, key: str, tables: Mapping[str, Mapping[str, Column]]) -> Column:
        """Mask of the rows of a table of motions that this part keeps."""
        known, rows = self._known.setdefault(key, {}), tables[key]
        values = rows[command_column(tier_and_name(key)[1])]
        kept = np.zeros(rows["time"].size, dtype=bool)
        for when, told in _commanded(key, tables):
            here = rows["time"] == when
            if here.any() and told not in known and self._rows + here.sum() <= ROWS_MAX:
                known[told] = unpadded_rows(values[here])
                self._rows += int(here.sum())
                kept |= here
        return kept

    def _restored(self, key: str, tables: Mapping[str, Mapping[str, Column]]) -> dict[str, Column]:
        """Rows of all known motions of a part; empty where there are none."""
        known = self._known[key]
        found = [(when, known[told]) for when, told in _commanded(key, tables) if told in known]
        if not found:
            return {}
        times, blocks = zip(*found, strict=True)
        name = command_column(tier_and_name(key)[1])
        return {"time": np.repeat(times, [len(block) for block in blocks]), name: stacked(blocks)}


def _commanded(key: str, tables: Mapping[str, Mapping[str, Column]]) -> Iterator[tuple[float, _Commanded]]:
    """Times (s) of a part at which motions with rows were commanded under a key, in order, and which."""
    tier, name = tier_and_name(key)
    digests = tables[tier].get(command_column(digest_name(name)))
    if digests is None:  # this part commands none
        return
    sizes, told = tables[tier][command_column(name)], dict[float, _Commanded]()
    for step in np.flatnonzero(~np.isnan(digests) & (sizes > 0)):
        when = float(tables[tier]["time"][step])
        told[when] = (*told.get(when, ()), (float(digests[step]), float(sizes[step])))
    yield from told.items()
