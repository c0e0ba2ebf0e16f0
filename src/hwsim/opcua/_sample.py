"""A sample of a machine as its client reads it, and values on their way to and from OPC UA."""

from collections.abc import Mapping, Sequence
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from asyncua import ua

from hwsim._part.motions import as_table
from sdpgrind.base import checks

_ROUNDING = 1e-9  # relative; chosen: what the plants allow


class ReadSample(NamedTuple):
    """A sample as this client read it."""

    reading: Mapping[str, Any]
    sequence: int
    time: float  # s
    event: int
    done: bool
    part: int
    aborts: int
    aborted: str
    stops: int
    paused: bool
    at: int  # monotonic, ns, when it was asked for
    spread: float  # s between the oldest and the newest source time stamp
    bad: int  # measurements whose quality is not good


def good(told: ua.DataValue) -> bool:
    """Whether a value has a good quality."""
    return told.Value is not None and (told.StatusCode is None or told.StatusCode.is_good())


def read_number(told: ua.DataValue) -> Any:
    """A measurement: a number or an array; NaN where its quality is not good."""
    return told.Value.Value if good(told) else nan


def spread(told: Sequence[ua.DataValue]) -> float:
    """Time (s) between the oldest and the newest source time stamp of a list."""
    stamps = [each.SourceTimestamp for each in told if each.SourceTimestamp is not None]
    return float((max(stamps) - min(stamps)).total_seconds()) if stamps else 0.0


def plain(value: Any) -> Any:
    """A number, or a list of numbers or of rows."""
    if isinstance(value, float | int):
        return float(value)
    return np.asarray(getattr(value, "segments", value), float).tolist()


def checked(name: str, value: Any, unit: str) -> Any:
    """Return a command as it goes out, a finite float or array, in the words of plants."""
    table = as_table(value)
    if isinstance(table, list | tuple | np.ndarray) and np.ndim(table):
        return checks.finite_array(name, table, unit)
    return checks.number(name, table, unit)


def number(value: Any) -> ua.Variant:
    """A command as a value of OPC UA."""
    told = plain(value)
    return ua.Variant(told, ua.VariantType.Double, is_array=isinstance(told, list))


def widened(ends: tuple[float, float]) -> tuple[float, float]:
    """A range with room for the rounding of commands on its ends."""
    room = _ROUNDING * max(abs(end) for end in ends) if isfinite(sum(ends)) else 0.0
    return ends[0] - room, ends[1] + room


def within(name: str, value: Any, ends: tuple[float, float], unit: str) -> None:
    """Refuse a command outside its range."""
    low, high = widened(ends)
    numbers = np.asarray(value, dtype=float)
    if numbers.size and not (low <= numbers.min() and numbers.max() <= high):
        raise checks.refuse(name, f"in [{ends[0]:g}, {ends[1]:g}]", value, unit)
