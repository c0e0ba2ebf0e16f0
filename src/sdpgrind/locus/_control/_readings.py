"""Readings as controllers take them."""

from math import isfinite, nan
from typing import Any

import numpy as np


def usable(name: str, value: Any) -> float:
    """A reading as a number; NaN where it is none that a controller can go by."""
    if isinstance(value, str) or np.ndim(value) != 0 or value is None:
        raise TypeError(f"{name} must be a number (NaN: no reading); got {value!r}")
    return float(value) if isfinite(value) else nan
