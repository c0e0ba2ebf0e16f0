"""Time and course of the exact fastest cycle: closed forms and Gauss's rule."""

from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.optimize import brentq
from scipy.special import digamma, gamma, hyp2f1, poch

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._plan.envelope import Envelope, EnvelopeLimits, EnvelopePiece

SAMPLES = 200  # chosen: points of each piece of a trajectory
FULL = 30.0  # derived: lag at which a rate is within 1e-13 of the full rate
LATE = 8.0  # chosen: lag from which a series replaces the hypergeometric function
# kinds of a piece: before touch, full rate, spark-out, constant rate, limit of burning
WAIT, START, LINE, HOLD, TRACK = range(5)


Rule: TypeAlias = tuple[Floats, Floats]


class ExactCourse(NamedTuple):
    """Time (s), remaining stock, deflection beyond ploughing (mm), infeed and command rate (mm/s), piece."""

    time: Floats
    remaining: Floats
    y: Floats
    rate: Floats
    command: Floats
    kind: Floats


def fastest(limits: EnvelopeLimits, points: int = 40) -> tuple[float, tuple[float, ...], ExactCourse]:
    """Least time (s), end times of its pieces, and its course, by Gauss's rule with `points` nodes."""
    growth, limits = 1.0 + limits.wear, limits.of_both()
    envelope, rule = Envelope(limits), leggauss(points)
    meet, left = _meeting(limits, envelope)
    touch = limits.core.K0 / limits.rate_max
    start = _start(limits, np.linspace(0.0, meet, SAMPLES))
    times, remaining = touch + start[0], limits.stock - limits.rate_max * start[0] + start[1]
    remaining[-1] = left
    parts: list[tuple[Floats, ...]] = [
        (times, remaining, start[1], start[2], np.full(SAMPLES, limits.rate_max), np.full(SAMPLES, START))
    ]
    ends, now = [float(times[-1])], float(times[-1])
    for piece in reversed([piece for piece in envelope.pieces if piece.low < left]):
        part = _piece(limits, piece, min(left, piece.high), now, rule)
        now = float(part[0][-1])
        ends.append(now)
        parts.append(part)
    wait = [np.array([x]) for x in (0.0, limits.stock, 0.0, 0.0, limits.rate_max, WAIT)]
    columns = [np.concatenate(column) for column in zip(wait, *parts, strict=True)]
    course = ExactCourse(*columns)
    of_work = course._replace(remaining=course.remaining / growth, rate=course.rate / growth)
    return now, tuple(ends), of_work


def _start(limits: EnvelopeLimits, lag: Floats) -> tuple[Floats, Floats, Floats]:
    """Time since contact, deflection and rate at full command, where the rate is u_max (1 - exp(-lag)).

    The time is the integral of y'(v)/(u_max - v), in closed form.
    """
    c, u, share = limits.core, limits.rate_max, -np.expm1(-lag)
    rate = u * share
    time = c.K2 * rate**c.p / u * _start_integral(c.p, lag) + c.K1 * lag
    return np.asarray(time), _kernels.deflections_beyond(rate, c), rate


def _start_integral(p: float, lag: Floats) -> Floats:
    """Hypergeometric function of 1, p, 1 + p at 1 - exp(-lag); near 1 by a series against cancellation."""
    power, weight, offset = _late_series(p)
    left = np.exp(-np.maximum(lag, LATE))[:, None] ** power
    late = np.sum(weight * left * (offset + lag[:, None]), axis=1)
    return np.asarray(np.where(lag < LATE, hyp2f1(1.0, p, 1.0 + p, -np.expm1(-np.minimum(lag, LATE))), late))


@lru_cache(maxsize=16)
def _late_series(p: float) -> tuple[Floats, Floats, Floats]:
    """Powers, weights and offsets of the series about 1."""
    n = np.arange(5.0)
    return n, p * poch(p, n) / gamma(n + 1.0), digamma(n + 1.0) - digamma(n + p)


def _meeting(limits: EnvelopeLimits, envelope: Envelope) -> tuple[float, float]:
    """Lag at which the start meets the bound or ends the stock, and the stock then (mm).

    A bound at full rate is met at the lag `FULL`.
    """

    def left(lag: float) -> float:
        time, y, _ = _start(limits, np.array([lag]))
        return limits.stock - limits.rate_max * float(time[0]) + float(y[0])

    def above(lag: float) -> float:
        return float(_start(limits, np.array([lag]))[1][0]) - envelope(max(left(lag), 0.0))

    last, ends = FULL, left(FULL) <= 0
    if ends:
        last = float(brentq(left, 0.0, FULL, xtol=1e-14, rtol=1e-14))
    if above(last) <= 0:
        return last, 0.0 if ends else left(last)
    meet = float(brentq(above, 0.0, last, xtol=1e-14, rtol=1e-14))
    return meet, max(left(meet), 0.0)


def _piece(
    limits: EnvelopeLimits, piece: EnvelopePiece, high: float, now: float, rule: Rule
) -> tuple[Floats, ...]:
    """Course of a piece from stock `high` (mm) down to its low end."""
    if piece.kind == "track":
        return _tracking(limits, piece, high, now, rule)
    remaining = np.linspace(high, piece.low, SAMPLES)
    if piece.kind == "hold":
        v = _kernels.rate(piece.y, limits.core)
        rates = np.full(SAMPLES, v)
        time, y = now + (high - remaining) / v, np.full(SAMPLES, piece.y)
        return time, remaining, y, rates, rates, np.full(SAMPLES, HOLD)
    y = piece.y + remaining - piece.low
    rates = _kernels.rates(y, limits.core)
    given_back = _antiderivative(limits, rates)
    return now + given_back[0] - given_back, remaining, y, rates, np.zeros(SAMPLES), np.full(SAMPLES, LINE)


def _antiderivative(limits: EnvelopeLimits, rate: Floats) -> Floats:
    """Integral of y'(v)/v: time in which deflection is released."""
    c = limits.core
    power = np.log(rate) if c.p == 1 else c.p / (c.p - 1) * rate ** (c.p - 1)
    return np.asarray(c.K1 * np.log(rate) + c.K2 * power)


def _tracking(
    limits: EnvelopeLimits, piece: EnvelopePiece, high: float, now: float, rule: Rule
) -> tuple[Floats, ...]:
    """Course on the limit of burning, r = m + z(v): the time is the integral of z'(v)/v."""
    first, last = limits.rate_at(high), limits.rate_at(piece.low)
    rates = np.geomspace(first, last, SAMPLES)
    rates[[0, -1]] = first, last
    half = 0.5 * np.diff(rates)
    middle = 0.5 * (rates[1:] + rates[:-1])
    points = middle[:, None] + half[:, None] * rule[0]
    steps = -half * ((limits.slope_of_z(points) / points) @ rule[1])
    time = now + np.concatenate([[0.0], np.cumsum(steps)])
    remaining = limits.margin + np.array([limits.z(v) for v in rates])
    command = rates * (1 - limits.slope_of_y(rates) / limits.slope_of_z(rates))
    y = _kernels.deflections_beyond(rates, limits.core)
    return time, remaining, y, rates, command, np.full(SAMPLES, TRACK)
