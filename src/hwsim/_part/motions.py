"""Commanded tables (motions): their number of rows, a digest, and their rows in a second table.

The table of a tier has one row a step; the rows of its motions are concatenated in a table of their own, with
the time of the command.
"""

from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[Any]
_OF = ":"  # refused in names of tiers


def as_table(value: Any) -> Any:
    """A motion as an array of rows, from an array, a list of rows, or an object with ``segments``."""
    value = getattr(value, "segments", value)
    rows = isinstance(value, list | tuple) and all(
        isinstance(row, list | tuple | np.ndarray) for row in value
    )
    return np.array(value, dtype=float).reshape(len(value), -1) if rows and value else value


def is_table(value: Any) -> bool:
    """Whether a command is a motion, as returned by `as_table`."""
    return isinstance(value, np.ndarray) and value.ndim == 2


def digest(table: npt.NDArray[Any]) -> float:
    """Hash of the entries of a table, 48 bits, exact as a float; the shape is told by the number of rows."""
    whole = np.ascontiguousarray(table, dtype=float) + 0.0  # 0.0: -0 is 0
    return float(int.from_bytes(blake2b(whole.tobytes(), digest_size=6).digest()))


def digest_name(name: str) -> str:
    """Name of the digest of a command."""
    return f"{name.removesuffix('_command')}_digest"


def command_column(name: str) -> str:
    """Name of the column of a command: with ``_command`` at its end, once."""
    return name if name.endswith("_command") else f"{name}_command"


def rows_of(tier: str, name: str) -> str:
    """Key of the table with the rows of a command, from the name of the command or its column."""
    return f"{tier}{_OF}{name.removesuffix('_command')}"


def tier_and_name(key: str) -> tuple[str, str]:
    """Name of the tier and of its command, from the key of a table of rows."""
    tier, _, name = key.partition(_OF)
    return tier, name


def is_of_rows(key: str) -> bool:
    """Whether a table holds rows of motions."""
    return _OF in key


def row_table(tier: str, name: str, time: Column, values: Sequence[Any]) -> dict[str, dict[str, Column]]:
    """Rows of a tier's motions under a name, with their time (s); empty where there are none."""
    steps = [k for k, value in enumerate(values) if is_table(value) and len(value)]
    if not steps:
        return {}
    motions = [values[k] for k in steps]
    lengths = [len(motion) for motion in motions]
    return {
        rows_of(tier, name): {"time": np.repeat(time[steps], lengths), command_column(name): stacked(motions)}
    }


def stacked(blocks: Sequence[Column]) -> Column:
    """Concatenate blocks of rows; narrower ones are padded with NaN."""
    width = max(1, *(block.shape[1] for block in blocks))  # NetCDF knows no empty dimension
    missing = [((0, 0), (0, width - block.shape[1])) for block in blocks]
    padded = (
        np.pad(block, each, constant_values=np.nan) for block, each in zip(blocks, missing, strict=True)
    )
    return np.vstack(list(padded))


def unpadded_rows(rows: Column) -> Column:
    """Return rows without the columns of NaN that `stacked` added at their end."""
    used = np.flatnonzero(~np.isnan(rows).all(axis=0))
    return rows[:, : used[-1] + 1 if used.size else 0]
