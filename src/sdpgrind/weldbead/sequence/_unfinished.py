"""Beads that cannot be ground away in time, by the mean cuts at the greatest forces."""

import warnings

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._problem import SequenceProblem

LONGER, HARDER = 8, 30  # chosen: times and bisections that are searched for what would do
ENOUGH = 1e-9  # chosen: share of the height that counts as rounding


def unfinished(problem: SequenceProblem) -> str:
    """Return a sentence on what is left of the greatest height in the longest time; "": it can be finished.

    Always "" where passes may end late or nothing is charged for what is left. Heights in mm, times in s.
    """
    count = round(problem.horizon / problem.stage)
    if problem.lateness_charge is not None or problem.height_charge.under is None:
        return ""
    left = problem.height_max - reach(problem, count)[-1]
    if left <= ENOUGH * problem.height_max:
        return ""
    means = [each for each in (_time(problem, count), _force(problem, count)) if each]
    would = f": {' or '.join(means)} would do" if means else ""
    return (
        f"a bead of {problem.height_max:g} mm cannot be finished in {problem.horizon:g} s: {left:.3g} mm will"
        f" be left at the greatest forces{would}"
    )


def reach(problem: SequenceProblem, count: int) -> Floats:
    """Return the greatest depth in 0, 1, ..., `count` stages, mm, by mean cuts."""
    moves = [(round(each / problem.stage), _cut(problem, each)) for each in problem.durations]
    depth = np.zeros(count + 1)
    for stage in range(1, count + 1):
        depth[stage] = max([depth[stage - 1], *(depth[stage - n] + cut for n, cut in moves if n <= stage)])
    return depth


def _cut(problem: SequenceProblem, duration: float) -> float:
    """Greatest mean cut of a duration, s, in mm; 0 where no force is admissible."""
    low, high = problem.force_interval(duration)
    feed = problem.feed_rate(duration)
    return float(problem.depths.moments(problem.model, high, feed)[0]) if low < high else 0.0


def _time(problem: SequenceProblem, count: int) -> str:
    depth = reach(problem, LONGER * count)
    enough = np.flatnonzero(depth >= (1 - ENOUGH) * problem.height_max)
    return f"{enough[0] * problem.stage:g} s" if enough.size else ""


def _force(problem: SequenceProblem, count: int) -> str:
    """Least greatest force that would do, N, up to that of the greatest cut."""
    low, high = problem.force_max, float(problem.depths.peak_force(problem.model))
    high = min(high, LONGER * low)
    if low >= high or not _enough(problem, high, count):
        return ""
    for _ in range(HARDER):
        middle = (low + high) / 2
        low, high = (low, middle) if _enough(problem, middle, count) else (middle, high)
    return f"a force_max of {high:.4g} N"


def _enough(problem: SequenceProblem, force_max: float, count: int) -> bool:
    """Whether a greatest force, N, would do."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the problem has warned when it was made
        return bool(reach(problem.replace(force_max=force_max), count)[-1] >= problem.height_max)
