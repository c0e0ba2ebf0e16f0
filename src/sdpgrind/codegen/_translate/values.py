"""Values of expressions in C, and numbers as literals."""

import math
import textwrap
from dataclasses import dataclass

from sdpgrind.codegen._translate.types import BOOL, FLOAT32, FLOAT64, INT64, Known, Scalar, Tuple, Type

LOWEST, SUM, PRODUCT, PRIMARY = range(4)
"""How tightly the text of a value binds."""
GUARD = "/* guard */"
"""Behind a branch that nothing is to reach: comments `# guard` of kernels, bounds of loops, casts, faults."""
_WIDTH = 100  # chosen: characters of a line of a comment


@dataclass(frozen=True)
class Value:
    """Text in C of a value and its type.

    Attributes
    ----------
    level : int
        How tightly the text binds.
    number : int, float or bool, optional
        The value, where it is known while translating.
    items : tuple of Value, optional
        Items of a tuple that has no variable of its own.
    at, terms, note : int, tuple of str, str
        Of arrays and records: where they begin behind what `code` points to; the name of the place.
    root : str
        Variable through which an array or record is reached; "": what may not be written to.
    """

    code: str
    type: Type
    level: int = PRIMARY
    number: int | float | bool | None = None
    items: "tuple[Value, ...] | None" = None
    at: int = 0
    terms: tuple[str, ...] = ()
    note: str = ""
    root: str = ""

    @property
    def reads(self) -> bool:
        """Whether the text reads memory that another kernel may change."""
        return "[" in self.code or any(one.reads for one in self.items or ())

    @property
    def count(self) -> int | None:
        """The whole number that is known, if any."""
        known = self.number
        return int(known) if isinstance(known, int) and not isinstance(known, bool) else None


def within(value: Value, level: int) -> str:
    """Return the text in parentheses where it binds less tightly than asked."""
    return value.code if value.level >= level else f"({value.code})"


def literal(number: bool | int | float, note: str = "") -> Value:
    """Return a number that is known."""
    told = f" /* {note} */" if note else ""
    if isinstance(number, bool):
        return Value(("true" if number else "false") + told, BOOL, number=number, note=note)
    if isinstance(number, int):
        text = str(number) if abs(number) < 2**31 else f"INT64_C({number})"
        return Value(text + told, INT64, PRIMARY if number >= 0 else PRODUCT, number, note=note)
    return Value(double(number) + told, FLOAT64, PRODUCT if number < 0.0 else PRIMARY, number, note=note)


def double(number: float) -> str:
    """Return a literal that reads back as the same double."""
    if math.isnan(number):
        return "(double)NAN"
    if math.isinf(number):
        return "(double)INFINITY" if number > 0 else "-(double)INFINITY"
    return repr(float(number))


def widened(value: Value) -> Value:
    """Return a float of four bytes as a double; others as they are."""
    return Value(f"(double){within(value, PRIMARY)}", FLOAT64, PRODUCT) if value.type == FLOAT32 else value


def comment(text: str, indent: str = "") -> str:
    """Return a text as a comment, of several lines where it is long."""
    lines = textwrap.wrap(text.replace("*/", "* /"), _WIDTH)
    if len(lines) == 1:
        return f"{indent}/* {lines[0]} */"
    return "\n".join([f"{indent}/*", *(f"{indent} * {line}" for line in lines), f"{indent} */"])


def known(thing: object) -> Value:
    """Return a thing that exists while translating only."""
    return Value("", Known(thing))


def identical(first: int | float | bool | None, second: int | float | bool | None) -> bool:
    """Whether two known numbers are the same in type and bits; a NaN is not the same as any."""
    return first == second and repr(first) == repr(second)


def gathered(made_by: type, items: tuple[Value, ...]) -> Value:
    """Return a tuple of values; numbers among them that are known stay known through calls."""
    numbers = ((k, one.number) for k, one in enumerate(items))
    fixed = tuple((k, repr(one)) for k, one in numbers if one is not None and one == one)
    return Value("", Tuple(made_by, tuple(one.type for one in items), fixed), items=items)


def cast(value: Value, kind: Type) -> Value | None:
    """Return a number as another type that is as wide or wider; None: there is no such conversion."""
    if value.type == kind:
        return value
    if not (isinstance(kind, Scalar) and isinstance(value.type, Scalar)) or kind.rank < value.type.rank:
        return None
    if kind == FLOAT32:
        return None
    if value.number is not None and value.type in (BOOL, INT64):
        return literal(float(value.number) if kind == FLOAT64 else int(value.number), value.note)
    if value.type == BOOL:
        one, zero = ("1.0", "0.0") if kind == FLOAT64 else ("1", "0")
        return Value(f"{within(value, PRODUCT)} ? {one} : {zero}", kind, LOWEST)
    return Value(f"({kind.c}){within(value, PRIMARY)}", kind, PRODUCT)
