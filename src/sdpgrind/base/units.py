"""Conversions to the library's units, for user programs.

The library uses mm, s, N, kg, rad, W and J. Each function converts a number or an array.

Examples
--------
>>> from sdpgrind import units
>>> round(units.rpm(300), 4)
31.4159
>>> units.m_per_s(37)
37000.0
"""

from collections.abc import Callable
from math import pi
from numbers import Real
from typing import TypeVar

import numpy as np
import numpy.typing as npt

__all__ = ["N_MM_S_PER_W", "deg", "hz", "inch", "m", "m_per_min", "m_per_s", "mm_per_min", "rpm", "um"]


def __dir__() -> list[str]:
    """Public names only, as of packages."""
    return sorted(__all__)


N_MM_S_PER_W = 1000.0  # N mm/s in one W; derived
UM = 1000.0  # derived: µm in a millimetre
MS = 1000.0  # derived: ms in a second

Quantity = TypeVar("Quantity", float, npt.NDArray[np.float64])


def _numbers(value: Quantity, unit: str) -> Quantity:
    """Refuse what is neither a number nor an array of numbers."""
    kind = getattr(getattr(value, "dtype", None), "kind", None)
    if kind not in ("f", "i", "u") and (isinstance(value, bool) or not isinstance(value, Real)):
        raise TypeError(f"value must be a number or an array of numbers ({unit}); got {value!r}")
    return value


def rpm(value: Quantity) -> Quantity:
    """Revolutions per minute to rad/s."""
    return _numbers(value, "rev/min") * (2 * pi / 60)


def hz(value: Quantity) -> Quantity:
    """Cycles per second (Hz) to rad/s."""
    return _numbers(value, "Hz") * (2 * pi)


def deg(value: Quantity) -> Quantity:
    """Degrees to rad."""
    return _numbers(value, "degrees") * (pi / 180)


def m_per_s(value: Quantity) -> Quantity:
    """Metres per second to mm/s."""
    return _numbers(value, "m/s") * 1000.0


def m_per_min(value: Quantity) -> Quantity:
    """Metres per minute to mm/s."""
    return _numbers(value, "m/min") * (1000.0 / 60.0)


def mm_per_min(value: Quantity) -> Quantity:
    """Millimetres per minute to mm/s."""
    return _numbers(value, "mm/min") / 60.0


def um(value: Quantity) -> Quantity:
    """Micrometres to mm."""
    return _numbers(value, "um") * 1e-3


def inch(value: Quantity) -> Quantity:
    """Inches to mm."""
    return _numbers(value, "inches") * 25.4


def m(value: Quantity) -> Quantity:
    """Metres to mm."""
    return _numbers(value, "m") * 1000.0


CONVERSIONS: dict[str, tuple[tuple[Callable[[float], float], str], ...]] = {
    "mm": ((m, "metres"), (inch, "inches"), (um, "micrometres")),
    "mm/s": ((m_per_s, "m/s"), (m_per_min, "m/min"), (mm_per_min, "mm/min"), (um, "um/s"), (inch, "in/s")),
    "mm/s^2": ((m, "m/s^2"),),
    "rad": ((deg, "degrees"),),
    "rad/s": ((rpm, "rev/min"), (hz, "Hz")),
}
"""Unit -> conversions with the words of their input; an error names the forgotten one."""
FACTORS: dict[str, tuple[tuple[float, str], ...]] = {
    "N/mm": ((1e3, "N/µm"), (1e-3, "N/m")),
    "mm^2/s": ((1e6, "m^2/s"), (1e2, "cm^2/s")),
    "J/mm^3": ((1e-3, "J/cm^3"), (1e3, "kJ/mm^3")),
    "W": ((1e3, "kW"),),
    "s": ((1e-3, "ms"),),
}
"""Unit -> factors to it from units without a conversion of that table, with the words of these."""
