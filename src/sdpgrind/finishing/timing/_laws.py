"""Time laws of all runs, each from rest to rest."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.progress import ProgressOption, quiet
from sdpgrind.finishing.timing._jerk_limited import jerk_limited_law
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits, LawError, LimitedRun, check_runs, each_feed
from sdpgrind.finishing.timing._local_gap import local_gap
from sdpgrind.finishing.timing._min_time import fastest_law
from sdpgrind.finishing.timing._time_law import TimeLaw, rated
from sdpgrind.finishing.timing._toppra_law import ToppraError, toppra_law
from sdpgrind.finishing.timing._trapezoid import Trapezoid, double_s_law, trapezoid_law
from sdpgrind.finishing.timing._violations import closest, slowing

ACCELERATION = 1000.0  # mm/s^2, chosen: default acceleration of the contact point along its path
REFINE = 20  # chosen: places in a piece of a law for its limits
# chosen: change of a joint's slope on a straight line over the steepest, above rounding of samples
LINE = 1e-7
WORTH = 1.01  # chosen: slowing from which other ramps are tried; below they would save less than it


@quiet
def time_laws(
    runs: Sequence[JointPath],
    limits: JointLimits,
    *,
    feed_rate: float | Sequence[float],
    acceleration: float | None = None,
    method: str = "trapezoid",
    gap: bool = False,
    progress: ProgressOption = None,
) -> tuple[TimeLaw, ...]:
    """Return the time law of each run, from rest to rest.

    Parameters
    ----------
    runs : sequence of JointPath
        The runs, mm and rad or mm.
    limits : JointLimits
        Limits of the joints.
    feed_rate : float or sequence of float
        Greatest feed along the path, mm/s, of all runs or of each.
    acceleration : float, optional
        Greatest acceleration of the contact point along its path, mm/s^2. None: 1000 for "trapezoid", else no
        limit.
    method : str
        "trapezoid": speed trapezoid of the path, slowed where a joint needs it (factor: ``TimeLaw.slowed``),
        or with gentler ramps where that is faster; with limits of jerk, seven pieces of constant jerk.
        "toppra": fastest law by the package toppra (an extra); its acceleration jumps, so limits of jerk are
        refused. "min_time": fastest law within
        ``feed_rate`` and all limits of the joints. Without limits of jerk it is swept over a grid, refined
        until that saves less than 0.02 % of the time. With them it is a local optimum, no slower than seven
        pieces of constant jerk, which are taken where none is found (``TimeLaw.status`` says so): some 20 ms
        for a run of a few mm, 1.2 s for 160 mm and 10 s for 1600 mm through 1024 rounded corners.
    gap : bool
        Whether ``TimeLaw.gap`` of laws by "min_time" with limits of jerk is estimated, locally: from a law on
        nodes of its own with limits neither narrowed nor slowed, its duality gap, and the change from half
        the nodes. It takes some 0.15 s a run, more on long ones.
    progress : callable(share, text), True or None
        Called with the share done (0..1) and a text; True: a line with the time left. Default: silent.

    Raises
    ------
    ValueError
        When the runs do not have the joints of the limits, a rate is not > 0, jerk has limits that a method
        cannot keep, or no law is found without limits of jerk; the message names the run.
    ImportError
        When `toppra` is wanted and missing.

    Examples
    --------
    >>> run = JointPath([0.0, 100.0], [[0.0], [200.0]])
    >>> limits = JointLimits(["X"], speed_max=[50.0], acceleration_max=[2000.0])
    >>> (law,) = time_laws([run], limits, feed_rate=40.0)
    >>> round(law.duration, 4), round(law.slowed, 4)
    (4.025, 1.5846)
    """
    assert callable(progress)  # made by the decorator
    checks.one_of("method", method, tuple(_MAKERS))
    if method == "toppra" and limits.jerk_max is not None:
        raise checks.refuse(
            "limits.jerk_max", "None for method='toppra', whose acceleration jumps", limits.jerk_max
        )
    if checks.kind("gap", gap, bool) and (method != "min_time" or limits.jerk_max is None):
        raise ValueError(f"gap must be False but for method='min_time' with limits of jerk; got {method!r}")
    feeds = each_feed(feed_rate, len(runs))
    along = checks.positive("acceleration", acceleration, "mm/s^2") if acceleration is not None else None
    check_runs(runs, limits)
    out = []
    for k, run in enumerate(runs):
        law = _named(k, run, limits, feeds[k], along, method)
        given = LimitedRun(run, limits, feeds[k], along)
        out.append(law.replace(gap=_gap_of(given, law)) if gap else law)
        progress((k + 1) / len(runs), "time laws")
    return tuple(out)


def _named(
    number: int, run: JointPath, limits: JointLimits, feed: float, along: float | None, method: str
) -> TimeLaw:
    """Law of one run with its slowing against one without joints; errors name the run."""
    try:
        law = _MAKERS[method](LimitedRun(run, limits, feed, along))
    except (LawError, ToppraError) as error:
        raise type(error)(f"run {number}: {error}") from error
    asked = run.span / feed
    if along is not None or method == "trapezoid":
        asked = Trapezoid(run.span, feed, along or ACCELERATION).duration
    return rated(law, asked)


def _gap_of(given: LimitedRun, law: TimeLaw) -> float:
    """Local gap of the fastest law; 0 of seven pieces where these are it, inf where no other is found."""
    if _is_line(given.run):
        return 0.0
    try:
        return local_gap(given, law)
    except LawError:
        return math.inf


def min_time_of(given: LimitedRun) -> TimeLaw:
    """Fastest law of one run; with limits of jerk at most as long as that of seven pieces."""
    if given.limits.jerk_max is None:
        return fastest_law(given)
    # Seven pieces at the acceleration that the joints allow where they move straight.
    most = min(_straight(given, 1), given.acceleration or np.inf)
    pieces = trapezoid_of(given._replace(acceleration=most))
    if _is_line(given.run):
        return pieces
    try:
        return min(jerk_limited_law(given), pieces, key=lambda law: law.duration)
    except LawError as error:
        return pieces.replace(status=f"{error}; this law has seven pieces")


def _is_line(run: JointPath) -> bool:
    """Whether all joints move in proportion to arc length, so that seven pieces are the fastest law."""
    first, second, third = run.derivatives(run.length)[:, 1:].transpose(1, 0, 2)
    most = LINE * float(np.abs(first).max())
    changes = np.ptp(first, axis=0), np.abs(second) * run.span, np.abs(third) * run.span**2
    return all(float(np.max(change)) <= most for change in changes)


def trapezoid_of(given: LimitedRun) -> TimeLaw:
    """Trapezoid of one run (rounded where jerk has a limit) at a speed that all joints allow, then slowed.

    Ramps that are too steep for a joint slow all of the run by the root. So where slowing is needed gentler
    ones are tried, too: those that the joints allow where they move straight, and at the slower speed.
    """
    most = given.acceleration or ACCELERATION
    law, factor = _slowed(given, most)
    if factor <= WORTH:
        return law
    straight = _straight(given, 1)
    gentle, less = _slowed(given, min(straight, most))
    found = [law, gentle]
    if less > WORTH:
        found.append(_slowed(given, min(straight * less**2, most))[0])
    return min(found, key=lambda each: each.duration)


def _slowed(given: LimitedRun, acceleration: float) -> tuple[TimeLaw, float]:
    """Law with ramps of an acceleration (mm/s^2), slowed until joints keep their limits, and the factor."""
    run, limits, feed_rate, _ = given
    speed, start = min(feed_rate, _straight(given, 0)), float(run.length[0])
    shape = Trapezoid(run.span, speed, acceleration)
    law = (
        trapezoid_law(start, shape)
        if limits.jerk_max is None
        else double_s_law(start, shape, _straight(given, 2))
    )
    factor = slowing(closest(run, law, limits, feed_rate, REFINE)[:, 0])
    return law.slower(factor) if factor > 1.0 else law, factor


def _straight(given: LimitedRun, order: int) -> float:
    """Speed (order 0), acceleration or jerk along the path that straight moving joints allow, mm and s."""
    return float(np.min(given.limits.table[order] / np.maximum(given.run.steepest, 1e-9)))


# Makers of one run's law, by the name of the method.
_MAKERS: Mapping[str, Callable[[LimitedRun], TimeLaw]] = {
    "trapezoid": trapezoid_of,
    "toppra": toppra_law,
    "min_time": min_time_of,
}
