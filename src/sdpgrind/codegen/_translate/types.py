"""Types of what kernels compute with: numbers, arrays of known shape, records of floats, tuples."""

from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numba
import numpy as np
from numba.core import types as of_numba
from numba.np.numpy_support import from_dtype

from sdpgrind.base.states import RecordType


@dataclass(frozen=True)
class Scalar:
    """A number: its name in C, bytes, place among types that widen; `rounded`: the library has a double."""

    c: str
    size: int
    rank: int
    rounded: bool = False


BOOL, INT8, INT16 = Scalar("bool", 1, 0), Scalar("int8_t", 1, 1), Scalar("int16_t", 2, 2)
INT32, INT64, FLOAT64 = Scalar("int32_t", 4, 3), Scalar("int64_t", 8, 4), Scalar("double", 8, 5)
FLOAT32 = Scalar("float", 4, 6)  # of tables only, above all others: nothing is converted from it unasked
ELEMENTS = {
    np.dtype(name): kind
    for name, kind in zip(
        ("bool", "int8", "int16", "int32", "int64", "float32", "float64"),
        (BOOL, INT8, INT16, INT32, INT64, FLOAT32, FLOAT64),
        strict=True,
    )
}

ROUNDED = {dtype: replace(kind, rounded=True) for dtype, kind in ELEMENTS.items() if dtype.kind == "i"}
"""Elements of tables of whole numbers where the library's step has doubles."""


@dataclass(frozen=True)
class Array:
    """Elements with extents and strides in elements; an extent of None: not known, for indexing only.

    With `bits` the elements are doubles, and what is read are their bits as int64. `fixed`: elements that
    never change, with their numbers; a view of a part has none. `every`: the number of all elements, as text.
    """

    element: Scalar
    shape: tuple[int | None, ...]
    strides: tuple[int, ...]
    bits: bool = False
    fixed: tuple[tuple[int, float], ...] = ()
    every: str = ""

    @property
    def dense(self) -> bool:
        """Whether elements follow each other in the order of C."""
        return self.strides == dense(self.shape)


def dense(shape: tuple[int | None, ...]) -> tuple[int, ...]:
    """Return the strides of elements that follow each other, in elements."""
    strides = [1]
    for extent in shape[:0:-1]:
        strides.insert(0, strides[0] * (1 if extent is None else extent))
    return tuple(strides)


@dataclass(frozen=True)
class RowType:
    """A row of doubles with names; `fixed` as of `Array`."""

    dtype: RecordType
    fixed: tuple[tuple[int, float], ...] = ()


@dataclass(frozen=True)
class Tuple:
    """A tuple, or a NamedTuple of a class; `fixed`: places of numbers that are always the same, as text."""

    made_by: type
    types: "tuple[Type, ...]"
    fixed: tuple[tuple[int, str], ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the items."""
        named: tuple[str, ...] = getattr(self.made_by, "_fields", ())
        return named or tuple(f"item{k}" for k in range(len(self.types)))

    def named(self, k: int) -> str:
        """Return the name of an item, "" where it has none of its own."""
        return self.fields[k] if hasattr(self.made_by, "_fields") else ""


@dataclass(frozen=True)
class Known:
    """A thing that exists while translating only: a module, a function, a dtype."""

    thing: Any


@dataclass(frozen=True)
class Nothing:
    """The result of a function without one."""


Type: TypeAlias = Scalar | Array | RowType | Tuple | Known | Nothing


def unified(first: Type, second: Type) -> Type | None:
    """Return the type of a variable that takes values of both types; None: there is none."""
    if first == second:
        return first
    if FLOAT32 in (first, second):
        return None
    if isinstance(first, Scalar) and isinstance(second, Scalar):
        wide = first if first.rank > second.rank else second
        return INT64 if wide != FLOAT64 else FLOAT64
    if isinstance(first, Tuple) and isinstance(second, Tuple) and first.made_by is second.made_by:
        if len(first.types) != len(second.types):
            return None
        items = [unified(a, b) for a, b in zip(first.types, second.types, strict=True)]
        known = tuple(one for one in items if one is not None)
        fixed = tuple(
            one for one in first.fixed if one in second.fixed and items[one[0]] == first.types[one[0]]
        )
        return Tuple(first.made_by, known, fixed) if len(known) == len(items) else None
    return None


def unfixed(kind: Type) -> Type:
    """Return the type of a tuple without its numbers, as C has it; others as they are."""
    if not isinstance(kind, Tuple):
        return kind
    return Tuple(kind.made_by, tuple(unfixed(one) for one in kind.types))


def number_of(kind: Type, text: str) -> int | float | bool:
    """Return a number that a type keeps as text."""
    return float(text) if kind == FLOAT64 else text == "True" if kind == BOOL else int(text)


def size_of(kind: Type) -> int:
    """Return the bytes of a variable, those of a pointer for what lies elsewhere."""
    if isinstance(kind, Tuple):
        return sum(max(8, size_of(one)) for one in kind.types)
    return kind.size if isinstance(kind, Scalar) else 8


_OF_NUMBA = {kind: from_dtype(dtype) for dtype, kind in ELEMENTS.items()}
_OF_NUMBA |= dict.fromkeys((FLOAT32, *ROUNDED.values()), of_numba.float64)  # as which they are computed with


def to_numba(kind: Type) -> Any:
    """Return the type as numba knows it."""
    if isinstance(kind, Scalar):
        return _OF_NUMBA[kind]
    if isinstance(kind, Array):
        element = of_numba.int64 if kind.bits else _OF_NUMBA[kind.element]
        return numba.types.Array(element, len(kind.shape), "C" if kind.dense else "A")
    if isinstance(kind, RowType):
        return from_dtype(kind.dtype)
    if isinstance(kind, Tuple):
        named = kind.made_by if kind.made_by is not tuple else None
        return of_numba.BaseTuple.from_types([to_numba(one) for one in kind.types], named)
    return of_numba.none if isinstance(kind, Nothing) else of_numba.Dispatcher(kind.thing)


def same_result(kind: Type, result: Any) -> bool:
    """Whether a type is that of numba, of whatever layout its arrays and width its whole numbers are."""
    if isinstance(kind, Scalar) and kind not in (BOOL, FLOAT32, FLOAT64) and not kind.rounded:
        return isinstance(of_numba.unliteral(result), of_numba.Integer)
    if isinstance(kind, Array):
        return isinstance(result, of_numba.Array) and result.dtype == to_numba(kind).dtype
    if isinstance(kind, Tuple):
        inner = list(getattr(result, "types", ()))
        return len(inner) == len(kind.types) and all(map(same_result, kind.types, inner))
    return bool(to_numba(kind) == of_numba.unliteral(result))
