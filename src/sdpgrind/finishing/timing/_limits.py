"""Limits of the joints, and a run under them."""

from collections.abc import Sequence
from dataclasses import KW_ONLY
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, units_of
from sdpgrind.finishing.timing._joint_path import JointPath


@described("finishing.limits")
class JointLimits(Described):
    """Greatest speed, acceleration and jerk of every joint, the table's two included.

    Parameters
    ----------
    names : sequence of str, (n,)
        Names of the joints.
    speed_max : sequence of float, (n,)
        Greatest speeds, rad/s or mm/s.
    acceleration_max : sequence of float, (n,)
        Greatest accelerations, rad/s^2 or mm/s^2.
    jerk_max : sequence of float, (n,), optional
        Greatest jerks, rad/s^3 or mm/s^3. None: no limit.

    Raises
    ------
    ValueError
        When a limit is not > 0, there is not one for each name, or a name is used twice.

    Examples
    --------
    >>> JointLimits(("q1", "X"), speed_max=(1.5, 200.0), acceleration_max=(8.0, 2000.0)).jerk_max is None
    True
    """

    names: Sequence[str] = custom(lambda name, value: checks.unique(name, tuple(value)))
    _: KW_ONLY
    speed_max: Sequence[float] = custom(unit="rad/s or mm/s")
    acceleration_max: Sequence[float] = custom(unit="rad/s^2 or mm/s^2")
    jerk_max: Sequence[float] | None = custom(unit="rad/s^3 or mm/s^3", default=None)

    def _check(self) -> None:
        for name, unit in units_of(JointLimits).items():
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _each(name, value, len(self.names), unit))

    @property
    def table(self) -> Floats:
        """Limits of speed, acceleration and jerk, (3, n), in their units; inf without a limit of jerk."""
        jerk = self.jerk_max if self.jerk_max is not None else np.full(len(self.names), np.inf)
        return np.array([self.speed_max, self.acceleration_max, jerk], dtype=float)


class LawError(ValueError):
    """No law was found."""


class LimitedRun(NamedTuple):
    """A run, the limits of its joints, and greatest feed (mm/s) and acceleration (mm/s^2) along it."""

    run: JointPath
    limits: JointLimits
    feed_rate: float
    acceleration: float | None = None  # None: no limit


def check_runs(runs: Sequence[JointPath], limits: JointLimits) -> None:
    """Refuse runs of other joints than those with limits."""
    for k, run in enumerate(runs):
        if run.joints.shape[1] != len(limits.names):
            raise checks.refuse(
                f"runs[{k}]",
                f"of the {len(limits.names)} joints {', '.join(limits.names)}",
                run.joints.shape[1],
            )


def _each(name: str, value: Sequence[float], count: int, unit: str) -> tuple[float, ...]:
    """Check one limit > 0 for each joint."""
    if np.ndim(value) != 1 or len(value) != count:
        raise checks.refuse(name, f"one number for each of the {count} joints", value, unit)
    return tuple(checks.positive(f"{name}[{k}]", entry, unit) for k, entry in enumerate(value))


def each_feed(feed_rate: float | Sequence[float], count: int) -> tuple[float, ...]:
    """Return the greatest feed of each of `count` runs, mm/s, from one number or one for each."""
    if np.ndim(feed_rate) == 0:
        return (checks.positive("feed_rate", feed_rate, "mm/s"),) * count
    given = np.asarray(feed_rate).tolist()
    if np.ndim(feed_rate) != 1 or len(given) != count:
        raise checks.refuse("feed_rate", f"one number, or one for each of the {count} runs", given, "mm/s")
    return tuple(checks.positive(f"feed_rate[{k}]", each, "mm/s") for k, each in enumerate(given))
