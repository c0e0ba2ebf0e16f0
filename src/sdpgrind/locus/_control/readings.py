"""Readings that a controller on optima may use: usable numbers, waiting for lags, patience."""

from math import isfinite, nan
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.locus._path.walk_kernels import PATIENCE, SETTLED

HOLDS, STARTS = ("none", "settled"), ("feasible", "learned")


def checked_hold(name: str, value: Any) -> str | float:
    """Return a mode, or a time in s."""
    return (
        str(checks.one_of(name, value, HOLDS))
        if isinstance(value, str)
        else checks.nonnegative(name, value, "s")
    )


def check_period(period: float | None, hold: str | float, lagging: bool) -> None:
    """Refuse times without a sampling period."""
    if period is None and (lagging or not isinstance(hold, str)):
        raise ValueError("period must be a number (s) where lag or hold is a time; got None")


def usable(name: str, value: Any) -> float:
    """Return a reading as a number; NaN when it is not finite."""
    if isinstance(value, str) or np.ndim(value) != 0 or value is None:
        raise TypeError(f"{name} must be a number (NaN: no reading); got {value!r}")
    return float(value) if isfinite(value) else nan


def settled(actual: float, command: float) -> bool:
    """Return whether an actual value is near its command."""
    return abs(actual - command) <= SETTLED * abs(command)


def counted(hold: str | float, period: float | None, samples: float, waited: float, near: bool) -> bool:
    """Return whether the law uses a reading: `near` its command, patience at an end, or after a time."""
    if isinstance(hold, str):
        return hold == "none" or near or waited >= PATIENCE
    assert period is not None  # checked by check_period
    return (samples - 1) * period > hold + 1e-9 * period
