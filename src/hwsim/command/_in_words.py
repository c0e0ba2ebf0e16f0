"""Refusals of the library in the words of a command: a unit as in a file instead of a call in Python."""

import re

_CALL = re.compile(r"units\.(\w+)\((\.\.\.|-?[\d.]+|\w+)\)")
_HINT = re.compile(r"; (?:units\.\w+\([^)]*\)|multiply by [\d.]+)(?: for [^;()]+?)?(?=; | \(|$)")
_USUAL = re.compile(r"must be in (\S+), (some|up to) ([^\s;,]+)")
_UNITS = {"hz": "Hz"}  # of conversions that are named otherwise; m_per_s is m/s


def as_text(message: str) -> str:
    """Return a message with a unit as a file or an option holds it instead of a conversion in Python."""
    return _CALL.sub(_quantity, message)


def _quantity(found: re.Match[str]) -> str:
    number = found[2] if found[2][-1].isdigit() else "..."
    return f'"{number} {_UNITS.get(found[1], found[1].replace("_per_", "/"))}"'


def as_given(message: str, text: str) -> str:
    """Return a message on a value whose `text` gives its own unit: no other unit was meant."""
    bare = _USUAL.sub(r"must be \2 \3 \1", _HINT.sub("", message))
    return f"{bare.rpartition('; got ')[0]}; got {text!r}"


def names_another(message: str) -> bool:
    """Whether a message names a conversion that was forgotten."""
    return _HINT.search(message) is not None
