"""Limits of harmonics: bands and single ones, and which harmonics are above them."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import another_unit
from sdpgrind.base.units import UM

Limits = tuple[tuple[int, int, float], ...]
"""Lowest and highest harmonic of each limit, upr, and the limit, mm."""
_LOWEST = 2  # derived: upr; 1 upr is the offset
_SURE = 1.96  # derived: standard deviations to both ends of a 95 % interval of a normal amplitude
_USUAL, _TYPICAL = (1e-7, 0.2), 5e-4  # mm; chosen: limits of a harmonic, from a gauge's ball to a forged ring


class Exceeded(NamedTuple):
    """A harmonic above its limit.

    Attributes
    ----------
    upr : int
        Undulations per revolution, unit 1.
    size, limit : float
        Amplitude, or height from valley to peak, and its limit, mm.
    z : float
        Excess over the standard deviation of the size, unit 1; 0 where that is not known.
    """

    upr: int
    size: float
    limit: float
    z: float


class LimitDecision(NamedTuple):
    """Whether the harmonics of a limit keep it; as text one sentence.

    Attributes
    ----------
    low, high : int
        Band of the limit, upr (unit 1).
    upr : int
        Harmonic that makes the decision, upr (unit 1): surely above, or the one that may be largest.
    size, half, limit : float
        Its amplitude, or height from valley to peak, half of its 95 % interval, and the limit, mm.
    above : int
        Harmonics above the limit, unit 1.
    quantity : {"amplitude", "range"}
        Quantity that is limited.
    """

    low: int
    high: int
    upr: int
    size: float
    half: float
    limit: float
    above: int
    quantity: str

    @property
    def found(self) -> str:
        """Decision by the 95 % interval: "accepted", "rejected" or "not decided"."""
        if self.size + self.half <= self.limit:
            return "accepted"
        return "rejected" if self.size - self.half > self.limit else "not decided"

    def __str__(self) -> str:
        band = f"{self.low} to {self.high} upr: largest {self.quantity} at {self.upr} upr"
        name = band if self.high > self.low else f"{self.low} upr: {self.quantity}"
        others = f", {self.above} above it" if self.above > 1 else ""
        size = f"{UM * self.size:.4g} ± {UM * self.half:.2g} µm (95 %)"
        return f"{name} {size}, limit {UM * self.limit:.4g} µm{others}: {self.found}"


def limits_of(name: str, given: Any) -> Limits:
    """Return limits from a mapping of bands or harmonics to lengths (mm), checked, from the lowest on."""
    if isinstance(given, tuple):  # as a file holds them
        return tuple(
            (*_band(name, (low, high)), _limit(f"{name}[{low}, {high}]", most)) for low, high, most in given
        )
    if not isinstance(given, Mapping):
        form = "a mapping as {(2, 15): units.um(0.5), 42: units.um(0.05)} (mm)"
        raise TypeError(f"{name} must be {form}; got {checks.shown(given)}")
    found = [(*_band(name, key), _limit(f"{name}[{key!r}]", most)) for key, most in given.items()]
    return tuple(sorted(found))


def _limit(name: str, given: Any) -> float:
    """A limit in mm; one in micrometres is refused."""
    limit = checks.positive(name, given, "mm")
    if not _USUAL[0] <= limit <= _USUAL[1]:
        raise ValueError(another_unit(name, limit, "mm", _USUAL, _TYPICAL))
    return limit


def _band(name: str, key: Any) -> tuple[int, int]:
    """Lowest and highest harmonic of a key."""
    pair = key if isinstance(key, tuple) else (key, key)
    whole = all(isinstance(each, int | np.integer) and not isinstance(each, bool) for each in pair)
    if len(pair) != 2 or not whole or not _LOWEST <= pair[0] <= pair[1]:
        raise ValueError(
            f"{name} must be of a harmonic from {_LOWEST} upr on, or of a band (low, high); got {key!r}"
        )
    return int(pair[0]), int(pair[1])


def refuse_unmeasured(limits: Limits, upr: Floats) -> None:
    """Refuse a limit of harmonics that are not among those measured."""
    for low, high, _ in limits:
        wanted = np.arange(low, high + 1)
        missing = wanted[~np.isin(wanted, upr)]
        if missing.size:
            held = f"those up to {upr.max():g} upr" if upr.size else "none"
            raise ValueError(
                f"limits must be of harmonics that were measured, {held}; got one of {missing[0]} upr:"
                f" give upr_max={high}, of more points if need be"
            )


def exceeded(limits: Limits, upr: Floats, size: Floats, sd: Floats) -> tuple[Exceeded, ...]:
    """Return each harmonic above a limit, by limit and harmonic (size, sd in mm)."""
    found = []
    for low, high, most in limits:
        for k in np.flatnonzero((upr >= low) & (upr <= high) & (size > most)):
            excess = float(size[k]) - most
            z = excess / float(sd[k]) if sd[k] > 0 else np.inf
            found.append(Exceeded(int(upr[k]), float(size[k]), most, z))
    return tuple(found)


def decision(
    limit: tuple[int, int, float], upr: Floats, size: Floats, sd: Floats, quantity: str
) -> LimitDecision:
    """Return the decision on a limit by the harmonic that makes it (size, sd in mm).

    One that is surely above, or else the one that may be largest: sizes of a band are known unequally well.
    """
    low, high, most = limit
    within = np.flatnonzero((upr >= low) & (upr <= high))
    half = _SURE * sd[within]
    sure, may = size[within] - half, size[within] + half
    worst = int(np.argmax(sure)) if np.any(sure > most) else int(np.argmax(may))
    above = int(np.sum(size[within] > most))
    here = within[worst]
    return LimitDecision(
        low, high, int(upr[here]), float(size[here]), float(half[worst]), most, above, quantity
    )


def least_limits(limits: Limits, upr: Floats) -> Floats:
    """Return the least limit of each harmonic, mm; NaN without one."""
    least = np.full(upr.size, np.inf)
    for low, high, most in limits:
        within = (upr >= low) & (upr <= high)
        least[within] = np.minimum(least[within], most)
    return np.where(np.isfinite(least), least, np.nan)
