"""Checks of arguments with one form of error: name, rule, unit, value. Internal arrays are not checked."""

import os
from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Bools = npt.NDArray[np.bool_]
Kind = TypeVar("Kind")
_MOST = 2**31  # chosen: a byte each fills the memory of a small computer
_LARGEST = 10**300  # chosen: below the largest float, beyond any quantity
_LONG = 80  # longest value in a message, characters; chosen: the message fits a line


def with_unit(rule: str, unit: str) -> str:
    """Append a unit in brackets to a rule; "": no unit."""
    return f"{rule} ({unit})" if unit else rule


def refuse(name: str, rule: str, value: object, unit: str = "") -> ValueError:
    """Return the error of a refused argument: ``<name> must be <rule> (<unit>); got <value>``."""
    return ValueError(f"{name} must be {with_unit(rule, unit)}; got {shown(value)}")


def shown(value: object) -> str:
    """Return a value as text if short, else its type."""
    if isinstance(value, int) and value.bit_length() > 64:  # Python refuses to write 5000 digits
        return f"a whole number of {value.bit_length()} bits"
    text = repr(value)
    if len(text) <= _LONG and "\n" not in text and " at 0x" not in text:
        return text
    return _article(type(value).__name__)


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"


def kind(name: str, value: object, wanted: type[Kind], hint: str = "") -> Kind:
    """Return `value` if it is a `wanted`; `hint` ends the message."""
    if not isinstance(value, wanted):
        raise TypeError(f"{name} must be {_article(wanted.__name__)}{hint}; got {shown(value)}")
    return value


def able(name: str, value: Kind, what: str, *methods: str) -> Kind:
    """Return `value` if it has `methods`; `what` is the rule of the message."""
    if not all(callable(getattr(value, method, None)) for method in methods):
        raise TypeError(f"{name} must be {what}; got {shown(value)}")
    return value


def path(name: str, value: str | os.PathLike[str]) -> Path:
    """Return `value`, text or path, as a path."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be a path; got {shown(value)}")
    return Path(value)


def number(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a finite float."""
    if type(value) is float and isfinite(value):  # the most usual, in a third of the time
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name} must be {with_unit('a number', unit)}; got {shown(value)}")
    if isinstance(value, int) and abs(value) > _LARGEST:
        raise refuse(name, "at most 1e300", value, unit)
    if not isfinite(value):
        raise refuse(name, "finite", float(value), unit)
    return float(value)


def positive(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float > 0."""
    checked = number(name, value, unit)
    if checked <= 0:
        raise refuse(name, "> 0", checked, unit)
    return checked


def nonnegative(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float >= 0."""
    checked = number(name, value, unit)
    if checked < 0:
        raise refuse(name, ">= 0", checked, unit)
    return checked


def within(name: str, value: object, low: float, high: float, unit: str = "") -> float:
    """Return `value` as a float in [`low`, `high`]."""
    checked = number(name, value, unit)
    if not low <= checked <= high:
        raise refuse(name, f"in [{low:g}, {high:g}]", checked, unit)
    return checked


def at_most(name: str, value: object, limit: str, most: float, unit: str = "") -> float:
    """Return `value` as a float in (0, `most`]; the message names the `limit`."""
    checked = positive(name, value, unit)
    if checked > most:
        raise refuse(name, f"<= {limit} = {most:.6g}", checked, unit)
    return checked


def share(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float in (0, 1]."""
    checked = number(name, value, unit)
    if not 0 < checked <= 1:
        raise refuse(name, "in (0, 1]", checked, unit)
    return checked


def probability(name: str, value: object) -> float:
    """Return `value` as a float in (0, 1), ends excluded."""
    checked = number(name, value, "1")
    if not 0 < checked < 1:
        raise refuse(name, "in (0, 1)", checked, "1")
    return checked


def confidence(name: str, value: object) -> float:
    """Return `value` as a float in [0.5, 1): the chance that a limit is kept on one side."""
    checked = number(name, value)
    if not 0.5 <= checked < 1:
        raise refuse(name, "in [0.5, 1), such as 0.999", checked)
    return checked


def count(name: str, value: object, at_least: int = 1, at_most: int = _MOST) -> int:
    """Return `value` as an int within bounds; more than 2^31 of anything fills the memory."""
    number = whole(name, value, at_least)
    if number > at_most:
        raise refuse(name, f"<= {at_most}, the largest count", number)
    return number


def whole(name: str, value: object, at_least: int = 0) -> int:
    """Return `value` as an int >= `at_least` of any size: a seed, nanoseconds."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} must be a whole number; got {shown(value)}")
    if value < at_least:
        raise refuse(name, f">= {at_least}", int(value))
    return int(value)


def one_of(name: str, value: Any, choices: Iterable[Any]) -> Any:
    """Return `value` if it is one of `choices`."""
    known = list(choices)
    if value not in known:
        raise refuse(name, "one of " + ", ".join(map(str, known)), value)
    return value


def finite_array(name: str, value: npt.ArrayLike, unit: str = "") -> Floats:
    """Return `value` as a float array without NaN or infinity; the error names the first offender."""
    array = reals(name, value, unit, rule="numbers")
    finite = np.isfinite(array)
    if not finite.all():
        first = int(np.argmin(finite))
        raise refuse(f"{name}[{first}]", "finite", float(array.ravel()[first]), unit)
    return array


def reals(name: str, value: Any, unit: str = "", *, rule: str = "a number, or an array of them") -> Floats:
    """Return `value` as a float array, NaN and infinity included; no texts, no truth values, no None."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unlike lengths
        array = np.asarray(None)
    each = array.ravel() if array.dtype.kind == "O" else ()
    if array.dtype.kind not in "fiuO" or any(type(x) is bool or not isinstance(x, Real) for x in each):
        raise TypeError(f"{name} must be {with_unit(rule, unit)}; got {shown(value)}")
    return np.asarray(array, dtype=float)


def inside(
    name: str,
    value: npt.ArrayLike,
    low: float,
    high: float,
    unit: str = "",
    *,
    slack: float = 0.0,
    rule: str = "in",
    numbered: bool = False,
) -> Floats:
    """Return `value` as a float array within [`low`, `high`] +- `slack`; `numbered`: errors give an index."""
    array = finite_array(name, value, unit)
    outside = (array < low - slack) | (array > high + slack)
    if outside.any():
        first = int(np.argmax(outside))
        place = f"{name}[{first}]" if numbered and array.ndim else name
        raise refuse(place, f"{rule} [{low:g}, {high:g}]", float(array.ravel()[first]), unit)
    return array


def charge(name: str, function: Callable[[Floats], npt.ArrayLike], limit: float) -> None:
    """Refuse a charge ($) of distance unless finite, 0 at 0, >= 0 and non-decreasing up to `limit`."""
    z = np.linspace(0.0, limit, 1001)
    charged = np.broadcast_to(np.asarray(function(z), dtype=float), z.shape)
    rules = {
        "finite": ~np.isfinite(charged),
        "0 at the target": (z == 0) & (charged != 0),
        ">= 0": charged < 0,
        "non-decreasing away from the target": np.concatenate([[False], charged[1:] < charged[:-1]]),
    }
    for rule, broken in rules.items():
        if np.any(broken):
            k = int(np.argmax(broken))
            raise ValueError(f"{name} must be {rule} ($); got {charged[k]:g} at distance {z[k]:g}")


def unique(name: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return `names` as a tuple without repeats."""
    for k, entry in enumerate(names):
        if entry in names[:k]:
            raise ValueError(f"{name} must be without repeats; got {entry!r} twice")
    return tuple(names)
