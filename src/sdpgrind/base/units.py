"""Conversions to the library's units, for the edge of a user's program only.

Inside, everything is in mm, s, N, kg, rad, W and J. Every function takes a number or an array and gives the same
quantity in those units.

Examples
--------
>>> from sdpgrind import units
>>> round(units.rpm(300), 4)
31.4159
>>> units.m_per_s(37)
37000.0
"""

from math import pi
from typing import TypeVar

import numpy as np
import numpy.typing as npt

__all__ = ["deg", "hz", "inch", "m_per_s", "mm_per_min", "rpm", "um"]

Quantity = TypeVar("Quantity", float, npt.NDArray[np.float64])


def rpm(value: Quantity) -> Quantity:
    """Revolutions per minute to rad/s."""
    return value * (2 * pi / 60)


def hz(value: Quantity) -> Quantity:
    """Cycles per second (Hz) to rad/s."""
    return value * (2 * pi)


def deg(value: Quantity) -> Quantity:
    """Degrees to rad."""
    return value * (pi / 180)


def m_per_s(value: Quantity) -> Quantity:
    """Metres per second to mm/s."""
    return value * 1000.0


def mm_per_min(value: Quantity) -> Quantity:
    """Millimetres per minute to mm/s."""
    return value / 60.0


def um(value: Quantity) -> Quantity:
    """Micrometres to mm."""
    return value * 1e-3


def inch(value: Quantity) -> Quantity:
    """Inches to mm."""
    return value * 25.4
