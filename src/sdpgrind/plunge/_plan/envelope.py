"""Exact fastest infeed: Dong, Danai and Malkin (2004), Part 2, with a proof.

Let r be the remaining stock and y the deflection beyond ploughing. The wheel never moves back, so that y - r
never falls; the time is the integral of dr/v(y), which falls with any increase of y. Limits on burning and
roundness bound y at each r by Y(r). The greatest bound with a slope of at most 1, Y~(r) = min over s <= r of
Y(s) + r - s, can itself be followed, so no other course is faster anywhere. From the start the infeed runs at
full rate until it meets Y~.

Where the wheel loses a radius of gamma times the stock, work and wheel lose (1 + gamma) r together, at a
rate of (1 + gamma) v: in these two the equations are those of a wheel that keeps its size, with other
coefficients.

Pieces of Y~ from the end of the cycle: lines of slope 1 (no command: spark-out), the curve on which damage
equals the stock less the margin, and levels of constant rate.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.kernels import PlungeCore

SCAN = 512  # chosen: nodes of the search for slopes of 1 of the limit on burning; fewer could miss a pair


@dataclass(frozen=True)
class EnvelopePiece:
    """Interval [low, high] of stock (mm) of one kind: "line", "hold" or "track"; y at its low end (mm)."""

    kind: str
    low: float
    high: float
    y: float


@dataclass(frozen=True)
class EnvelopeLimits:
    """Limits of the rate: command, burning (inf: none), end of the cycle (mm/s); margin and stock (mm).

    `wear` is the radius that the wheel loses over that of the work.
    """

    core: PlungeCore
    rate_max: float
    burn_rate: float
    final_rate: float
    margin: float
    stock: float
    wear: float = field(default=0.0, kw_only=True)

    def of_both(self) -> Self:
        """Limits of the radius that work and wheel lose together, without wear."""
        c, g = self.core, 1.0 + self.wear
        core = c._replace(
            K1=c.K1 / g, K2=c.K2 / g**c.p, reach=c.reach * g**0.75,
            heat0=c.heat0 * g**0.25, heat1=c.heat1 * g**-0.75, heat2=c.heat2 * g ** (0.25 - c.p),
        )  # fmt: skip
        grown = {name: g * getattr(self, name) for name in ("burn_rate", "final_rate", "margin", "stock")}
        return replace(self, core=core, wear=0.0, **grown)

    def y(self, v: float) -> float:
        """Deflection beyond ploughing, mm."""
        return float(_kernels.beyond(v, self.core))

    def z(self, v: float) -> float:
        """Depth of damage, mm."""
        return float(_kernels.burn_depth(v, self.core))

    @property
    def burns(self) -> bool:
        """Whether the greatest rate burns."""
        return self.burn_rate < self.rate_max

    def slope_of_y(self, v: Floats) -> Floats:
        """dy/dv, s."""
        c = self.core
        return c.K1 + c.p * c.K2 * v ** (c.p - 1)

    def slope_of_z(self, v: Floats) -> Floats:
        """dz/dv, s."""
        c = self.core
        heat = c.heat0 + c.heat1 * v + c.heat2 * v**c.p
        rise = (c.heat1 + c.p * c.heat2 * v ** (c.p - 1)) / heat
        return np.asarray(c.reach * v**0.25 * ((np.log(heat / v**0.25) - 1) / (4 * v) + rise))

    def rate_at(self, r: float) -> float:
        """Greatest rate (mm/s) whose damage is at most the stock `r` less the margin."""
        if not self.burns or self.z(self.rate_max) <= r - self.margin:
            return self.rate_max
        if r - self.margin <= self.z(self.burn_rate):
            return self.burn_rate
        return float(_kernels.rate_of_burn(r - self.margin, self.burn_rate, self.rate_max, self.core))


class Envelope:
    """Bound Y~ in pieces, from size upwards."""

    def __init__(self, limits: EnvelopeLimits) -> None:
        self.limits = limits
        self.pieces = tuple(_pieces(limits))

    def __call__(self, r: float) -> float:
        """Greatest deflection beyond ploughing (mm) at the remaining stock `r` (mm)."""
        piece = next(piece for piece in self.pieces if r <= piece.high)
        if piece.kind == "line":
            return piece.y + r - piece.low
        return piece.y if piece.kind == "hold" else self.limits.y(self.limits.rate_at(r))


def _pieces(limits: EnvelopeLimits) -> Iterator[EnvelopePiece]:
    """Running minimum of Y - r: the limits where they set a new one, else a line of slope 1."""
    low, level = 0.0, limits.y(min(limits.final_rate, limits.rate_at(0.0)))
    for falling in _falling(limits):
        if limits.y(limits.rate_at(falling.high)) - falling.high >= level:
            continue
        start = _crossing(limits, falling, level)
        if start > low:
            yield EnvelopePiece("line", low, start, level + low)
        yield EnvelopePiece(falling.kind, start, falling.high, limits.y(limits.rate_at(start)))
        low, level = falling.high, limits.y(limits.rate_at(falling.high)) - falling.high


def _falling(limits: EnvelopeLimits) -> Iterator[EnvelopePiece]:
    """Intervals on which the limits rise no faster than the stock."""
    top = 0.0
    if limits.burns:
        top = limits.margin + limits.z(limits.rate_max)
        if limits.margin > 0:
            yield EnvelopePiece("hold", 0.0, limits.margin, limits.y(limits.burn_rate))
        for first, last in _slower(limits):
            yield EnvelopePiece(
                "track",
                limits.margin + max(limits.z(first), 0.0),
                limits.margin + limits.z(last),
                limits.y(first),
            )
    yield EnvelopePiece("hold", top, np.inf, limits.y(limits.rate_max))


def _slower(limits: EnvelopeLimits) -> Iterator[tuple[float, float]]:
    """Ranges of rate (mm/s) on the limit of burning in which deflection rises no faster than the stock."""

    def faster(v: float) -> float:
        return float(limits.slope_of_y(np.asarray(v)) - limits.slope_of_z(np.asarray(v)))

    scan = np.geomspace(limits.burn_rate, limits.rate_max, SCAN)
    scan[[0, -1]] = limits.burn_rate, limits.rate_max
    rising = limits.slope_of_y(scan) > limits.slope_of_z(scan)
    changes = [
        float(brentq(faster, scan[k], scan[k + 1], xtol=1e-16)) for k in np.flatnonzero(np.diff(rising))
    ]
    ends = [limits.burn_rate, *changes, limits.rate_max]
    first = int(rising[0])
    yield from zip(ends[first:-1:2], ends[first + 1 :: 2], strict=True)


def _crossing(limits: EnvelopeLimits, falling: EnvelopePiece, level: float) -> float:
    """Stock at which y - r of a falling interval reaches `level` (mm)."""
    if falling.y - falling.low <= level:
        return falling.low
    if falling.kind == "hold":
        return falling.y - level

    def off(v: float) -> float:
        return limits.y(v) - limits.margin - limits.z(v) - level

    first, last = limits.rate_at(falling.low), limits.rate_at(falling.high)
    return limits.margin + limits.z(float(brentq(off, first, last, xtol=1e-16, rtol=1e-14)))
