"""Sequence planner: writes a weld-bead problem as one of `sdp` and solves it."""

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.progress import Portions, Progress, ProgressOption, reporting
from sdpgrind.base.warned import warn
from sdpgrind.weldbead.sequence._as_sdp import LEVELS, METHODS, as_planned, sdp_problem
from sdpgrind.weldbead.sequence._exact import ExactTable
from sdpgrind.weldbead.sequence._knapsack import has_closed_form
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._unfinished import unfinished

NARROW = "a function that jumps, or a law too narrow for the grid; see policy.error"
START_NODES = 101  # chosen: first grid of the refinement to a tolerance
# $, chosen: 1 % of what a bead costs; the value is off by more from what a plan that learns costs
LEARNED = 1e-3
HALVINGS = 6  # chosen: largest number of halvings of the stage for a continuous feed; each doubles the moves


@dataclass(frozen=True)
class _Grids:
    """How grids are solved: first nodes and levels, executor, and limits of the refinement (s, bytes)."""

    nodes: int | None = None
    levels: int = LEVELS
    executor: Executor | None = None
    time_limit: float | None = None
    memory_limit: float | None = None

    def solve(
        self, problem: SequenceProblem, tolerance: float | None, progress: Progress, throw: bool = True
    ) -> SequencePolicy:
        """Solve one grid, and half of it for the error, or refine to a tolerance, $."""
        nodes = self.nodes if self.nodes is not None else (START_NODES if tolerance is not None else 401)
        table = sdp.plan(
            sdp_problem(problem, nodes, levels=self.levels), tolerance=tolerance, executor=self.executor,
            progress=progress, throw=throw, time_limit=self.time_limit, memory_limit=self.memory_limit,
            estimate=tolerance is None,
        )  # fmt: skip
        return SequencePolicy(problem, table)

    def limited(self) -> dict[str, float]:
        """Limits that were given, by name."""
        limits = {"time_limit": self.time_limit, "memory_limit": self.memory_limit}
        return {name: limit for name, limit in limits.items() if limit is not None}


@reporting
def plan(
    problem: SequenceProblem,
    *,
    tolerance: float | Literal["auto"] | None = "auto",
    nodes: int | None = None,
    levels: int = LEVELS,
    feed: str = "lattice",
    method: str = "cautious",
    executor: Executor | None = None,
    progress: ProgressOption = None,
    throw: bool = True,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> SequencePolicy:
    """Plan a grinding sequence; Brown (1988), chapter 5.

    Parameters
    ----------
    problem : SequenceProblem
        Problem to plan.
    tolerance : float, optional
        Largest estimated error of the expected penalty at any height, $. "auto": 1e-5 $, or one millionth of
        the charge on the whole bead where that exceeds 10 $; 1e-3 $ where beads differ, as the plan is made
        anew after each pass; out of reach (charges that jump), the best plan comes with a warning. None: one
        solve on `nodes` nodes, and one on half of them for the error.
    nodes : int, optional
        Height nodes of that single grid (default 401), or of the first grid of the refinement.
    levels : int
        Levels of the normal force (N), between which is searched; a refinement doubles them where it must.
    feed : {"lattice", "continuous"}
        "lattice": the durations of the problem. "continuous": any feed between their slowest and fastest; the
        stage is halved, with all its multiples as durations, until the expected penalty at the coarser states
        changes by at most `tolerance`.
    method : {"cautious", "certain"}
        With a `bead_scatter`. "cautious": each pass is planned as if the bead's coefficients were drawn anew
        for it, from what is believed of them. "certain": as if they were known; for comparison, it may cost
        ten times as much. Controllers learn and plan again after each pass by the same method.
    executor : concurrent.futures.Executor, optional
        Passed on to `sdp.plan`, which ignores it on one axis.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.
    throw : bool
        Whether an unreachable tolerance is an error; False: return the best plan and its ``error``.
    time_limit : float, optional
        Time of the refinement, s: the grid is halved again only if the time predicted for it is left; two
        grids are always solved. The best plan so far comes with its ``error`` and ``status``; `throw` counts
        for a tolerance that was given. `policy.nodes` and `policy.levels` with ``tolerance=None`` give the
        same tables to the bit.
    memory_limit : float, optional
        Largest memory of the tables of a solve, predicted before each, bytes; one below that of the first
        grid is refused. Default: 2 GiB.

    Returns
    -------
    SequencePolicy
        Expected penalty ($) and best pass for every height (mm) and time left (s).

    Warns
    -----
    UserWarning
        When the default tolerance ($) is out of reach, or the greatest height cannot be ground away in the
        whole horizon by mean cuts: with what is left (mm), and the time (s) or force (N) that would do.

    Raises
    ------
    ValueError
        When the first grid is beyond the memory limit (bytes).
    sdp.ToleranceError
        When a given tolerance ($) is out of reach.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> policy = weldbead.plan(weldbead.preset("P1"), tolerance=1e-3)
    >>> round(policy.value(height=1.0, time_left=10.0), 3)
    0.634
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, SequenceProblem, " (see weldbead.preset)")
    checks.one_of("feed", feed, ("lattice", "continuous"))
    if isinstance(tolerance, str):
        checks.one_of("tolerance", tolerance, ("auto",))
    elif tolerance is not None:
        checks.positive("tolerance", tolerance, "$")
    solved = as_planned(problem, checks.one_of("method", method, METHODS))
    if left := unfinished(solved):
        warn(left)
    grids = _Grids(nodes, levels, executor, time_limit, memory_limit)
    if feed == "continuous":
        found = _plan_continuous(solved, tolerance, progress, grids)
    elif tolerance is not None and has_closed_form(solved):
        found = SequencePolicy(solved, ExactTable.of(solved))
    elif isinstance(tolerance, str):
        found = _plan_as_well_as_can_be(solved, progress, grids)
    else:
        found = grids.solve(solved, tolerance, progress, throw)
    if solved is not problem:
        lattice = {"stage": found.problem.stage, "durations": found.problem.durations}
        found = SequencePolicy(problem.replace(**lattice), found.table, method)
    if found.status == "time limit":  # another clock might end with another grid
        found._repeat = {"tolerance": None, "nodes": found.nodes, "levels": found.levels, "method": method}
    return found


def _plan_as_well_as_can_be(problem: SequenceProblem, progress: Progress, grids: _Grids) -> SequencePolicy:
    """Plan to the default tolerance, within the limits, or to the best in reach with a warning."""
    wanted, limited = default_tolerance(problem), bool(grids.limited())
    try:
        policy = grids.solve(problem, wanted, progress, throw=not limited)
    except sdp.ToleranceError as best:
        policy = SequencePolicy(problem, best.policy)
    assert policy.error is not None  # refined policies have one
    if policy.error > wanted and (jump := _jump(problem) or (not limited and NARROW)):
        known = f"known to {policy.error:.1g} ${policy.told_away}, not to {wanted:g} $"
        warn(f"the expected penalty is {known}: {jump}")
    return policy


def _jump(problem: SequenceProblem) -> str:
    """Words for a height charge that jumps; "": it does not."""
    charge = problem.height_charge
    for side in (charge.under, charge.over):
        if isinstance(side, sdp.Constant) and not side.zero and (side is charge.under or not side.tolerance):
            place = f"a charge that jumps, at {side.tolerance:g} mm,"
            return f"{place} is of order 1: twice the nodes halve the error"
    return ""


def default_tolerance(problem: SequenceProblem) -> float:
    """Return the default tolerance, $: more where beads differ or a whole bead is charged above 10 $."""
    least = 1e-5 if problem.bead_scatter is None else LEARNED
    return max(least, 1e-6 * float(problem.height_charge(problem.height_max)))


def _plan_continuous(
    problem: SequenceProblem, asked: float | str | None, progress: Progress, grids: _Grids
) -> SequencePolicy:
    for name, limit in grids.limited().items():
        raise ValueError(f"{name} must be None with feed='continuous'; got {limit!r}")
    tolerance = default_tolerance(problem) if isinstance(asked, str) else 1e-3 if asked is None else asked
    portions = Portions(progress)  # twice the stages and twice the moves: four times the work
    first = with_stage(problem, problem.stage)
    policy = _Grids().solve(first, tolerance / 4, portions.next(1.0, 20.0))
    for _ in range(HALVINGS):
        part = portions.next(1.0, 4.0)
        halved = with_stage(problem, policy.problem.stage / 2)
        finer = _Grids().solve(halved, tolerance / 4, part)
        change = _largest_change(policy, finer)
        policy = finer
        if change <= tolerance:
            return policy
    raise ValueError(
        f"tolerance must be reachable within {HALVINGS} halvings of the stage ($); got {tolerance:g},"
        f" last change {change:.2g}"
    )


def with_stage(problem: SequenceProblem, stage: float) -> SequenceProblem:
    """Return the problem with another stage, s, and all its multiples in the range of the durations."""
    low, high = problem.durations[0], problem.durations[-1]
    durations = np.arange(round(low / stage), round(high / stage) + 1) * stage
    return problem.replace(stage=stage, durations=tuple(float(t) for t in durations))


def _largest_change(coarse: SequencePolicy, fine: SequencePolicy) -> float:
    height = np.linspace(0.0, coarse.problem.height_max, 201)[:, None]
    time = np.arange(0.0, coarse.problem.horizon + coarse.problem.stage / 2, coarse.problem.stage)
    return float(
        np.max(
            np.abs(coarse.value(height=height, time_left=time) - fine.value(height=height, time_left=time))
        )
    )
