"""Least squares of sizes and powers of parts over the values of the forward model, with first-order noise."""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._identify.machine_model import (
    AREA,
    CONTACT,
    ENERGY,
    FEED_LAG,
    IDLE,
    PLOUGHING,
    POWER_LAG,
    RATIO,
    VALUES,
    WEAR,
    MachineModel,
    Timeline,
)

POSITIVE = (RATIO, AREA, ENERGY)
"""Places of values that are above 0."""
TOLD = 0.3  # chosen: standard deviation, in scales, up to which a linear covariance holds
AIR = 20  # chosen: powers of a wheel in the air from which on they tell the idle power
_WIDEST = 50.0  # chosen: factor from the believed value within which a positive one is sought
_AT_THE_END = 1.01  # chosen: factor of a bound within which a value counts as at it
_LAGS = 2.0  # chosen: s; a greater lag of feed drive or power monitor makes a machine useless
_WEAR = (-0.5, 2.0)  # chosen: mm/mm; a wheel that wears twice as much as the work is dissolved
_STEP = 1e-5  # chosen: scales; forward difference, its error 1e-5 of the slope, far above rounding
_ROUGH, _FINE = 1e-5, 1e-9  # chosen: relative change of the squares that ends the first and the last fit
_ROUNDS = 2  # chosen: fits with the noise of the last; its second change is below 1 % of a deviation
_LEAST_POWER = 0.02  # chosen: share of the greatest power; the noise of less is not in proportion to it
# chosen order: a value of the process that was believed well goes before one that changes from wheel to wheel
_FIRST_LEFT = (PLOUGHING, ENERGY, WEAR, FEED_LAG, POWER_LAG, IDLE, AREA, RATIO)
_EXACT = 1e-3  # chosen: noise over the declared one below which readings count as exact
_SHARE = 0.3  # chosen: part of the greatest entry from which a value belongs to an untold direction


@dataclasses.dataclass(frozen=True)
class FittedPart:
    """Readings of a part that are used: commands over time, rows with a size and with a power.

    `top` is the expected power (W) from which on a reading may be clipped.
    """

    cycle: Cycle
    line: Timeline
    sized: Any
    usable: Any
    top: float = np.inf
    expected: Floats | None = None

    @property
    def powered(self) -> Any:
        """Rows with a power that the monitor surely showed in full."""
        return self.usable if self.expected is None else self.usable & (self.expected < self.top)

    @property
    def waiting(self) -> Any:
        """Rows with a power before the first feed: the wheel, unloaded at the start, is in the air."""
        return self.usable & (self.cycle.infeed <= 0.0)

    @property
    def latest(self) -> float:
        """Greatest contact zero, mm: a wheel that waits in the air touches after the first feed."""
        return 0.0 if self.waiting.sum() >= AIR else np.inf

    def channels(self) -> tuple[tuple[int, Floats, Any, Floats], ...]:
        """Column of the response, readings, their rows and the gaps before them, of size and power."""
        pairs = (self.cycle.size, self.sized), (self.cycle.grinding_power, self.powered)
        return tuple(
            (k, values[rows], rows, serial.gaps(self.cycle.time[rows], int(rows.sum())))
            for k, (values, rows) in enumerate(pairs)
        )


class ChannelNoise(NamedTuple):
    """Noise of size (mm) and power (relative to it): standard deviations, and correlations of neighbours."""

    sd: tuple[float, float]
    correlation: tuple[float, float] = (0.0, 0.0)

    def white(self, off: Floats, channel: int, apart: Floats) -> Floats:
        """Residuals of variance 1 in a channel (0: size, 1: power) without their correlation, of variance 1.

        What a filter leaves of noise varies less than the noise: unscaled, it would weigh less than it tells.
        """
        rho = self.correlation[channel]
        return serial.filtered(off, rho, apart) / float(np.sqrt(1 - rho**2))

    def white_back(self, weights: Floats, channel: int, apart: Floats) -> Floats:
        """Transpose of `white`: weights of the residuals, of those of what it makes of them."""
        rho = self.correlation[channel]
        return serial.filtered_back(weights, rho, apart) / float(np.sqrt(1 - rho**2))


class Residuals(NamedTuple):
    """Residuals over their standard deviations, of size and of power, each over all parts."""

    size: Floats
    power: Floats


@dataclasses.dataclass
class MachineFit:
    """Values of all parts (parts, `VALUES`), those that are sought, and the readings."""

    model: MachineModel
    parts: Sequence[FittedPart]
    values: Floats
    scale: Floats
    free: list[int]
    noise: ChannelNoise
    there: Floats | None = None
    """Slopes at the values; None: to be found."""
    last: tuple[Floats, list[Floats]] | None = None
    """Values last asked for, and their responses: slopes are asked for where the residuals were."""

    @property
    def count(self) -> int:
        """Number of fitted values: shared ones, contact and offset of each part."""
        return len(self.free) + 2 * len(self.parts)

    def vector(self) -> Floats:
        """Return the fitted values: shared ones, then contact and offset part by part."""
        return np.concatenate([self.values[0, self.free], self.values[:, CONTACT:].ravel()])

    def spread(self, vector: Floats) -> Floats:
        """Return the values of all parts."""
        found = self.values.copy()
        found[:, self.free] = vector[: len(self.free)]
        found[:, CONTACT:] = vector[len(self.free) :].reshape(-1, VALUES - CONTACT)
        return found

    def scales(self) -> Floats:
        """Return the scales of `vector`."""
        return np.concatenate([self.scale[self.free], np.tile(self.scale[CONTACT:], len(self.parts))])

    def bounds(self) -> tuple[Floats, Floats]:
        """Return least and greatest values of `vector`."""
        low, high = np.full(VALUES, -np.inf), np.full(VALUES, np.inf)
        low[[*POSITIVE]], high[[*POSITIVE]] = (
            self.scale[[*POSITIVE]] / _WIDEST,
            self.scale[[*POSITIVE]] * _WIDEST,
        )
        low[[PLOUGHING, IDLE, FEED_LAG, POWER_LAG]] = 0.0
        high[[FEED_LAG, POWER_LAG]] = _LAGS
        low[WEAR], high[WEAR] = _WEAR
        if PLOUGHING not in self.free:  # then the idle power takes what is lacking of ploughing
            low[IDLE] = -np.inf
        least, most = (
            np.concatenate([ends[self.free], np.tile(ends[CONTACT:], len(self.parts))])
            for ends in (low, high)
        )
        most[len(self.free) :: 2] = [each.latest for each in self.parts]
        return least, most

    def at_the_end(self) -> list[int]:
        """Return the places of positive values that end at a bound: the readings ask for none or more."""
        found = self.values[0, [*POSITIVE]] / self.scale[[*POSITIVE]]
        ends = np.maximum(found, 1.0 / found) > _WIDEST / _AT_THE_END
        return [place for place, end in zip(POSITIVE, ends, strict=True) if end and place in self.free]

    def standard(self, part: int) -> tuple[Floats, Floats]:
        """Return standard deviations of the sizes (mm) and powers (W) of a part that are used."""
        each = self.parts[part]
        power = each.cycle.grinding_power if each.expected is None else each.expected
        least = _LEAST_POWER * float(np.nanmax(each.cycle.grinding_power[each.usable]))
        sd = np.maximum(power, least)[each.powered] * self.noise.sd[1]
        return np.full(int(each.sized.sum()), self.noise.sd[0]), sd

    def residual(self, vector: Floats, white: bool = True) -> Floats:
        """Return all residuals over their standard deviations, without their correlation if `white`."""
        found = []
        for part, response in enumerate(self._answered(self.spread(vector))):
            sds = self.standard(part)
            for k, read, rows, apart in self.parts[part].channels():
                off = (read - response[rows, k]) / sds[k]
                found.append(self.noise.white(off, k, apart) if white else off)
        return np.concatenate(found)

    def slopes_there(self) -> Floats:
        """Return the slopes at the values, by their scales."""
        if self.there is None:
            self.there = self.slopes(self.vector())
        return self.there * self.scales()

    def slopes(self, vector: Floats) -> Floats:
        """Return the derivatives of `residual`, by forward differences; a part has its own contact."""
        values = self.spread(vector)
        pairs = zip(values, self._answered(values), strict=True)
        each = [self._slopes_of(part, *pair) for part, pair in enumerate(pairs)]
        out = np.zeros((sum(len(rows) for rows in each), self.count))
        shared, begin = len(self.free), 0
        for part, rows in enumerate(each):
            end, own = begin + len(rows), shared + 2 * part
            out[begin:end, :shared], out[begin:end, own : own + 2] = rows[:, :shared], rows[:, shared:]
            begin = end
        return out

    def _slopes_of(self, part: int, values: Floats, base: Floats) -> Floats:
        """Derivatives of a part's residuals by shared values, contact and offset; `base`: its response."""
        reads, sds, moved = self.parts[part], self.standard(part), []
        for place in (*self.free, CONTACT):
            if place == IDLE:  # it is on every power
                moved.append(np.tile([0.0, 1.0], (len(base), 1)))
                continue
            # backward for the contact: a wheel that touches a little later leaves the readings in the air
            step = _STEP * self.scale[place] * (-1.0 if place == CONTACT else 1.0)
            other = values.copy()
            other[place] += step
            moved.append((self.model.response(reads.line, other) - base) / step)
        moved.append(np.tile([1.0, 0.0], (len(base), 1)))  # the offset of the gauge
        columns = np.stack(moved)
        rows = [
            self.noise.white(-columns[:, rows, k] / sds[k], k, apart)
            for k, _, rows, apart in reads.channels()
        ]
        return np.concatenate(rows, axis=1).T

    def solve(self, enough: float) -> None:
        """Move the values to the least squares."""
        low, high = self.bounds()
        begin = np.clip(self.vector(), low + 1e-9 * self.scales(), high - 1e-9 * self.scales())
        found = least_squares(
            self.residual, begin, self.slopes, bounds=(low, high), x_scale=self.scales(),
            ftol=enough, xtol=enough, gtol=enough,
        )  # fmt: skip
        self.values, self.there = self.spread(found.x), found.jac

    def untold(self) -> int | None:
        """Place of a value that the readings do not tell; None: they tell all of them."""
        if not self.free:
            return None
        _, s, vt = np.linalg.svd(self.slopes_there(), full_matrices=False)
        if s[-1] * TOLD >= 1.0:
            return None
        entries = np.abs(vt[-1, : len(self.free)])
        in_it = [p for p, entry in zip(self.free, entries, strict=True) if entry >= _SHARE * entries.max()]
        return next(place for place in _FIRST_LEFT if place in in_it)

    def keep(self, place: int, value: float) -> None:
        """Keep a shared value as it is known."""
        self.free = [other for other in self.free if other != place]
        self.values[:, place], self.there = value, None

    def responses(self) -> list[Floats]:
        """Return sizes (mm) and powers (W) of each part at the values."""
        return self._answered(self.values)

    def _answered(self, values: Floats) -> list[Floats]:
        """Responses of all parts to their values."""
        if self.last is None or not np.array_equal(self.last[0], values):
            pairs = zip(self.parts, values, strict=True)
            self.last = values.copy(), [self.model.response(each.line, own) for each, own in pairs]
        return self.last[1]

    def apart(self) -> Residuals:
        """Return the residuals over their standard deviations, by channel."""
        off = self.residual(self.vector(), white=False)
        return Residuals(*(off[mask] for mask in self.masks()))

    def masks(self) -> tuple[Any, Any]:
        """Rows of all residuals that are of size, and of power."""
        of_size = np.concatenate(
            [np.repeat([True, False], [each.sized.sum(), each.powered.sum()]) for each in self.parts]
        )
        return of_size, ~of_size

    def freedom(self) -> tuple[float, float]:
        """Return the degrees of freedom of size and power: readings less their share of the fitted values."""
        q = np.linalg.qr(self.slopes_there())[0]
        taken = np.sum(q**2, axis=1)
        size, power = (float(mask.sum() - taken[mask].sum()) for mask in self.masks())
        return max(size, 1.0), max(power, 1.0)


def fitted(fit: MachineFit, believed: Floats) -> list[int]:
    """Fit the values and the noise; return the places of those that the readings do not tell."""
    left: list[int] = []
    _drop(fit, believed, left)
    _settle(fit, believed, left, _ROUGH)
    for _ in range(_ROUNDS):
        fit.noise = _seen(fit)
        shown = fit.responses()
        fit.parts = [
            dataclasses.replace(each, expected=response[:, 1])
            for each, response in zip(fit.parts, shown, strict=True)
        ]
        fit.there = None
        _settle(fit, believed, left, _FINE)
    return left


def _settle(fit: MachineFit, believed: Floats, left: list[int], enough: float) -> None:
    """Fit; again without the values that are not told at the solution."""
    fit.solve(enough)
    while _drop(fit, believed, left):
        fit.solve(enough)


def _drop(fit: MachineFit, believed: Floats, left: list[int]) -> bool:
    """Leave values that are not told at what is believed; return whether there were any."""
    before = len(left)
    while (place := fit.untold()) is not None:
        fit.keep(place, float(believed[place]))
        left.append(place)
    return len(left) > before


def _seen(fit: MachineFit) -> ChannelNoise:
    """Return the noise that the residuals show."""
    sds, correlations = [], []
    for k, (off, freedom) in enumerate(zip(fit.apart(), fit.freedom(), strict=True)):
        sds.append(fit.noise.sd[k] * max(float(np.sqrt(off @ off / freedom)), _EXACT))
        apart = np.concatenate([part.channels()[k][3] for part in fit.parts])
        correlations.append(serial.correlation(off, round(off.size - freedom), apart))
    return ChannelNoise((sds[0], sds[1]), (correlations[0], correlations[1]))
