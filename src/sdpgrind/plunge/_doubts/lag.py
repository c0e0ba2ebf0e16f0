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
from sdpgrind.base.checks import Floats
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

    def square(logarithm: float) -> float:
        return sum(_projected(part, float(np.exp(logarithm)), rho)[0] for part in parts)

    grid = np.linspace(float(np.log(RANGE[0])), float(np.log(RANGE[1])), _GRID)
    best = int(np.argmin([square(each) for each in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)]
    tau = float(np.exp(minimize_scalar(square, bounds=ends, method="bounded", options={"xatol": 1e-6}).x))
    squares, values, residuals = zip(*(_projected(part, tau, rho) for part in parts), strict=True)
    times = tuple(part.time[np.isfinite(part.size)] for part in parts)
    return LagFit(tuple(parts), tau, float(sum(squares)), rho, values, times, residuals)


def _projected(part: LagPart, tau: float, rho: float) -> tuple[float, Floats, Floats]:
    """Sum of squares (filtered), best contact zero and first deflection, residuals."""
    read = np.isfinite(part.size)
    target, columns = (part.size - _driven(part, tau))[read], _free(part, tau)[read]
    white = _white(np.column_stack([target, columns]), part.time[read], rho)
    value, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
    left = white[:, 0] - white[:, 1:] @ value
    return float(left @ left), np.asarray(value), np.asarray(target - columns @ value)


def _driven(part: LagPart, tau: float) -> Floats:
    """Size (mm) of a part that starts at 0 without deflection."""
    step = np.diff(part.time)
    pole = np.exp(-step / tau)
    infeed = np.concatenate([[0.0], np.cumsum(part.command_rate[:-1] * step)])
    return np.asarray(infeed - lags(0.0, pole, part.command_rate[:-1] * tau * (1 - pole)))


def _free(part: LagPart, tau: float) -> Floats:
    """Change of the size by contact zero and first deflection, (n, 2)."""
    return np.column_stack([np.ones(part.time.size), -np.exp(-(part.time - part.time[0]) / tau)])


def _white(columns: Floats, time: Floats, rho: float) -> Floats:
    apart = serial.gaps(time, time.size)
    return np.column_stack([serial.filtered(column, rho, apart) for column in columns.T])


def information(part: LagPart, value: Floats, tau: float, rho: float) -> float:
    """Information on the time constant (1/s^2, noise of filtered readings 1 mm), the other two unknown."""
    low, high = (
        _driven(part, tau * (1 + change)) + _free(part, tau * (1 + change)) @ value
        for change in (-_STEP, _STEP)
    )
    slope = (high - low) / (2 * _STEP * tau)
    white = _white(np.column_stack([slope, _free(part, tau)]), part.time, rho)
    across, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
    left = white[:, 0] - white[:, 1:] @ across
    return float(left @ left)
