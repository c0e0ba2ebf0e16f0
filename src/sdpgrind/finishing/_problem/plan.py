"""Plan a finishing motion: tool poses, robot joints and time law."""

from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.progress import ProgressOption, portion, reporting
from sdpgrind.base.warned import warn
from sdpgrind.finishing._problem.joint_runs import (
    PostureError,
    check_ends,
    feeds_of,
    limits_of,
    posture_of,
    runs_of,
    samples_of,
)
from sdpgrind.finishing._problem.motion import EXCEEDED, Motion, MotionError
from sdpgrind.finishing._problem.motion_rows import rows, with_freedoms
from sdpgrind.finishing._problem.placing import placed_for, what_place_would
from sdpgrind.finishing._problem.posture import Posture
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing._program.course import greatest_feed
from sdpgrind.finishing.timing._laws import time_laws
from sdpgrind.finishing.timing._violations import worst_violation

METHODS = ("trapezoid", "toppra", "min_time")
JOINTS_SHARE = 0.3  # chosen: portion of progress for the joints; with "trapezoid" they take most of the time

_REACHED = 0.1  # chosen: a feed ten times any planned one is rather in another unit than a wish


@reporting
def plan(
    problem: FinishingProblem,
    *,
    method: str = "trapezoid",
    throw: bool = True,
    progress: ProgressOption = None,
) -> Motion:
    """Plan the motion along a path: poses, joints in closed form, and a time law within the limits.

    ``"trapezoid"``: rest at every sharp corner, in between a trapezoid of feed (Wang, figure 9), slower where
    a joint needs it; its acceleration jumps. ``"toppra"``: fastest law under the limits of speed and
    acceleration, by the package toppra (extra ``toppra``). ``"min_time"``: fastest law under the limits of
    speed, acceleration and jerk; slower than a trapezoid (no limit of jerk) where there are many corners;
    ``jerk_max=None``: no limit of jerk. All three rest at sharp corners; ``path.blended()`` has none, and
    suits the last two: a trapezoid is as slow all along as in its tightest corner. Straight lines of a lift
    are runs at its ``air_feed``; the limits hold there, too.

    A feed rate that the motion nowhere reaches a tenth of warns: it may be in mm/min.

    A robot without a table whose problem has no placement is placed by `place`, with a warning that says
    where; the problem of the motion then has that placement and azimuth.

    Parameters
    ----------
    problem : FinishingProblem
        Path, robot and tool.
    method : {"trapezoid", "toppra", "min_time"}
        The time law.
    throw : bool
        Whether a limit exceeded by more than 0.1 % is an error. False: only the status of the motion says so.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Motion
        Poses (mm) and joints (rad, mm) over time (s), with the quantity nearest to its limit.

    Raises
    ------
    ValueError
        When a pose is out of reach or a joint out of its range, with the place; or a limit is exceeded
        (`MotionError`).

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> path = finishing.hilbert(finishing.preset("nominal").surface, 3)
    >>> motion = finishing.plan(finishing.FinishingProblem(path))
    >>> motion.worst_violation.held, round(motion.mean_feed_rate / motion.problem.feed_rate, 2)
    (True, 0.87)
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, FinishingProblem, " (see finishing.preset)")
    checks.one_of("method", method, METHODS)
    problem, begun = placed_for(problem, progress)
    progress = portion(progress, begun, 1.0)
    progress(0.0, "joints along the path")
    try:
        check_ends(problem)
        samples = samples_of(problem.path)
        chosen, place = posture_of(problem, samples)
    except PostureError as error:
        raise ValueError(f"{error}; {what_place_would(problem)}") from None
    limits, pace = limits_of(problem, method)
    runs, feeds = runs_of(samples, chosen.joints), feeds_of(problem, samples)
    laws = time_laws(
        runs,
        limits,
        feed_rate=feeds,
        acceleration=pace,
        method=method,
        progress=portion(progress, JOINTS_SHARE, 1.0),
    )
    worst = worst_violation(runs, laws, limits=limits, feed_rate=feeds)
    begun = sum(law.duration for law in laws[: worst.run])
    free, table = with_freedoms(rows(problem, runs, laws), chosen.free)
    posture = Posture(chosen.branch, place, free)
    other = "; ".join(f"run {k}: {law.status}" for k, law in enumerate(laws) if law.status)
    motion = Motion(problem, method, posture, worst._replace(time=begun + worst.time), table, other)
    if throw and worst.ratio > 1 + EXCEEDED:
        raise MotionError(
            f"a limit is exceeded: {motion.worst_violation}; try a lower feed_rate or another method", motion
        )
    _warn_of_feed(motion, method)
    return motion


def _warn_of_feed(motion: Motion, method: str) -> None:
    """Warn of a feed rate far above all that corners and joints allow."""
    asked, planned = motion.problem.feed_rate, greatest_feed(motion)
    if planned < _REACHED * asked:
        slow = " ('trapezoid': all along as slow as in the tightest corner)" if method == "trapezoid" else ""
        warn(
            f"feed_rate of {asked:g} mm/s is reached nowhere: acceleration, corners and joints allow at most"
            f" {planned:.3g} mm/s{slow}; is it in mm/min? It would be {units.mm_per_min(asked):.3g} mm/s"
        )
