"""A time law: arc length over time, in pieces of constant jerk."""

import math
from dataclasses import KW_ONLY
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.halving import halved
from sdpgrind.base.quantities import Described, custom, described, quantity, text, trusted, units_of

# of length and greatest feed, chosen: rounding between the end of a piece and the start of the next
JOINED = 1e-6


class Course(NamedTuple):
    """Course of the contact point along its path: mm, mm/s, mm/s^2, mm/s^3."""

    length: Floats
    feed: Floats
    acceleration: Floats
    jerk: Floats


def _row(unit: str) -> Any:
    """Declare finite numbers for kernels: contiguous, and writeable as the kernels are compiled for."""
    return custom(lambda name, value: np.ascontiguousarray(checks.finite_array(name, value, unit)), unit)


@described("finishing.time_law")
class TimeLaw(Described, ByValue):
    """Arc length over time from rest to rest, in pieces of constant jerk (cubic polynomials).

    A piece with jerk 0 has constant acceleration: the square of the feed is a straight line over arc length.

    Parameters
    ----------
    knots : array, (k + 1,)
        Start times of the pieces, and the end, s, from 0.
    length : array, (k,)
        Arc length at the start of each piece, mm.
    feed : array, (k,)
        Feed there, mm/s.
    acceleration : array, (k,)
        Acceleration along the path just after it, mm/s^2.
    jerk : array, (k,)
        Jerk along the path during the piece, mm/s^3.
    slowed : float
        Duration over that without limits of the joints, unit 1; 1 also where it is not known.
    status : str
        Why this is not the law that was asked for; empty where it is.
    gap : float
        Estimate of the share of the duration that the fastest law near this one may save, unit 1; local, so
        that it says nothing about laws elsewhere (see `lower_bound`). inf: it is not known; see `time_laws`.

    Raises
    ------
    ValueError
        When shapes do not fit together, times do not rise from 0, or a piece does not start at the end of the
        one before.

    Examples
    --------
    >>> motion = {"length": [0.0, 5.0], "feed": [0.0, 100.0], "acceleration": [1e3, -1e3]}
    >>> law = TimeLaw(knots=[0.0, 0.1, 0.2], jerk=[0.0, 0.0], **motion)
    >>> law.duration, [round(float(value), 6) for value in law.at(0.15)]
    (0.2, [8.75, 50.0, -1000.0, 0.0])
    """

    knots: Floats = _row("s")
    length: Floats = _row("mm")
    feed: Floats = _row("mm/s")
    acceleration: Floats = _row("mm/s^2")
    jerk: Floats = _row("mm/s^3")
    _: KW_ONLY
    slowed: float = quantity("1", above=0, default=1.0)
    status: str = text(default="")
    gap: float = custom(lambda name, value: _gap(name, value), "1", default=math.inf)

    def _check(self) -> None:
        self._check_shapes()
        self._check_jumps()

    def _check_shapes(self) -> None:
        """Refuse times that do not rise from 0, and rows without a piece between each two."""
        if self.knots.ndim != 1 or self.knots.size < 2:
            raise self._refused("knots", "of shape (k + 1,) with k >= 1", self.knots.shape)
        if self.knots[0] != 0:
            raise checks.refuse("knots[0]", "0", float(self.knots[0]), units_of(TimeLaw)["knots"])
        for k in np.flatnonzero(np.diff(self.knots) < 0)[:1]:
            pair = float(self.knots[k]), float(self.knots[k + 1])
            raise self._refused("knots", f"rising: knots {k} and {k + 1} go back", pair)
        count = self.knots.size - 1
        for name in Course._fields:
            if getattr(self, name).shape != (count,):
                rule = f"of shape ({count},), a piece between each two knots"
                raise self._refused(name, rule, getattr(self, name).shape)

    def _check_jumps(self) -> None:
        """Refuse a piece that does not start at the end of the one before."""
        ends = moved(np.diff(self.knots), self.length, self.feed, self.acceleration, self.jerk)
        way = max(float(np.ptp(self.length)), float(abs(ends.length[-1] - self.length[0])))
        for name, scale in (("length", way), ("feed", float(np.abs(self.feed).max()))):
            begin, end = getattr(self, name)[1:], getattr(ends, name)[:-1]
            for k in np.flatnonzero(np.abs(begin - end) > JOINED * scale)[:1]:
                raise checks.refuse(
                    f"{name}[{k + 1}]",
                    f"where piece {k} ends, at {end[k]:.6g}",
                    float(begin[k]),
                    units_of(TimeLaw)[name],
                )

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return float(self.knots[-1])

    @property
    def end(self) -> float:
        """Arc length at the end, mm."""
        return float(self._within(self.knots[-1:]).length[0])

    def at(self, time: npt.ArrayLike) -> Course:
        """Return length (mm), feed (mm/s), acceleration (mm/s^2) and jerk (mm/s^3) at times.

        Parameters
        ----------
        time : array, (...)
            Times from the start of the law, s. At a knot the later piece counts.

        Raises
        ------
        ValueError
            When a time is before the start or after the end.
        """
        when = checks.inside("time", time, 0.0, self.duration, "s", slack=1e-9 * self.duration)
        return self._within(np.clip(when, 0.0, self.duration))

    def _within(self, time: Floats) -> Course:
        """Course at times on the law."""
        k = np.clip(np.searchsorted(self.knots, time, side="right") - 1, 0, self.length.size - 1)
        t, s, v, a, j = time - self.knots[k], self.length[k], self.feed[k], self.acceleration[k], self.jerk[k]
        return moved(t, s, v, a, j)

    def time_at(self, length: npt.ArrayLike) -> Floats:
        """Return the times (s) at which the contact point reaches arc lengths (mm).

        Parameters
        ----------
        length : array, (...)
            Arc lengths on the law, mm.
        """
        where = np.clip(
            checks.finite_array("length", length, units_of(TimeLaw)["length"]), self.length[0], self.end
        )
        k = np.clip(np.searchsorted(self.length, where, side="right") - 1, 0, self.length.size - 1)
        # The length never falls: halving finds the time to the last digits.
        return halved(self.knots[k], self.knots[k + 1], lambda time: self._within(time).length < where, 60)

    def slower(self, factor: float) -> "TimeLaw":
        """Return the same course slower: feeds, accelerations and jerks over powers 1 to 3 of the factor.

        Parameters
        ----------
        factor : float
            Factor of the duration (s), >= 1, dimensionless.

        Raises
        ------
        ValueError
            When it is less.
        """
        f = checks.number("factor", factor)
        if f < 1:
            raise checks.refuse("factor", ">= 1", f)
        gap = 1 - (1 - self.gap) / f
        scaled = (self.knots * f, self.length, self.feed / f, self.acceleration / f**2, self.jerk / f**3)
        return TimeLaw(*scaled, slowed=self.slowed * f, status=self.status, gap=gap)

    def __repr__(self) -> str:
        return super().__repr__().replace("gap=", "local gap=")


def _gap(name: str, value: Any) -> float:
    """Check a share of the duration, inf where it is not known."""
    number = float(value)
    if math.isnan(number) or number < 0:
        raise checks.refuse(name, ">= 0, or inf where it is not known", value)
    return number


def advanced(t: Any, s: Any, v: Any, a: Any, j: Any) -> tuple[Any, Any, Any]:
    """Length, feed, acceleration after a time `t` (s) at jerk `j`, from `s`, `v`, `a` (mm, mm/s, mm/s^2)."""
    return s + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j


def moved(t: Floats, s: Floats, v: Floats, a: Floats, j: Floats) -> Course:
    """Course after times `t` (s) at constant jerk `j`, from length `s` with feed `v` and acceleration `a`."""
    return Course(*advanced(t, s, v, a, j), j)


def rated(law: TimeLaw, asked: float) -> TimeLaw:
    """Same law, slowed by its duration over the `asked` one (s); its rows are not checked once more."""
    return trusted(TimeLaw, **{**vars(law), "slowed": law.duration / asked})


def integrated(start: float, durations: Floats, accelerations: Floats, jerks: Floats) -> TimeLaw:
    """Law from rest at `start` (mm) in pieces of given durations, initial accelerations and jerks."""
    t, a, j = durations, accelerations, jerks
    feed = np.concatenate([[0.0], np.cumsum(advanced(t, 0.0, 0.0, a, j)[1])])[:-1]
    length = start + np.concatenate([[0.0], np.cumsum(advanced(t, 0.0, feed, a, j)[0])])[:-1]
    return TimeLaw(np.concatenate([[0.0], np.cumsum(t)]), length, feed, a, j)
