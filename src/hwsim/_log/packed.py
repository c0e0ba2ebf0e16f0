"""A part as a row of a journal: its outcome as JSON, and all its arrays as one run of bytes with an index.

The index is JSON of (name, dtype, shape) of each array; names are ``tier/column``, those of outcomes
``/name``. Rows of motions are deflated: a fourth entry is their number of bytes. Each motion stands once, at
its first command (see `hwsim._part.kept_motions`).
"""

import json
import math
import zlib
from typing import Any

import numpy as np

from hwsim._part.motions import is_of_rows
from hwsim._part.part import Column, LivePart


def outcome_json(part: LivePart) -> str:
    """Return the outcome of a part as JSON."""
    return json.dumps({name: _as_json(value) for name, value in part.outcome.items()})


def _as_json(value: Column) -> Any:
    """A column for JSON, with None for NaN and infinity, which JSON lacks."""
    plain = value.astype(object)
    if value.dtype.kind == "f":
        plain[~np.isfinite(value)] = None
    return plain.tolist()


def packed(part: LivePart, *, deflate: bool) -> tuple[str, bytes]:
    """Return index and bytes of a part's arrays; False: motions as they are, as version 0.1.0 reads them."""
    index: list[tuple[Any, ...]] = []
    blocks: list[bytes] = []
    for name, value in _named(part).items():
        told = (name, value.dtype.str, value.shape)
        if deflate and is_of_rows(name.rpartition("/")[0]):
            blocks.append(zlib.compress(value.tobytes()))
            index.append((*told, len(blocks[-1])))
        else:
            blocks.append(value.tobytes())
            index.append(told)
    return json.dumps(index), b"".join(blocks)


def _named(part: LivePart) -> dict[str, Column]:
    named: dict[str, Column] = {f"/{name}": value for name, value in part.outcome.items()}
    for tier, table in part.tables.items():
        named |= {f"{tier}/{name}": value for name, value in table.items()}
    return named


def unpacked(index: str, arrays: bytes) -> LivePart:
    """Return the part of `packed`."""
    tables: dict[str, dict[str, Column]] = {}
    outcome: dict[str, Column] = {}
    start = 0
    for key, dtype, shape, *deflated in json.loads(index):
        tier, _, name = key.rpartition("/")
        size = deflated[0] if deflated else math.prod(shape) * np.dtype(dtype).itemsize
        block = arrays[start : start + size]
        value = np.frombuffer(zlib.decompress(block) if deflated else block, dtype).reshape(shape)
        (tables.setdefault(tier, {}) if tier else outcome)[name] = value
        start += size
    return LivePart(tables, outcome)
