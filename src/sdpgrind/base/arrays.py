"""Arrays in what is immutable: copies that cannot be changed, equality by value."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt


def lasting(values: npt.ArrayLike, dtype: npt.DTypeLike = float) -> npt.NDArray[Any]:
    """Return a copy of `values` that cannot be changed."""
    kept = np.array(values, dtype=dtype)
    kept.flags.writeable = False
    return kept


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal: arrays in shape and in every entry; NaN, which says that there is none, is equal to NaN."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    return bool(one is other or one == other or (one != one and other != other))


class ByValue:
    """Mixin of frozen dataclasses with arrays of numbers: equal where all compared fields are, and hashed by them.

    The dataclass needs ``eq=False``, or makes an equality of its own, which arrays break; a field with ``compare=False`` does not
    count.
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
    """What equal values share: all zeros one sign, all NaN one pattern."""
    if not isinstance(value, np.ndarray):
        return value if value == value else None
    plain = np.where(np.isnan(value), np.nan, value + 0.0)
    return plain.shape, plain.tobytes()
