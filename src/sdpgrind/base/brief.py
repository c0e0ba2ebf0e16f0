"""Things in one line: frozen dataclasses with six digits and units, counted nouns."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

SHORT = 8  # longest sequence that is written out; chosen: more do not fit a line


def brief(thing: Any, units: Mapping[str, str] | None = None) -> str:
    """Return the fields of a dataclass as text, without defaults; `units` by field, "1" is not shown."""
    units = units or {}
    shown = []
    for field in dataclasses.fields(thing):
        value = getattr(thing, field.name)
        if field.repr and not (field.default is not dataclasses.MISSING and value is field.default):
            unit = units.get(field.name, "") if value is not None else ""
            shown.append(f"{field.name}={text(value)} {unit if unit != '1' else ''}".rstrip())
    return f"{type(thing).__name__}({', '.join(shown)})"


def text(value: Any) -> str:
    """Return a value in six digits, sequences of more than `SHORT` by their size."""
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {text(entry)}" for name, entry in value.items()) + "}"
    if isinstance(value, tuple | list | np.ndarray):
        if np.size(value) > SHORT:
            return f"<{np.size(value)} values>"
        return "(" + ", ".join(map(text, value)) + ("," if len(value) == 1 else "") + ")"
    return repr(value)


def counted(count: float, noun: str) -> str:
    """Return a number of things in words: "1 part", "20 parts", "2.5 turns"."""
    number = f"{count:.4g}" if isinstance(count, float | np.floating) else str(count)
    return f"{number} {noun}" if number == "1" else f"{number} {noun}s"


def listed(names: Sequence[str]) -> str:
    """Return names as a part of a sentence: "one, two and three"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
