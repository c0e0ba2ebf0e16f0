"""Rows of motions of a run: each motion once, at its first command; later commands of it have its digest."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hwsim._part.motions import Column, command_column, digest_name, is_of_rows, tier_and_name
from hwsim._part.part import LivePart

ROWS_MAX = 1_000_000  # chosen: some 60 MB in a file, and 140 different paths of a robot


@dataclass
class KeptMotions:
    """Digests whose rows earlier parts of the run hold, and the number of those rows."""

    _known: set[tuple[str, float]] = field(default_factory=set)
    _rows: int = 0

    def of(self, part: LivePart) -> LivePart:
        """Return a part without the rows of motions that earlier parts hold, or that exceed the limit."""
        tables = {key: table for key, table in part.tables.items() if not is_of_rows(key)}
        for key in part.tables.keys() - tables.keys():
            if (kept := self._kept(key, part.tables)).any():
                tables[key] = {name: values[kept] for name, values in part.tables[key].items()}
        return replace(part, tables={key: tables[key] for key in part.tables if key in tables})

    def _kept(self, key: str, tables: Mapping[str, Mapping[str, Column]]) -> Column:
        """Mask of the rows of a table of motions that this part keeps."""
        kept = np.zeros(tables[key]["time"].size, dtype=bool)
        for told, here in _motions(key, tables):
            if (key, told) not in self._known and self._rows + here.sum() <= ROWS_MAX:
                self._known.add((key, told))
                self._rows += int(here.sum())
                kept |= here
        return kept


def _motions(key: str, tables: Mapping[str, Mapping[str, Column]]) -> Iterator[tuple[float, Column]]:
    """Digest of each motion of a part and the mask of its rows."""
    tier, name = tier_and_name(key)
    digests = dict(
        zip(tables[tier]["time"].tolist(), tables[tier][command_column(digest_name(name))], strict=True)
    )
    time = tables[key]["time"]
    yield from ((float(digests[when]), time == when) for when in np.unique(time).tolist())
