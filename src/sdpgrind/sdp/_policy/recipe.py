"""Recipe of a policy: its look-up with small tables, and states that reach every cell."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal, TablesAsked
from sdpgrind.sdp._policy import bent_kernels
from sdpgrind.sdp._policy import exported_kernels as kernels
from sdpgrind.sdp._policy.bent_stop import bent_stop
from sdpgrind.sdp._policy.signals import controls_of, extents_of, inputs_of
from sdpgrind.sdp._policy.small_choice import small_tables
from sdpgrind.sdp._policy.small_tables import Codes
from sdpgrind.sdp._policy.table import Solution

_LATE = "NaN beyond an edge at which the process ends, and late where the plan keeps no stage of its own"
_TOLD = {
    "gap": Signal("$", "extra cost of the best other move or stop; infinite where there is none"),
    "value": Signal("$", f"expected penalty-to-go; {_LATE}"),
}
_BEYOND = 0.05  # chosen: share of an axis by which states of the self-test lie outside
_ROUNDS = 2  # chosen: states in each cell in which the action changes
_TABLES = {
    "table_frame": "first row: length of a stage, stages, first and lowest slice, whether late ones have"
    " one, endless; an axis a row: origin, spacing, logarithmic, ends, what is done beyond them",
    "table_shape": "nodes of each axis",
    "table_code": "code of the action at each node: slice, mode, node; < 0: stop",
    "table_control": "continuous control at each node: a multiple of the scale of its code, or itself",
    "table_coding": "offset and scale of the control of each code",
    "table_move": "move of each code",
    "table_first": "first cell of each slice and mode in which the action changes, and the end",
    "table_cells": "cells in which the action changes, rising in each slice and mode",
    "table_start": "first line of each such cell, and the end",
    "table_line_code": "code of each line; < 0: stop",
    "table_line_control": "its control at both ends of the cell, as at nodes",
    "table_place": "place of its costs; < 0: of those that are kept in more digits, from -1 down",
    "table_cost": "costs of lines at both ends of the cell: multiples of the scale of the code, or $",
    "table_wide": "costs of lines whose order rounding would change, $",
    "table_cost_coding": "offset and scale of costs of stops and codes, $",
    "told_kind": "what is told beside the action: 0 gap, 1 value",
    "told_told": "gap, value at each node: slice, mode, node; multiples of their scale, or $",
    "told_coding": "offset and scale, $, and what stands for infinity",
    "bent_cells": "1 where the charge of the first stop is bent within the cell: slice, mode, cell",
    "bent_extra": "$ that come to it, by mode",
    "bent_late": "$ that come to it, by slice",
    "lists": "listed controls of each code",
    "level": "number of the continuous control of each code; -1: none",
}


def recipe_of(policy: Any, asked: TablesAsked) -> Recipe:
    """Return the recipe of a `Policy`, in the units of its axes and controls, and $."""
    _check(policy)
    layout, codes, controls = policy.layout, Codes.of(policy), policy._controls
    told = asked.told(controls, tuple(_TOLD), ("gap",))
    small, notes = small_tables(policy, asked.precision, asked.lost_max, told, asked.tell)
    lists, level = _listed(policy, codes, controls)
    log, bent = any(axis.scale == "log" for axis in layout.axes), bent_stop(policy)
    step = {
        (False, False): kernels.action_at, (False, True): kernels.action_log_at,
        (True, False): kernels.action_told_at, (True, True): kernels.action_told_log_at,
    }[bool(told), log]  # fmt: skip
    if bent is not None:
        step = bent_kernels.action_told_bent_at if told else bent_kernels.action_bent_at
    before = (0.0,) * ((len(layout.modes) == 1) + layout.endless)
    behind = (*([] if bent is None else [bent]), lists, level, codes.stops, *before)
    return Recipe(
        "policy",
        step,
        inputs_of(policy),
        {**controls_of(policy), **{name: _TOLD[name] for name in told}},
        law=(*small.law, *behind),
        library_law=(*small.wide, *behind),
        after=(0.0,) * (3 - len(layout.axes)),
        tables=_TABLES,
        status=(*layout.stops, *(move.name for move in layout.moves)),
        equations="expected penalty-to-go by dynamic programming; the action of the table.",
        vectors=_TableStates(policy, small.table).chains,
        kind="sdp.Policy",
        notes=notes,
    )


def _check(policy: Any) -> None:
    """Refuse what the look-up in C does not know; name the condition that fails."""
    if policy.single is None:
        raise checks.refuse("thing", "a policy of one to three axes", len(policy.layout.axes))
    if len(policy.layout.modes) > 1 and policy.layout.endless:
        raise checks.refuse("thing", "a policy of one mode, where there is no deadline", policy.layout.modes)


def _listed(policy: Any, codes: Codes, controls: list[str]) -> tuple[Floats, Any]:
    """Listed controls of each code, [code, control], and the number of its continuous one."""
    lists, level = np.full((codes.move.size, len(controls)), np.nan), np.full(codes.move.size, -1)
    for move, first in zip(policy.layout.moves, codes.first.tolist(), strict=True):
        for name, values in move.lists:
            lists[first : first + len(values), controls.index(name)] = values
        if move.level:
            own = codes.move == codes.move[first]
            level[own] = controls.index(move.level)
    return lists, level.astype(np.int64)


class _TableStates:
    """States of the table: between nodes, at them, outside, and in cells in which the action changes."""

    def __init__(self, policy: Solution, table: Any) -> None:
        self._policy, self._table, self._extents = policy, table, np.array([*extents_of(policy).values()])
        self._fixed = len(self._extents) - len(policy.grid.axes)

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` states, rows of inputs in their units."""
        low, high = self._extents.T
        beyond = _BEYOND * (high - low)
        inside = rng.uniform(low, high, (count, low.size))
        outside = rng.uniform(low - beyond, high + beyond, (count, low.size))
        nodes = inside.copy()
        nodes[:, self._fixed :] = [
            [rng.choice(x) for x in self._policy.grid.coordinates] for _ in range(count)
        ]
        rows = np.vstack([inside, outside, nodes, self._changing(rng), self._bent(rng, count)])
        if len(self._policy.layout.modes) > 1:
            rows[:, 0] = np.rint(rows[:, 0])
            rows[:: max(count // 5, 1), 0] += 0.5  # some modes that are none
        return [rows]

    def _bent(self, rng: np.random.Generator, count: int) -> Floats:
        """Return states within cells in which the charge of the stop is bent."""
        row, mode, cell = np.nonzero(self._policy.bent)
        chosen = rng.choice(row.size, min(count, row.size), replace=False)
        index = cell[chosen] + rng.uniform(0.0, 1.0, chosen.size)
        return self._in_cells(row[chosen], mode[chosen], index)

    def _changing(self, rng: np.random.Generator) -> Floats:
        """Return states within cells that have lines."""
        table = self._table
        group = np.repeat(np.arange(table.first.size - 1), np.diff(table.first))
        group, cell = np.tile(group, _ROUNDS), np.tile(table.cells[: table.first[-1]], _ROUNDS)
        modes = len(self._policy.layout.modes)
        return self._in_cells(group // modes, group % modes, cell + rng.uniform(0.0, 1.0, cell.size))

    def _in_cells(self, row: Any, mode: Any, index: Any) -> Floats:
        """Return states of slices and modes at positions on the one axis."""
        layout, count = self._policy.layout, self._policy.countdown
        out = np.empty((row.size, len(self._extents)))
        if len(self._policy.grid.axes) == 1:
            out[:, -1] = self._policy.grid.coordinate(0, index)
        if len(layout.modes) > 1:
            out[:, 0] = mode
        if not layout.endless:
            out[:, self._fixed - 1] = count.time(row)
        return out
