"""Types of a machine's nodes: what each may hold, and a command as its node takes it."""

from math import inf
from typing import Any, Final, Protocol

import numpy as np
from asyncua import ua

_INTEGERS: Final = (
    "SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64",
)  # fmt: skip
_NUMPY: Final = {"SByte": "int8", "Byte": "uint8"}
"""Names of types that numpy calls otherwise."""
_REALS: Final = (*_INTEGERS, "Float", "Double")
NUMBER, EITHER, COUNT = "a number", "a number, or true or false", "a whole number"
SWITCH = "true or false, or a whole number"
KINDS: Final = {
    NUMBER: _REALS, EITHER: (*_REALS, "Boolean"), COUNT: _INTEGERS, SWITCH: (*_INTEGERS, "Boolean"),
}  # fmt: skip
"""What a node must hold -> types that hold it; a control without bits uses whole numbers."""


class CommandNode(Protocol):
    """Where a command goes."""

    @property
    def node(self) -> str:
        """Its node id."""

    @property
    def factor(self) -> float:
        """From the machine's unit to that of the library."""


def commanded(name: str, place: CommandNode, value: Any, kind: ua.VariantType) -> ua.Variant:
    """A command in the machine's unit and type; ValueError for what its node does not hold."""
    if np.ndim(value):
        raise ValueError(f"{name} must be a number; got {value!r}")
    told, (low, high) = value / place.factor, ends(kind)
    if not low <= told <= high:
        raise ValueError(
            f"{name} must be in [{low:g}, {high:g}] in the machine's unit: {place.node} is of {kind.name}; "
            f"got {told:g}"
        )
    return variant(kind, told)


def ends(kind: ua.VariantType) -> tuple[float, float]:
    """Range of what a type holds."""
    if kind.name in _INTEGERS:
        whole = np.iinfo(_NUMPY.get(kind.name, kind.name.lower()))
        return int(whole.min), int(whole.max)
    most = float(np.finfo(np.float32).max) if kind.name == "Float" else inf
    return -most, most


def variant(kind: ua.VariantType, value: float) -> ua.Variant:
    """A number as a value of a type."""
    if kind is ua.VariantType.Boolean:
        return ua.Variant(bool(value), kind)
    return ua.Variant(round(value) if kind.name in _INTEGERS else float(value), kind)
