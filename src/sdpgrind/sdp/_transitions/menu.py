"""Move on a grid: rows of controls, and named tuples for callbacks."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.coordinates import Levels, Stages
from sdpgrind.sdp._problem.grid import Grid, Ints, record
from sdpgrind.sdp._problem.moves import Move
from sdpgrind.sdp._problem.problem import Problem

SCANNED, SKIPPED = 50, 8  # chosen: levels scanned, most levels to one of them; a coarser scan misses minima


def levels_of(levels: Levels) -> tuple[Floats, Ints, int]:
    """Return the levels, the first index of each regime (and the last of all), and the stride of the scan.

    The share of a regime is the mean of those by length and by number; its levels are Chebyshev-Lobatto
    points, dense at its ends, where the optimum often lies.
    """
    inside = sorted({float(b) for b in levels.breaks if levels.low < b < levels.high})
    ends = [levels.low, *inside, levels.high]
    if levels.high == levels.low or levels.count == 1:
        return np.array([levels.low]), np.array([0, 0]), 1
    if not levels.search:
        grid = np.unique([*np.linspace(levels.low, levels.high, levels.count), *inside])
        return grid, np.searchsorted(grid, ends), 1
    stride = min(SKIPPED, 2 ** max(0, int(np.log2(levels.count / SCANNED))))
    share = (np.diff(ends) / (levels.high - levels.low) + 1 / (len(ends) - 1)) / 2
    cells = stride * np.maximum(1, np.round(share * (levels.count - 1) / stride).astype(int))
    pieces = [
        a + (b - a) * (1 - np.cos(np.pi * np.arange(k) / k)) / 2
        for a, b, k in zip(ends, ends[1:], cells, strict=False)
    ]
    return np.append(np.concatenate(pieces), levels.high), np.concatenate([[0], np.cumsum(cells)]), stride


@dataclass(frozen=True)
class Menu:
    """Move of a problem on a grid; its rows are all pairs (entry of the lists, level)."""

    problem: Problem
    grid: Grid
    index: int

    @property
    def move(self) -> Move:
        """The move."""
        return self.problem.moves[self.index]

    @cached_property
    def _levels(self) -> tuple[Floats, Ints, int]:
        levels = self.move.levels
        return (np.array([np.nan]), np.array([0, 0]), 1) if levels is None else levels_of(levels)

    @property
    def levels(self) -> Floats:
        """Values of the continuous control; one NaN without."""
        return self._levels[0]

    @property
    def regimes(self) -> Ints:
        """First level of each regime, and the last level of all."""
        return self._levels[1]

    @property
    def stride(self) -> int:
        """Distance between scanned levels."""
        return self._levels[2]

    @property
    def search(self) -> bool:
        """Whether controls between the levels are allowed."""
        return self.move.levels is not None and self.move.levels.search

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.move.choices * self.levels.size

    @cached_property
    def into(self) -> Ints | None:
        """Mode on arrival for each entry of the lists; None: unchanged."""
        move, names = self.move, self.problem.modes
        if move.into is None:
            return None
        into = [move.into] * move.choices if isinstance(move.into, str) else list(move.into)
        return np.array([names.index(name) for name in into])

    def row_controls(self) -> Any:
        """Return ``c`` with one entry for each row."""
        return self.controls(
            np.repeat(np.arange(self.move.choices), self.levels.size), np.tile(self.levels, self.move.choices)
        )

    def controls(self, choice: Ints, level: Floats) -> Any:
        """Return ``c`` for entries of the lists and values of the continuous control."""
        fields = {
            name: (level if name == self.move.level_name else self.move.lists[name][choice])
            for name in self.move.controls
        }
        return record("C", tuple(fields))(**fields)

    def state(
        self, coordinates: Sequence[Any], mode: Any = None, stage: Any = None, without: str | None = None
    ) -> Any:
        """Return ``s``: coordinates (except the axis `without`), stage coordinate if timed, mode if given."""
        fields = {a.name: x for a, x in zip(self.grid.axes, coordinates, strict=True) if a.name != without}
        if self.move.timed and stage is not None:
            assert isinstance(self.problem.stages, Stages)  # checked by Problem
            fields[self.problem.stages.name] = stage
        if mode is not None:
            fields["mode"] = mode
        return record("S", tuple(fields))(**fields)

    def penalty(self, s: Any, c: Any) -> Any:
        """Return the in-path charge, $; infinite where the move is not allowed."""
        move = self.move
        charge = move.charge(s, c) if callable(move.charge) else move.charge
        if np.any(np.isnan(np.asarray(charge, dtype=float))):
            raise ValueError(
                f"move {move.name!r}: charge must be a number ($), infinite where it is not allowed; got NaN"
            )
        return charge if move.allowed is None else np.where(move.allowed(s, c), charge, np.inf)
