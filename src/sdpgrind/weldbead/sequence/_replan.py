"""Plan anew between two passes, for the height and the time that are left."""

from dataclasses import dataclass
from math import ceil, floor, inf, isnan, nan

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence import _replan_kernels as _kernels
from sdpgrind.weldbead.sequence._action import SequenceAction
from sdpgrind.weldbead.sequence._as_sdp import as_planned, sdp_problem
from sdpgrind.weldbead.sequence._exact import ExactTable
from sdpgrind.weldbead.sequence._knapsack import has_closed_form
from sdpgrind.weldbead.sequence._pass_rows import tables
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem

# chosen: nodes of the height left, levels of the force of compiled stages, between which the force is
# interpolated, and levels for the solver; tests hold the penalty to 2e-4 $ of fine grids (kinks: 5e-4 $)
NODES, LEVELS, SOLVED = 97, 28, 201
LOWEST = 0.01  # chosen: height of the solver's least grid, mm; the last cuts of a bead are larger
# chosen: levels of the force from its least (0) to its greatest (1), closer near the threshold; even ones
# lose up to 4.5e-4 $ at a twentieth of a millimetre, these 1.1e-4 $
_GRADED = np.linspace(0.0, 1.0, LEVELS) ** 1.5
# derived: levels near the threshold, whose means grow by more than a third each, whatever they scatter
_STEADY = 5


@dataclass(frozen=True)
class NextPass:
    """What to do at one height and time left: the action, and its expected penalty, $."""

    action: SequenceAction
    penalty: float


def next_pass(
    problem: SequenceProblem, method: str, height: float, time_left: float, last_duration: float | None = None
) -> NextPass:
    """Return the best next pass at a height > 0 (mm) and a time left (s), planned anew by a method."""
    planned = as_planned(problem, method)
    if planned.finish_charge is None and planned.lateness_charge is None:
        count = max(floor(min(time_left, planned.horizon) / planned.stage + 1e-9), 0)
        levels = _levels(planned, count)
        if levels is None:
            stop = float(planned.height_charge(height))
            return NextPass(SequenceAction(True, 0.0, nan, nan, inf, problem), stop)
        if not levels.narrow:
            return _by_stages(problem, planned, levels, height, count)
    policy = _replanned(problem, planned, method, height, time_left)
    asked = {} if last_duration is None else {"last_duration": last_duration}
    penalty = float(policy.value(height, time_left, **asked))
    return NextPass(policy.action(height, time_left, **asked), penalty)


@dataclass(frozen=True)
class _Levels:
    """Forces (N) by duration and level, and the law of the depth of each level; durations s, feeds mm/s."""

    steps: npt.NDArray[np.int64]
    durations: Floats
    feed: Floats
    force: Floats
    law: sdp.Law

    @property
    def narrow(self) -> bool:
        """Whether a law is narrower than its mean's step: levels do not resolve the cost."""
        mean, sd = self.law.mean[:, _STEADY:, 0], self.law.sd[:, _STEADY:, 0]
        return bool(np.any(sd[:, 1:] < np.diff(mean, axis=1)))


def _levels(problem: SequenceProblem, count: int) -> _Levels | None:
    """Levels of the durations that fit into `count` stages; None: there is none."""
    fitting = [t for t in problem.durations if round(t / problem.stage) <= count]
    limits = [(t, *problem.force_interval(t)) for t in fitting]
    admissible = [each for each in limits if each[1] < each[2]]
    if not admissible:
        return None
    durations, low, high = np.array(admissible).T
    feed = np.array([problem.feed_rate(t) for t in durations.tolist()])
    force = low[:, None] + (high - low)[:, None] * _GRADED
    law = problem.depths.cut(problem.model, force[..., None], feed[:, None, None])
    return _Levels(np.rint(durations / problem.stage).astype(np.int64), durations, feed, force, law)


def _by_stages(
    problem: SequenceProblem, planned: SequenceProblem, levels: _Levels, height: float, count: int
) -> NextPass:
    """Next pass by stages compiled together, for a deadline that holds and no charge on the last feed."""
    weight, charge = tables(planned, levels.law, height, NODES)
    stop = np.asarray(planned.height_charge(np.linspace(0.0, height, NODES)), dtype=float)
    cost, force = _kernels.stages(_whole(weight), charge, levels.force, levels.steps, count, stop)
    return _cheapest(problem, levels, cost, force, float(stop[-1]))


def _whole(weight: Floats) -> Floats:
    """Weights with columns of zeros up to a multiple of those taken together."""
    return np.pad(weight, ((0, 0), (0, -weight.shape[1] % _kernels.TOGETHER)))


def _cheapest(
    problem: SequenceProblem, levels: _Levels, cost: Floats, force: Floats, stop: float
) -> NextPass:
    """Stop, or the duration of least cost; the gap is that to the second of them, $."""
    first, second = np.sort(np.append(cost, stop))[:2]
    if stop <= first:
        return NextPass(SequenceAction(True, 0.0, nan, nan, float(second - stop), problem), stop)
    k = int(np.argmin(cost))
    duration, feed, at = (float(each[k]) for each in (levels.durations, levels.feed, force))
    action = SequenceAction(False, duration, feed, at, float(second - first), problem)
    return NextPass(action, float(first))


def _replanned(
    problem: SequenceProblem, planned: SequenceProblem, method: str, height: float, time_left: float
) -> SequencePolicy:
    """Policy of a problem up to a height (mm) and a time left (s); more of them changes nothing."""
    low = max(height, LOWEST)
    rest = ahead(planned, time_left)
    rest = rest.replace(height_max=low) if low < rest.height_max else rest
    exact = has_closed_form(rest)
    table = ExactTable.of(rest) if exact else sdp.plan(sdp_problem(rest, NODES, levels=SOLVED))
    told = problem.replace(height_max=rest.height_max, horizon=rest.horizon)
    return SequencePolicy(told, table, method)


def ahead(problem: SequenceProblem, time_left: float) -> SequenceProblem:
    """Problem of the time left (s): more time changes nothing in its plan, to the bit."""
    if isnan(time_left):
        return problem
    stages = ceil(max(time_left, 0.0) / problem.stage)
    horizon = min(max(stages * problem.stage, problem.durations[0]), problem.horizon)
    return problem.replace(horizon=horizon)
