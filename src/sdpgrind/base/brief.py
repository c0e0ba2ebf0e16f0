"""Frozen dataclasses in one line: six digits and units, and of long rows only how many numbers they hold."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

SHORT = 8
"""Entries of a sequence that are written down."""


def brief(thing: Any, units: Mapping[str, str] | None = None) -> str:
    """Return the fields of a dataclass as text, those at their defaults left out.

    Parameters
    ----------
    thing : dataclass
        What to write down.
    units : mapping, optional
        Unit of each field that has one; "1" is not written.
    """
    units = units or {}
    shown = []
    for field in dataclasses.fields(thing):
        value = getattr(thing, field.name)
        if field.repr and not (field.default is not dataclasses.MISSING and value is field.default):
            unit = units.get(field.name, "") if value is not None else ""
            shown.append(f"{field.name}={_text(value)} {unit if unit != '1' else ''}".rstrip())
    return f"{type(thing).__name__}({', '.join(shown)})"


def _text(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {_text(entry)}" for name, entry in value.items()) + "}"
    if isinstance(value, tuple | list | np.ndarray):
        if np.size(value) > SHORT:
            return f"<{np.size(value)} values>"
        return "(" + ", ".join(map(_text, value)) + ("," if len(value) == 1 else "") + ")"
    return repr(value)
