"""Motion of the pusher tip: segments of constant acceleration; position is continuous, speed may jump."""

from math import sqrt
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from centering.push._profile.rows import STILL, jerk_rise, move_arguments, scaled
from centering.push._profile.timing import move_peak
from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity, units_of


def column(unit: str, **options: Any) -> Any:
    """Declare a field with a finite number for each segment; a single number is a column of one."""

    def check(name: str, value: Any) -> Floats:
        return lasting(np.atleast_1d(checks.finite_array(name, value, unit)))

    return custom(check, unit, **options)


@described("centering.tip_profile")
class TipProfile(ByValue, Described):
    """Motion of the pusher tip in segments of constant acceleration.

    Position counts from the first touch of a part at rest, positive toward the axis of the table. Between
    segments the speed may jump, the position may not.

    Parameters
    ----------
    duration, velocity, acceleration : array, (n,)
        Of each segment: duration (s, > 0), initial speed (mm/s), acceleration (mm/s^2).
    start : float
        Position at the beginning, mm; negative: a gap to the part.

    Raises
    ------
    ValueError
        When a value is not finite, a duration is not positive, the lengths differ or there is no segment.

    Examples
    --------
    >>> profile = TipProfile.move(7.5, speed=83.333, acceleration=2560.0)  # mm, mm/s, mm/s^2
    >>> round(profile.total_time, 6), round(profile.stroke, 6)
    (0.122552, 7.5)
    """

    duration: Floats = column("s")
    velocity: Floats = column("mm/s")
    acceleration: Floats = column("mm/s^2")
    start: float = quantity("mm", default=0.0)

    def _check(self) -> None:
        sizes = {self.duration.shape, self.velocity.shape, self.acceleration.shape}
        if len(sizes) > 1 or self.duration.ndim != 1 or self.duration.size == 0:
            raise checks.refuse("duration, velocity and acceleration", "of one length >= 1", sizes)
        if not np.all(self.duration > 0.0):
            raise self._refused("duration", "> 0 in every segment", float(self.duration.min()))

    @classmethod
    def constant_speed(cls, speed: float, duration: float, *, start: float = 0.0) -> Self:
        """Return a tip that advances at constant speed from the first instant on.

        Parameters
        ----------
        speed, duration : float
            Of the motion, mm/s, s, > 0.
        start : float
            Position at the beginning, mm.

        Examples
        --------
        >>> round(TipProfile.constant_speed(10.0, 0.4).stroke, 12)  # mm
        4.0
        """
        v = checks.positive("speed", speed, "mm/s")
        return cls(
            np.array([checks.positive("duration", duration, units_of(cls)["duration"])]),
            np.array([v]),
            np.zeros(1),
            start,
        )

    @classmethod
    def move(cls, distance: float, speed: float, acceleration: float, *, start: float = 0.0) -> Self:
        """Return the fastest move from rest to rest within two limits; Mears (5.9)-(5.16), corrected.

        Parameters
        ----------
        distance : float
            Travel, mm; negative: away from the axis. Below ``speed**2 / acceleration`` the speed is not
            reached.
        speed, acceleration : float
            Limits, mm/s, mm/s^2, > 0.
        start : float
            Position at the beginning, mm.

        Examples
        --------
        >>> round(TipProfile.move(0.1, speed=80.0, acceleration=2560.0).total_time, 6)  # s: 2 sqrt(d / a)
        0.0125
        """
        d, v, a = move_arguments(distance, speed, acceleration)
        top = min(v, sqrt(a * abs(d)))
        rise, cruise = top / a, abs(d) / top - top / a
        return cls._from_rows(scaled([(rise, 0.0, a), (cruise, top, 0.0), (rise, top, -a)], d), start)

    @classmethod
    def jerk_limited(
        cls, distance: float, speed: float, acceleration: float, jerk: float, *, start: float = 0.0
    ) -> Self:
        """Return the fastest move from rest to rest with limited jerk, in seven phases.

        Sixteen steps of constant acceleration replace each ramp of the acceleration: time, speeds and end are
        exact.

        Parameters
        ----------
        distance : float
            Travel, mm; negative: away from the axis.
        speed, acceleration, jerk : float
            Limits, mm/s, mm/s^2, mm/s^3, > 0.
        start : float
            Position at the beginning, mm.

        Examples
        --------
        >>> profile = TipProfile.jerk_limited(1.0, speed=120.0, acceleration=2500.0, jerk=1e5)
        >>> round(profile.total_time, 6), round(profile.stroke, 9)  # s, mm
        (0.068399, 1.0)
        """
        d, v, a = move_arguments(distance, speed, acceleration)
        top = move_peak(abs(d), speed=v, acceleration=a, jerk=checks.positive("jerk", jerk, "mm/s^3"))
        rise = jerk_rise(top, a, jerk)
        cruise = (abs(d) / top - sum(t for t, _, _ in rise), top, 0.0)
        fall = [(t, u + b * t, -b) for t, u, b in reversed(rise)]
        return cls._from_rows(scaled([*rise, cruise, *fall], d), start)

    @classmethod
    def sampled(cls, time: npt.ArrayLike, position: npt.ArrayLike) -> Self:
        """Return a tip that moves at constant speed from sample to sample.

        Parameters
        ----------
        time, position : array, (n,)
            Samples, s, increasing, and mm from the first touch of a part at rest.

        Raises
        ------
        ValueError
            When there are fewer than two samples, the times do not increase or the lengths differ.

        Examples
        --------
        >>> TipProfile.sampled([0.0, 0.1, 0.2], [-1.0, 0.0, 0.5]).velocity  # mm/s
        array([10.,  5.])
        """
        t, y = checks.finite_array("time", time, "s"), checks.finite_array("position", position, "mm")
        if t.ndim != 1 or t.size < 2 or t.shape != y.shape:
            raise checks.refuse("time and position", "of one length >= 2", (t.shape, y.shape))
        if not np.all(np.diff(t) > 0.0):
            raise checks.refuse("time", "increasing", t, "s")
        return cls(np.diff(t), np.diff(y) / np.diff(t), np.zeros(t.size - 1), float(y[0]))

    @classmethod
    def _from_rows(cls, rows: "list[tuple[float, float, float]] | Floats", start: float) -> Self:
        """Profile of rows (duration, velocity, acceleration)."""
        columns = np.asarray(rows, dtype=float).T
        return cls(columns[0], columns[1], columns[2], start)

    @property
    def segments(self) -> Floats:
        """Duration (s), initial velocity (mm/s) and acceleration (mm/s^2) of each segment, (n, 3)."""
        return np.column_stack((self.duration, self.velocity, self.acceleration))

    @property
    def total_time(self) -> float:
        """Duration of all segments, s."""
        return float(self.duration.sum())

    @property
    def stroke(self) -> float:
        """Position at the end less that at the start, mm."""
        return float(self._moved.sum())

    @property
    def end(self) -> float:
        """Position at the end, mm."""
        return self.start + self.stroke

    @property
    def final_velocity(self) -> float:
        """Speed at the end of the last segment, mm/s; 0 where it is rounding of the greatest speed."""
        ends = self.velocity + self.acceleration * self.duration
        greatest = max(float(np.abs(self.velocity).max()), float(np.abs(ends).max()))
        return float(ends[-1]) if abs(ends[-1]) > STILL * greatest else 0.0

    def position(self, time: npt.ArrayLike) -> Floats:
        """Return the position of the tip, mm; after the end the tip keeps its last speed.

        Parameters
        ----------
        time : array-like
            Times from the beginning, s; before it the tip is at `start`.

        Examples
        --------
        >>> TipProfile.constant_speed(10.0, 0.4, start=-1.0).position([0.0, 0.1])
        array([-1.,  0.])
        """
        t, row, into = self._locate(time)
        begins = self.start + np.concatenate(((0.0,), np.cumsum(self._moved)))
        speed, acceleration = self._laws
        return np.asarray(begins[row] + (speed[row] + 0.5 * acceleration[row] * into) * into).reshape(t.shape)

    def velocity_at(self, time: npt.ArrayLike) -> Floats:
        """Return the speed of the tip, mm/s; at a jump the speed after it.

        Parameters
        ----------
        time : array-like
            Times from the beginning, s.

        Examples
        --------
        >>> TipProfile.move(1.0, speed=10.0, acceleration=1000.0).velocity_at([0.0, 0.005, 0.05])
        array([ 0.,  5., 10.])
        """
        t, row, into = self._locate(time)
        speed, acceleration = self._laws
        return np.asarray(speed[row] + acceleration[row] * into).reshape(t.shape)

    def _locate(self, time: npt.ArrayLike) -> tuple[Floats, Any, Floats]:
        """Times, index of the segment at each (n: after the end), and time since its beginning (s)."""
        t = checks.finite_array("time", time, "s")
        begins = np.concatenate(((0.0,), np.cumsum(self.duration)))
        row = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
        return t, row, np.maximum(t - begins[row], 0.0)

    @property
    def _laws(self) -> tuple[Floats, Floats]:
        """Initial velocity and acceleration of each segment, and of the motion after the last."""
        return np.append(self.velocity, self.final_velocity), np.append(self.acceleration, 0.0)

    def then(self, other: "TipProfile") -> Self:
        """Return this profile followed by another one, moved to begin where this one ends.

        Parameters
        ----------
        other : TipProfile
            Profile that follows; its `start` (mm) is ignored.

        Examples
        --------
        >>> there = TipProfile.move(2.0, speed=10.0, acceleration=1000.0)  # mm, mm/s, mm/s^2
        >>> there.then(TipProfile.move(-1.5, speed=10.0, acceleration=1000.0))
        TipProfile(6 segments of 0.37 s: 0 mm to 0.5 mm)
        """
        checks.kind("other", other, TipProfile)
        return self._from_rows(np.concatenate((self.segments, other.segments)), self.start)

    def plot(self) -> Any:
        """Draw position (mm) and speed (mm/s) over time (s); return the figure."""
        return pictures.drawn("centering.push._contact.trace_picture:plot_profile", self)

    def __repr__(self) -> str:
        way = f"{self.start:.4g} mm to {self.end:.4g} mm"
        return f"{type(self).__name__}({self.duration.size} segments of {self.total_time:.4g} s: {way})"

    @property
    def _moved(self) -> Floats:
        """Travel of each segment, mm."""
        return (self.velocity + 0.5 * self.acceleration * self.duration) * self.duration
