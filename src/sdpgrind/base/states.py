"""State and parameters of kernels by name: rows of floats with names and units.

A `record` is a numpy dtype of floats; arrays that are kept, copied, saved and passed to kernels stay plain
rows of floats. A kernel called from Python views the row once, at its entry; the machine code is that of
``state[3]``. In plain Python `named` gives the same names.

Examples
--------
>>> import numpy as np
>>> from sdpgrind.base.compiling.compiled import compiled
>>> from sdpgrind.base.states import floats, named, record, units
>>> AXIS = record("angle rad, speed rad/s, load_torque N m")
>>> @compiled
... def axis_step(state, inertia, tick):  # Python hands over the row of floats that it keeps
...     axis = state.view(AXIS)[0]
...     axis.speed -= tick * axis.load_torque / inertia
...     axis.angle += tick * axis.speed
>>> state = floats(AXIS)
>>> named(state, AXIS).load_torque = -2.0
>>> axis_step(state, 0.5, 0.1)
>>> state.round(3).tolist(), units(AXIS)["load_torque"]
([0.04, 0.4, -2.0], 'N m')
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from sdpgrind.base.checks import Floats

RecordType: TypeAlias = "np.dtype[np.void]"
_FLOAT = np.dtype(np.float64)


def record(fields: str) -> RecordType:
    """Return the dtype of a row of named floats, without gaps; its metadata have the units.

    `fields` are names with units in the order of the row: ``"angle rad, speed rad/s"``; "1": a pure number. A
    name with a size, ``"gain[4] N m"``, is an array.
    """
    known: dict[str, str] = {}
    shapes: list[tuple[Any, ...]] = []
    for field in fields.split(","):
        name, _, unit = field.strip().partition(" ")
        name, _, size = name.removesuffix("]").partition("[")
        if not name.isidentifier() or not unit or name in known:
            raise ValueError(
                f"fields must be 'name unit, name unit, ...', no name twice; got {field.strip()!r}"
            )
        known[name] = unit
        shapes.append((name, _FLOAT, (int(size),)) if size else (name, _FLOAT))
    return np.dtype(shapes, metadata={"units": known})


def units(kind: RecordType) -> Mapping[str, str]:
    """Return the units of a record by field."""
    told: Mapping[str, Any] = kind.metadata or {}
    found: Mapping[str, str] = told["units"]
    return found


def places(kind: RecordType, *names: str) -> tuple[int, ...]:
    """Return the indices in the row at which fields begin; no names: all fields."""
    fields: Mapping[str, Any] = kind.fields or {}
    return tuple(int(fields[name][1]) // _FLOAT.itemsize for name in names or fields)


def width(kind: RecordType) -> int:
    """Return the number of floats in the row."""
    return kind.itemsize // _FLOAT.itemsize


def floats(kind: RecordType) -> Floats:
    """Return a row of zeros."""
    return np.zeros(width(kind))


def flat(*fields: Any) -> Floats:
    """Return one row of all numbers and arrays, in their order."""
    return np.concatenate([np.ravel(np.asarray(field, dtype=float)) for field in fields])


def named(row: Floats, kind: RecordType) -> Any:
    """Return a view of a row (width,) with the names of a record; assignments change the row."""
    if row.shape != (width(kind),):
        raise ValueError(f"row must be of shape ({width(kind)},), as its record is; got {row.shape}")
    return row.view(kind).view(np.recarray)[0]
