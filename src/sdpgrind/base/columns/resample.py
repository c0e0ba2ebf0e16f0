"""Columns at the multiples of a step: means of fast ones, lines through slow ones, commands as held."""

from collections.abc import Mapping

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.table import is_command

_ROUNDING = 1e-9  # chosen: steps; above the rounding of sums of equal steps
Series = tuple[Floats, Column]
"""Times (s) and values of one column."""


def resampled(series: Mapping[str, Series], step: float, where: str) -> tuple[Floats, dict[str, Column]]:
    """Return instants (s), the multiples of `step` (s) within all columns, and each column there."""
    _refuse_finer(series, step, where)
    first = max(float(time[0]) for time, _ in series.values())
    last = min(float(time[-1]) for time, _ in series.values())
    count = np.arange(np.ceil(first / step - _ROUNDING), np.floor(last / step + _ROUNDING) + 1)
    if not count.size:
        raise ValueError(
            f"{where}: columns must share a multiple of resample = {step:g} s; they share"
            f" {first:g} to {last:g} s"
        )
    return count * step, {name: _at(name, *each, count, step) for name, each in series.items()}


def _refuse_finer(series: Mapping[str, Series], step: float, where: str) -> None:
    steps = {name: float(np.median(np.diff(time))) for name, (time, _) in series.items() if time.size > 1}
    if len(steps) < len(series):
        name = next(name for name in series if name not in steps)
        raise ValueError(f"{where}: {name} must have two samples or more to be resampled")
    finest = min(steps, key=lambda name: steps[name])
    if step < steps[finest] * (1 - _ROUNDING):
        raise ValueError(
            f"{where}: resample must be >= the finest step, {steps[finest]:.6g} s of {finest}; got {step:g} s"
        )


def _at(name: str, time: Floats, values: Column, count: Floats, step: float) -> Column:
    """One column at the instants `count` times `step`."""
    if is_command(name) or values.dtype.kind != "f":
        held = np.searchsorted(time / step, count + _ROUNDING, side="right") - 1
        return np.asarray(values[np.maximum(held, 0)])
    if float(np.median(np.diff(time))) <= step / 2 * (1 + _ROUNDING):
        return _means(time / step, values, count)
    known = np.isfinite(values)
    if not np.any(known):
        return np.full(count.size, np.nan)
    inside = np.clip(count * step, time[0], time[-1])  # rounding of the last multiple
    return np.interp(inside, time[known], values[known], left=np.nan, right=np.nan)


def _means(place: Floats, values: Floats, count: Floats) -> Floats:
    """Means over half a step on either side, without missing values."""
    first = np.searchsorted(place, count - 0.5 - _ROUNDING)
    after = np.searchsorted(place, count + 0.5 + _ROUNDING)
    known = np.isfinite(values)
    sums = np.concatenate([[0.0], np.cumsum(np.where(known, values, 0.0))])
    many = np.concatenate([[0], np.cumsum(known)])
    with np.errstate(invalid="ignore"):
        return np.asarray((sums[after] - sums[first]) / (many[after] - many[first]))
