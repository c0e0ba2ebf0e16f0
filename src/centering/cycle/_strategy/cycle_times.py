"""Times of the cycles of a problem: what its measurements, pushes and the run-ups of its table take."""

from math import pi

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.cycle._measuring.rotations import final_arcs, places, push_arcs, push_scatter
from centering.cycle._strategy.belief import FrictionScaleBelief
from centering.cycle._strategy.outcomes import OutcomeTable
from centering.cycle._strategy.table_limit import SURE, TableLimit, least_friction
from centering.cycle._strategy.timing import FIRSTS, SETTLED, CycleTiming, table_limit
from centering.cycle._strategy.tip_ways import approach_times, times_after
from centering.cycle._strategy.turning_kernels import RESTING
from sdpgrind.base.checks import Floats

WORTH = 0.45  # measured: growth of the evidence by a push after the first, mean of 600 parts on two rigs
FORCE_SHOWS = 0.07  # derived: 5 % of the sum of forces, which grows by 0.75 of it per unit of friction


def cycle_timing(
    problem: CenteringProblem, outcomes: OutcomeTable, offsets: Floats, speeds: Floats
) -> CycleTiming:
    """Return the times of cycles with table speeds (rad/s) at nodes of the offset (mm) from the goal on."""
    table = table_limit(problem)
    speed, rate = float(speeds[0]), table.acceleration(problem.offset_max, 0.0)
    found = [places(problem, speed, rate, 2.0 * pi * (k + 0.5) / FIRSTS, SETTLED) for k in range(FIRSTS)]
    measured = list(zip(*found, strict=True))
    return CycleTiming(
        problem,
        offsets,
        speeds,
        np.array([[push_arcs(problem, offsets, one) for one in stage] for stage in measured]),
        np.array([[final_arcs(problem, float(offsets[0]), one) for one in stage] for stage in measured]),
        _leads(problem, outcomes, offsets),
        np.array([times_after(problem, kind) for kind in outcomes.kinds]),
        _rates(problem, offsets, speeds),
    )


def _leads(problem: CenteringProblem, outcomes: OutcomeTable, offsets: Floats) -> Floats:
    """Times from the start of pushes of whole offsets (mm) to their alignment, s: median over the kinds."""
    at, kinds = np.searchsorted(outcomes.strokes, offsets), outcomes.kinds
    known = push_scatter(problem.scatter, offsets)
    ways = np.array([approach_times(problem, kind, known, float(offsets[-1])) for kind in kinds])
    pressed = np.array([times[np.minimum(at, times.size - 1)] for times in outcomes.contact_time])
    possible = at <= outcomes.last[:, None]
    possible |= ~possible.any(axis=0)
    return np.nanmedian(np.where(possible, ways + (1.0 - RESTING) * pressed, np.nan), axis=0)


def _rates(problem: CenteringProblem, offsets: Floats, speeds: Floats) -> Floats:
    """Mean accelerations of run-ups to the speeds (rad/s) at the offsets (mm), by pushes seen, rad/s^2."""
    belief, least = FrictionScaleBelief.of(problem.scatter), least_friction(problem)
    evidence = [evidence_after(pushes, belief.push_sd) for pushes in range(1, SETTLED + 1)]
    told = [1.0 - SURE * belief.next_sd(each) for each in evidence]
    limits = [TableLimit(problem, max(friction, least)) for friction in (least, *told)]
    pairs = list(zip(offsets.tolist(), speeds.tolist(), strict=True))
    return np.array([[w / limit.run_up(offset, w)[1][-1] for offset, w in pairs] for limit in limits])


def evidence_after(pushes: int, push_sd: float) -> float:
    """Return the usual evidence after so many pushes: the first shows its friction by its force alone."""
    if pushes == 0 or push_sd == 0.0:
        return WORTH * pushes
    return push_sd**2 / (push_sd**2 + FORCE_SHOWS**2) + WORTH * (pushes - 1)


def table_speeds(problem: CenteringProblem, offset: Floats, speed: str | float) -> Floats:
    """Return the greatest table speeds (rad/s) without slip or outrun tip at offsets (mm), or `speed`.

    They hold for the least friction of the problem, before a push has shown that of the part.
    """
    fastest = table_limit(problem).speeds(offset)
    return np.asarray(fastest if isinstance(speed, str) else np.minimum(fastest, speed))
