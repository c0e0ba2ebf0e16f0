"""Linear lag of the parts of a log, by one search: contact zero and first rate of each part are linear.

Size = commanded infeed + zero - deflection, deflection' = command - deflection/time constant; the time
constant is common to all parts. Residuals are filtered by a given correlation, so that sums of squares of
several alignments of the command can be compared.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from sdpgrind.base import serial
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.plunge._identify.time_constant import RANGE
from sdpgrind.plunge._plan.replay_kernels import lags

_GRID = 25  # chosen: time constants of the first search, 1.3 apart; one valley between neighbours
_FITTED = 3  # derived: time constant, contact zero and first deflection
_STEP = 1e-4  # chosen: relative change of the time constant for a derivative; error 1e-8 of it


class LagPart(NamedTuple):
    """Rows of a part: time (s), command that holds from the row on (mm/s), size (mm; NaN: no reading)."""

    time: Floats
    command_rate: Floats
    size: Floats


class LagFit(NamedTuple):
    """Fit of the parts: time constant (s), sum of squares of the filtered residuals (mm^2), correlation used.

    For each part contact zero and first deflection (mm), times (s) and residuals (mm).
    """

    parts: tuple[LagPart, ...]
    time_constant: float
    square: float
    filter: float
    values: tuple[Floats, ...]
    times: tuple[Floats, ...]
    residuals: tuple[Floats, ...]

    @property
    def readings(self) -> int:
        """Number of sizes."""
        return sum(left.size for left in self.residuals)

    @property
    def sizes(self) -> list[Floats]:
        """Sizes of each part, mm."""
        return [part.size[np.isfinite(part.size)] for part in self.parts]

    @property
    def travel(self) -> float:
        """Greatest change of the size of a part, mm."""
        return float(max(np.nanmax(part.size) - np.nanmin(part.size) for part in self.parts))

    @property
    def correlation(self) -> float:
        """Correlation of neighbouring residuals, mean over parts."""
        each = zip(self.times, self.residuals, strict=True)
        return float(np.mean([serial.correlation(e, _FITTED, serial.gaps(t, t.size)) for t, e in each]))

    @property
    def noise_sd(self) -> float:
        """Standard deviation of a size about the lag, mm."""
        freedom = max(self.readings - 2 * len(self.parts) - 1, 1)
        return float(np.sqrt(self.square / freedom / (1 - self.filter**2)))


def fitted(parts: Sequence[LagPart], rho: float) -> LagFit:
    """Least squares of the filtered residuals of all parts."""
    each = [_rows(part) for part in parts]

    def square(logarithm: float) -> float:
        return sum(_projected(rows, float(np.exp(logarithm)), rho)[0] for rows in each)

    grid = np.linspace(float(np.log(RANGE[0])), float(np.log(RANGE[1])), _GRID)
    best = int(np.argmin([square(each) for each in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)]
    tau = float(np.exp(minimize_scalar(square, bounds=ends, method="bounded", options={"xatol": 1e-6}).x))
    squares, values, residuals = zip(*(_projected(rows, tau, rho) for rows in each), strict=True)
    times = tuple(rows.part.time[rows.read] for rows in each)
    return LagFit(tuple(parts), tau, float(sum(squares)), rho, values, times, residuals)


class _LagRows(NamedTuple):
    """What does not depend on the time constant: steps (s) and infeed (mm) of a part; rows that are read, and
    steps between those over the median one.
    """

    part: LagPart
    step: Floats
    infeed: Floats
    read: Bools
    apart: Floats


def _rows(part: LagPart) -> _LagRows:
    step, read = np.diff(part.time), np.isfinite(part.size)
    infeed = np.concatenate([[0.0], np.cumsum(part.command_rate[:-1] * step)])
    return _LagRows(part, step, infeed, read, serial.gaps(part.time[read], int(read.sum())))


def _projected(rows: _LagRows, tau: float, rho: float) -> tuple[float, Floats, Floats]:
    """Sum of squares (filtered), best contact zero and first deflection, residuals."""
    target = (rows.part.size - _driven(rows, tau))[rows.read]
    columns = _free(rows.part, tau)[rows.read]
    white = _white(np.column_stack([target, columns]), rho, rows.apart)
    value, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
    left = white[:, 0] - white[:, 1:] @ value
    return float(left @ left), np.asarray(value), np.asarray(target - columns @ value)


def _driven(rows: _LagRows, tau: float) -> Floats:
    """Size (mm) of a part that starts at 0 without deflection."""
    pole = np.exp(-rows.step / tau)
    return np.asarray(rows.infeed - lags(0.0, pole, rows.part.command_rate[:-1] * tau * (1 - pole)))


def _free(part: LagPart, tau: float) -> Floats:
    """Change of the size by contact zero and first deflection, (n, 2)."""
    return np.column_stack([np.ones(part.time.size), -np.exp(-(part.time - part.time[0]) / tau)])


def _white(columns: Floats, rho: float, apart: Floats) -> Floats:
    return np.ascontiguousarray(serial.filtered(columns.T, rho, apart).T)


def information(part: LagPart, value: Floats, tau: float, rho: float) -> float:
    """Information on the time constant (1/s^2, noise of filtered readings 1 mm), the other two unknown."""
    rows = _rows(part)
    low, high = (
        _driven(rows, tau * (1 + change)) + _free(part, tau * (1 + change)) @ value
        for change in (-_STEP, _STEP)
    )
    slope = (high - low) / (2 * _STEP * tau)
    apart = serial.gaps(part.time, part.time.size)
    white = _white(np.column_stack([slope, _free(part, tau)]), rho, apart)
    across, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
    left = white[:, 0] - white[:, 1:] @ across
    return float(left @ left)
