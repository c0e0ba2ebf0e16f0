"""Coordinates along a locus must be strictly monotone."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def strictly(column: Any) -> bool:
    """Return whether a column is strictly monotone."""
    steps = np.diff(np.asarray(column))
    return bool(np.all(steps > 0) or np.all(steps < 0))


def told(columns: Mapping[str, Floats]) -> str:
    """Return the names of the strictly monotone columns as the end of a message."""
    single = [name for name, column in columns.items() if strictly(column)]
    return (
        f"but {' and '.join(single)} {'are' if len(single) > 1 else 'is'}"
        if single
        else "and nothing else is"
    )


def check_single(along: str, columns: Mapping[str, Floats], slopes: Mapping[str, Floats]) -> None:
    """Refuse a coordinate that turns or has a zero slope along the curve."""
    if not strictly(columns[along]):
        raise ValueError(f"along must be single-valued on the locus; {along!r} is not, {told(columns)}")
    if np.any(slopes[along] == 0):
        raise ValueError(
            f"along must change all along the locus; {along!r} stands still somewhere, {told(columns)}"
        )


def check_hidden(name: str, hidden: Floats, slope: Floats) -> None:
    """Refuse a hidden state that turns: at a fold the loop slope vanishes and no gain is stable."""
    if not strictly(hidden):
        raise ValueError(f"{name} must change strictly one way along the stretch; it turns, as at a fold")
    if np.any(np.sign(hidden[-1] - hidden[0]) * slope < 0):
        raise ValueError(f"hidden_slope must have the sign of the change of {name} everywhere; it has not")


def placed(name: str, value: object, low: float, high: float, unit: str) -> float:
    """Return a number clamped to a range, checked to rounding."""
    rounding = 1e-12 * (high - low)
    return float(np.clip(checks.within(name, value, low - rounding, high + rounding, unit), low, high))
