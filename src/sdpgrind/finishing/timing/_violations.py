"""Check of all limits on a grid finer than that of any law."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing import _check_kernels as check_kernels
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits, each_feed
from sdpgrind.finishing.timing._time_law import TimeLaw, moved

QUANTITIES = ("speed", "acceleration", "jerk", "feed")
CLOSER = 20  # chosen: places about the greatest share of a limit
SLACK = 1e-9  # chosen: rounding of a ratio of 1


class Violation(NamedTuple):
    """Place of a motion nearest to a limit, or farthest beyond it.

    Attributes
    ----------
    quantity : str
        "speed", "acceleration" or "jerk" of a joint, or "feed".
    joint : str
        Name of the joint; empty for the feed.
    ratio : float
        Value over limit, dimensionless: <= 1 where every limit is held.
    run : int
        Index of the run.
    time : float
        Time from the start of that run, s.
    length : float
        Arc length there, mm.
    """

    quantity: str
    joint: str
    ratio: float
    run: int
    time: float
    length: float

    @property
    def held(self) -> bool:
        """Whether no limit is exceeded: a ratio <= 1, dimensionless."""
        return self.ratio <= 1 + SLACK

    def __str__(self) -> str:
        what = f"{self.quantity} of {self.joint}" if self.joint else self.quantity
        place = f"in run {self.run} at {self.length:.4g} mm, {self.time:.4g} s"
        return f"{what} at {100 * self.ratio:.4g} % of its limit {place}"


def worst_violation(
    runs: Sequence[JointPath],
    laws: Sequence[TimeLaw],
    *,
    limits: JointLimits,
    feed_rate: float | Sequence[float],
    refine: int = 20,
) -> Violation:
    """Return the place of a motion nearest to a limit, or farthest beyond it.

    Every piece of a law is checked in `refine` places for each piece of the path it covers, both ends
    included, then between them around the nearest place.

    Parameters
    ----------
    runs : sequence of JointPath
        The joints of each run, mm and rad or mm.
    laws : sequence of TimeLaw
        Time law of each run, s.
    limits : JointLimits
        Limits of the joints.
    feed_rate : float or sequence of float
        Greatest feed, mm/s, of all runs or of each.
    refine : int
        Places in a piece, a whole number.

    Raises
    ------
    ValueError
        When there are not as many laws as runs, or none.

    Examples
    --------
    >>> run = JointPath([0.0, 100.0], [[0.0], [100.0]])
    >>> limits = JointLimits(["X"], speed_max=[200.0], acceleration_max=[2000.0])
    >>> law = TimeLaw([0.0, 2.0, 4.0], [0.0, 50.0], [0.0, 50.0], [25.0, -25.0], [0.0, 0.0])
    >>> print(worst_violation([run], [law], limits=limits, feed_rate=40.0))
    feed at 125 % of its limit in run 0 at 50 mm, 2 s
    """
    if len(runs) != len(laws) or not runs:
        raise checks.refuse("laws", f"one for each of the {len(runs)} runs (at least one)", len(laws))
    feeds = each_feed(feed_rate, len(runs))
    checks.count("refine", refine)
    found = [
        closest(run, law, limits, feed, refine) for run, law, feed in zip(runs, laws, feeds, strict=True)
    ]
    ratios = np.array([each[:, 0] for each in found])
    run, quantity = np.unravel_index(np.argmax(ratios), ratios.shape)
    ratio, joint, time, length = found[run][quantity]
    name = limits.names[int(joint)] if joint >= 0 else ""
    return Violation(QUANTITIES[quantity], name, float(ratio), int(run), float(time), float(length))


def closest(run: JointPath, law: TimeLaw, limits: JointLimits, feed_rate: float, refine: int) -> Floats:
    """Greatest share of each limit over one run: (4, 4) = quantities by (ratio, joint, time, length)."""
    each, found = _none(law)
    check_kernels.closest(*run.pieces, _rows(law), limits.table, feed_rate, refine, CLOSER, each, found)
    return found[:, :4]


def shares(run: JointPath, law: TimeLaw, limits: JointLimits, feed_rate: float, refine: int) -> Floats:
    """Greatest share of each limit in every piece of a law: (k, 4)."""
    each, found = _none(law)
    check_kernels.worst(*run.pieces, _rows(law), limits.table, feed_rate, refine, each, found)
    return each


def _none(law: TimeLaw) -> tuple[Floats, Floats]:
    """No share in any piece of a law, (k, 4), and none in it, (4, 5); see the kernels."""
    found = np.zeros((len(QUANTITIES), 5))
    found[:, 1] = -1
    return np.empty((law.length.size, len(QUANTITIES))), found


def _rows(law: TimeLaw) -> Floats:
    """The law as one array (5, k + 1), its end in the last column."""
    rows = np.empty((5, law.knots.size))
    rows[0], rows[1, :-1], rows[2, :-1] = law.knots, law.length, law.feed
    rows[3, :-1], rows[4, :-1] = law.acceleration, law.jerk
    rows[1:, -1] = moved(law.knots[-1] - law.knots[-2], *rows[1:, -2])
    return rows


def slowing(ratios: Floats) -> float:
    """Least factor of a duration, >= 1, that keeps speed, acceleration, jerk and feed within their limits."""
    speed, acceleration, jerk, feed = ratios
    return float(max(1.0, speed, acceleration**0.5, jerk ** (1 / 3), feed))
