"""PI law of the slide's speed that follows the probe, brakes in time and does not wind up."""

from math import copysign, sqrt

import numpy as np
import numpy.typing as npt

from centering.push._profile.timing import rest_to_rest
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, described, quantity, units_of


@described()
class FollowingGains(Described):
    """Gains of the following law: slide speed = Kp e + Ki integral of e, e the deviation of the probe.

    The defaults are the optimum of `tune_following` for a step of a whole gap. The integral only adds a slow
    tail there; it serves slides with a steady speed error. The gains of Mears (3.16) are counts of a drive
    and do not apply.

    Parameters
    ----------
    proportional : float
        Proportional gain Kp, 1/s.
    integral : float
        Integral gain Ki, 1/s^2.

    Raises
    ------
    ValueError
        Kp is not > 0, or Ki is negative.

    Examples
    --------
    >>> from sdpgrind import units
    >>> round(FollowingGains(25.0, 60.0).error_gain(units.rpm(20)), 6)
    0.057427
    """

    proportional: float = quantity("1/s", above=0, default=32.0)
    integral: float = quantity("1/s^2", at_least=0, default=0.0)

    def error_gain(self, frequency: float) -> float:
        """Return the amplitude ratio of deviation and rim motion: ``|E/r|`` of E/r = s^2/(s^2 + Kp s + Ki).

        Parameters
        ----------
        frequency : float
            Frequency of the rim's motion, rad/s: the spindle speed.

        Raises
        ------
        ValueError
            It is negative or not finite.
        """
        square = checks.nonnegative("frequency", frequency, "rad/s") ** 2
        return square / abs(complex(self.integral - square, self.proportional * frequency))


@described()
class FollowingLimits(Described):
    """Limits of the slide while it follows.

    Parameters
    ----------
    speed : float
        Greatest speed, mm/s.
    acceleration : float
        Greatest acceleration, mm/s^2.
    sample_time : float
        Sample time of the law, s.

    Raises
    ------
    ValueError
        A value is not > 0.

    Examples
    --------
    >>> round(FollowingLimits().least_time(7.928), 4)  # s, from rest to rest over a whole gap
    0.1129
    """

    speed: float = quantity("mm/s", above=0, usual=(0.5, 2000.0), typical=120, default=120.0)
    acceleration: float = quantity("mm/s^2", above=0, default=2560.0)
    sample_time: float = quantity("s", above=0, default=0.01)

    def least_time(self, distance: float) -> float:
        """Return the least time (s) from rest to rest over a distance: a lower bound for every following law.

        Parameters
        ----------
        distance : float
            Distance, mm, > 0.

        Raises
        ------
        ValueError
            The distance is not > 0.
        """
        return rest_to_rest(checks.positive("distance", distance, "mm"), self.speed, self.acceleration)


class Follower:
    """Following law: one speed for each deviation.

    The proportional part never exceeds the speed from which the slide can brake within the deviation, so a
    step of a whole gap does not overshoot; while the speed is limited the integral is frozen.

    Parameters
    ----------
    gains : FollowingGains, optional
        Gains, 1/s, 1/s^2.
    limits : FollowingLimits, optional
        Limits of the slide, mm/s, mm/s^2, s.

    Examples
    --------
    >>> follower = Follower()
    >>> follower.step(0.1), follower.step(50.0)  # mm -> mm/s
    (3.2, 120.0)
    """

    def __init__(self, gains: FollowingGains | None = None, limits: FollowingLimits | None = None) -> None:
        self.gains = checks.kind("gains", gains or FollowingGains(), FollowingGains)
        self.limits = checks.kind("limits", limits or FollowingLimits(), FollowingLimits)
        self._integral = 0.0

    def reset(self) -> None:
        """Clear the integral."""
        self._integral = 0.0

    def step(self, deviation: float, feed_forward: float = 0.0) -> float:
        """Return the speed of the slide until the next sample, mm/s.

        Parameters
        ----------
        deviation : float
            Remaining distance of the slide, mm, in the direction of positive speed.
        feed_forward : float
            Known speed of the followed rim, mm/s.
        """
        wanted = self.gains.proportional * deviation
        allowed = min(braking_speed(abs(deviation), self.limits), self.limits.speed)
        held = abs(wanted) > allowed
        integral = self._integral + (
            0.0 if held else self.gains.integral * self.limits.sample_time * deviation
        )
        total = (copysign(allowed, wanted) if held else wanted) + integral + feed_forward
        if abs(total) <= self.limits.speed:
            self._integral = integral
            return total
        return copysign(self.limits.speed, total)


def braking_speed(distance: float, limits: FollowingLimits) -> float:
    """Return the speed (mm/s) from which the slide stops within a distance, one sample of delay included.

    Parameters
    ----------
    distance : float
        Distance, mm, >= 0.
    limits : FollowingLimits
        Limits of the slide.

    Examples
    --------
    >>> round(braking_speed(1.0, FollowingLimits()), 3)  # v T + v^2/(2 a) = 1 mm
    50.396
    """
    lost = limits.acceleration * limits.sample_time
    return sqrt(lost * lost + 2.0 * limits.acceleration * distance) - lost


@described()
class FollowingMap(ByValue, Described):
    """Objective of Mears (3.15), Z = t_s/t_s,nom + OV/OV_nom, over both gains.

    Parameters
    ----------
    proportional, integral : array
        Kp (p,), 1/s, and Ki (i,), 1/s^2.
    settling_time : array, shape (p, i)
        Time until the deviation stays within 1 % of the step, s; infinite: never.
    overshoot : array, shape (p, i)
        Overshoot over the step, unit 1.
    objective : array, shape (p, i)
        Z, unit 1.

    Examples
    --------
    >>> tune_following(proportional=[5.0, 32.0, 90.0], integral=[0.0, 60.0])
    FollowingMap(3 x 2 gains, the best FollowingGains(proportional=32.0, integral=0.0))
    """

    proportional: Floats = array("1/s", finite=False)
    integral: Floats = array("1/s^2", finite=False)
    settling_time: Floats = array("s", finite=False)
    overshoot: Floats = array("1", finite=False)
    objective: Floats = array("1", finite=False)

    def __repr__(self) -> str:
        tried, best = f"{self.proportional.size} x {self.integral.size} gains", self.gains
        told = f"FollowingGains(proportional={best.proportional}, integral={best.integral})"
        return f"FollowingMap({tried}, the best {told})"

    @property
    def gains(self) -> FollowingGains:
        """Gains of the least objective, 1/s and 1/s^2."""
        p, i = np.unravel_index(int(np.argmin(self.objective)), self.objective.shape)
        return FollowingGains(float(self.proportional[p]), float(self.integral[i]))


def tune_following(
    *,
    step: float = 7.928,
    limits: FollowingLimits | None = None,
    proportional: npt.ArrayLike | None = None,
    integral: npt.ArrayLike | None = None,
    settling_nominal: float = 0.11,
    overshoot_nominal: float = 0.04,
) -> FollowingMap:
    """Map the objective of Mears (3.15) for a step of the probe, over both gains.

    Parameters
    ----------
    step : float
        Initial deviation of the probe, mm, > 0.
    limits : FollowingLimits, optional
        Limits of the slide (mm/s, mm/s^2, s).
    proportional, integral : array_like, optional
        Candidate Kp (1/s, > 0) and Ki (1/s^2, >= 0).
    settling_nominal : float
        Nominal settling time, s.
    overshoot_nominal : float
        Nominal overshoot over the step.

    Raises
    ------
    ValueError
        A value is out of range.

    Examples
    --------
    >>> found = tune_following()
    >>> found.gains.proportional, found.gains.integral, round(float(found.settling_time.min()), 3)
    (32.0, 0.0, 0.104)
    """
    way = checks.positive("step", step, "mm")
    kp = _gains("proportional", np.linspace(2.0, 60.0, 30) if proportional is None else proportional)
    ki = _gains("integral", np.linspace(0.0, 300.0, 31) if integral is None else integral)
    checks.positive("proportional", float(kp.min()), units_of(FollowingGains)["proportional"])
    nominal = (
        checks.positive("settling_nominal", settling_nominal, "s"),
        checks.positive("overshoot_nominal", overshoot_nominal),
    )
    settling, overshoot = _responses(way, limits or FollowingLimits(), kp, ki)
    return FollowingMap(kp, ki, settling, overshoot, settling / nominal[0] + overshoot / nominal[1])


_WATCHED = 2.0  # chosen: s of a step
_FINE = 10  # chosen: looks at the slide within a sample
_SETTLED = 0.01  # chosen: of the step


def _gains(name: str, values: npt.ArrayLike) -> Floats:
    """Checked copy of candidate gains."""
    unit = units_of(FollowingGains)[name]
    gains = np.atleast_1d(checks.finite_array(name, values, unit)).astype(float)
    checks.nonnegative(name, float(gains.min()), unit)
    return gains


def _responses(step: float, limits: FollowingLimits, kp: Floats, ki: Floats) -> tuple[Floats, Floats]:
    """Settling time (s) and overshoot (over the step) of a slide that accelerates fully."""
    followers = [Follower(FollowingGains(float(p), float(i)), limits) for p in kp for i in ki]
    place, speed = np.zeros((kp.size, ki.size)), np.zeros((kp.size, ki.size))
    settled, greatest = np.zeros_like(place), np.zeros_like(place)
    fine = limits.sample_time / _FINE
    for k in range(round(_WATCHED / limits.sample_time)):
        wanted = np.array(
            [one.step(step - x) for one, x in zip(followers, place.ravel(), strict=True)]
        ).reshape(place.shape)
        for n in range(1, _FINE + 1):
            outside = np.abs(place - step) > _SETTLED * step
            settled[outside] = k * limits.sample_time + n * fine
            before, speed = (
                speed,
                speed + np.clip(wanted - speed, -limits.acceleration * fine, limits.acceleration * fine),
            )
            place = place + 0.5 * (before + speed) * fine
            greatest = np.maximum(greatest, place)
    settled[settled > _WATCHED - limits.sample_time] = np.inf
    return settled, np.maximum(greatest / step - 1.0, 0.0)
