"""A planned sequence with small tables: rounded as asked, with what stands beside the pass."""

from dataclasses import replace
from typing import Any

import numpy as np

from sdpgrind.codegen import Recipe, Signal, TablesAsked
from sdpgrind.sdp.kernels import small_tables
from sdpgrind.weldbead.sequence._look_up_kernels import next_pass_small_at, next_pass_told_at
from sdpgrind.weldbead.sequence._recipe import recipe_of

_PASS = ("duration", "feed_rate", "normal_force")
_TOLD = ("gap", "value")
_VALUE = Signal(
    "$", "expected penalty-to-go; NaN below the base, and late where the plan keeps no stage of its own"
)
_TABLES = {
    "table_frame": "first row: length of a stage (s), stages, first and lowest slice, whether late ones have"
    " one, endless; second row, height: origin, spacing (mm), logarithmic, ends (mm), what is done beyond",
    "table_shape": "nodes of the height",
    "table_code": "move at each node: slice, mode, height; < 0: stop",
    "table_control": "force at each node: a multiple of the scale of its move, or N",
    "table_coding": "offset and scale of the force of each move, N",
    "table_move": "number of each move",
    "table_first": "first cell of each slice in which the move changes, and the end",
    "table_cells": "cells of the height in which the move changes, rising in each slice",
    "table_start": "first line of each such cell, and the end",
    "table_line_code": "move of each line; < 0: stop",
    "table_line_control": "its force at both ends of the cell, as at nodes",
    "table_place": "place of its costs; < 0: of those that are kept in more digits, from -1 down",
    "table_cost": "costs of lines at both ends of the cell: multiples of the scale of the move, or $",
    "table_wide": "costs of lines whose order rounding would change, $",
    "table_cost_coding": "offset and scale of costs of stop and each move, $",
    "told_kind": "what is told beside the pass: 0 gap, 1 value",
    "told_told": "gap, value at each node: slice, mode, height; multiples of their scale, or $",
    "told_coding": "offset and scale, $, and what stands for infinity",
}


def small_recipe_of(policy: Any, durations: list[float], feeds: list[float], asked: TablesAsked) -> Recipe:
    """Return the recipe of a `SequencePolicy` with tables as asked, in mm, s, N and $."""
    usual = recipe_of(policy, durations, feeds)
    told = asked.told(_PASS, _TOLD, ("gap",))
    small, notes = small_tables(policy.table, asked.precision, asked.lost_max, told, asked.tell)
    outputs, moves = {**usual.outputs, "value": _VALUE}, (np.array(durations), np.array(feeds))
    return replace(
        usual,
        step=next_pass_told_at if told else next_pass_small_at,
        outputs={name: outputs[name] for name in (*_PASS, *told)},
        law=(*small.law, *moves),
        library_law=(*small.wide, *moves),
        tables={**usual.tables, **_TABLES},
        notes=notes,
    )
