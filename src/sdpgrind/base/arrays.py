"""Read-only arrays, and equality by value."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt


def lasting(values: npt.ArrayLike, dtype: npt.DTypeLike = float) -> npt.NDArray[Any]:
    """Return a read-only copy of `values`."""
    kept = np.array(values, dtype=dtype)
    kept.flags.writeable = False
    return kept


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal: arrays in shape and every entry, NaN equal to NaN."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    return bool(one is other or one == other or (one != one and other != other))


class ByValue:
    """Mixin of frozen dataclasses with arrays: equality and hash by the values of all compared fields.

    The dataclass needs ``eq=False``, since its own equality fails with arrays.
    """

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(same(getattr(self, name), getattr(other, name)) for name in _compared(self))

    def __hash__(self) -> int:
        return hash(tuple(_key(getattr(self, name)) for name in _compared(self)))


def _compared(thing: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(thing) if field.compare]


def _key(value: Any) -> Any:
    """Hashable form, common to equal values: one sign of zero, one pattern of NaN."""
    if not isinstance(value, np.ndarray):
        return value if value == value else None
    plain = np.where(np.isnan(value), np.nan, value + 0.0)
    return plain.shape, plain.tobytes()
