"""Solve on a grid, or refine the grid to a tolerance."""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.progress import Portions, Progress, ProgressOption, logger, reporting, silent
from sdpgrind.sdp._plan.budget import Resources, afford_grid
from sdpgrind.sdp._plan.grid_error import GridChanges, away_error, changes_between, estimated, grid_error
from sdpgrind.sdp._plan.look_up_error import between_nodes
from sdpgrind.sdp._policy.policy import Policy
from sdpgrind.sdp._problem.coordinates import Levels, Stages
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.forever import solve_forever
from sdpgrind.sdp._solve.stages import solve_stages
from sdpgrind.sdp._transitions.sampled import Sampled

REFINEMENTS = 10  # chosen: most halvings of the cells; memory ends most problems before
STALLED = 0.6  # chosen: least ratio of changes at which halving is useless; second order gives 0.25
FIRST_GUESS = 4  # chosen: halvings expected before an error is known; it serves progress alone


class ToleranceError(ValueError):
    """Unreachable tolerance.

    Attributes
    ----------
    message : str
        Sentence with the reachable error, $.
    policy : Policy
        The best policy; its ``error`` ($) is above the tolerance.
    """

    def __init__(self, message: str, policy: Policy) -> None:
        super().__init__(message)
        self.message, self.policy = message, policy


@reporting
def plan(
    problem: Problem,
    *,
    tolerance: float | None = None,
    executor: Executor | None = None,
    progress: ProgressOption = None,
    throw: bool = True,
    time_limit: float | None = None,
    memory_limit: float | None = None,
    estimate: bool = False,
) -> Policy:
    """Solve a problem by stochastic dynamic programming.

    Parameters
    ----------
    problem : Problem
        Problem to be solved.
    tolerance : float, optional
        Largest estimated error of the value-to-go ($), at nodes and between them: cells of all axes are
        halved, and controls and sampled noise refined, to reach it. None: solve on the given grid; the
        policy's ``error`` is None without `estimate`.
    executor : concurrent.futures.Executor, optional
        Executor for blocks of problems with two or three axes; results do not depend on it. Ignored on one
        axis.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error for long solves.
    throw : bool
        Raise if the tolerance is unreachable; False: return the best policy, its ``error`` above the
        tolerance, and the reason as its ``status``.
    time_limit : float, optional
        Time of the refinement, s: cells are halved again only if the time predicted for it is left. Two grids
        are always solved. The policy's ``problem`` on the nodes of its ``grid``, solved alone, gives the same
        table to the bit.
    memory_limit : float, optional
        Largest memory of a solve, predicted from the sizes of its tables before each, bytes. Default: tables
        of 2 GiB.
    estimate : bool
        Without a tolerance: estimate the error from a second solve, on half the nodes and control levels.

    Returns
    -------
    Policy
        Value-to-go ($), actions, gaps.

    Raises
    ------
    ValueError
        When a state allows no action, the process never ends, a refused edge is passed, or the first grid
        is beyond the memory limit.
    ToleranceError
        When the tolerance is unreachable; holds the best policy.

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> bend = sdp.Problem(
    ...     [sdp.Axis("error", -3, 3, 121, "mm", below="stop", above="stop")],
    ...     [sdp.Move("bend", {"by": sdp.Levels(0, 5, 101)},
    ...               sdp.Shift("error", lambda s, c: sdp.Normal(c.by, 0.1 * c.by)))],
    ...     [sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))],
    ...     sdp.Stages(2, 1.0, "hits_left", ""),
    ... )
    >>> policy = sdp.plan(bend)
    >>> policy.value(error=2.0, hits_left=2) < policy.value(error=2.0, hits_left=1) < 2.0
    True
    """
    checks.kind("problem", problem, Problem, " of this package, as axes, moves, stops and stages make it")
    assert callable(progress)  # made by the decorator
    if tolerance is None:
        _refuse_limits(time_limit=time_limit, memory_limit=memory_limit)
        portions = Portions(progress)
        policy = _solve(problem, 1, executor, portions.next(3.0, float(estimate)), every_move=False)
        if estimate:
            solve = partial(_solve, executor=executor, tell=portions.next(1.0))
            policy.error, policy.error_away = estimated(policy, solve)
    else:
        checks.positive("tolerance", tolerance, "$")
        budget = Resources.of(time_limit, memory_limit)
        policy = _refined(problem, tolerance, executor, Portions(progress), throw, budget)
    progress(1.0, "planned")
    return policy


def _solve(
    problem: Problem, refine: int, executor: Executor | None, tell: Progress, every_move: bool = True
) -> Policy:
    """Solve on one grid; with `every_move`, those too long to begin count for the error of the search."""
    if refine == 1:  # finer ones are bounded by the memory limit
        afford_grid(problem)
    grid = Grid.of(problem, refine)
    logger.info("solving on %d nodes", grid.size)
    tell(0.0, f"{grid.size} nodes: tables of the moves")
    stages = problem.stages
    solve = solve_stages if isinstance(stages, Stages) else solve_forever
    longest = None
    if isinstance(stages, Stages) and stages.late is None and not every_move:
        longest = stages.count
    with one_blas_thread():
        table = solve(problem, grid, Bundles(problem, grid, executor, longest=longest), tell)
    return Policy(problem, Layout.of(problem, grid, table.base is not None), table.stacked(), None)


def _refuse_limits(**limits: float | None) -> None:
    """Refuse limits of a refinement where a single grid is asked for."""
    for name, limit in limits.items():
        if limit is not None:
            raise ValueError(f"{name} must be None with tolerance=None, a single grid; got {limit!r}")


def _refined(
    problem: Problem,
    tolerance: float,
    executor: Executor | None,
    portions: Portions,
    throw: bool,
    budget: Resources,
) -> Policy:
    budget.check(problem)
    before = _solve(problem, 1, executor, portions.next(1.0, _work_after(0, FIRST_GUESS, problem)))
    budget.solved()
    if not budget.fits(problem, 2):
        return _single(before, tolerance, executor, throw, budget)
    changes: list[float] = []
    found: list[GridChanges] = []
    hopeless = 0  # halvings in a row without promise; a single one may first resolve a kink
    for halvings in range(1, REFINEMENTS + 1):
        if before.table.search_error > tolerance / 4 or _stalls(changes):
            problem = _with_finer_levels(problem, 2**halvings, budget)
        more = _halvings_to(tolerance, changes, halvings, problem, budget)
        tell = portions.next(1.0, _work_after(halvings, more, problem))
        policy = _solve(problem, 2**halvings, executor, tell)
        found.append(changes_between(before, policy))
        changes.append(found[-1].every)
        budget.solved()
        # The grid suffices, the search does not.
        short = grid_error(changes) <= tolerance / 2 < policy.table.search_error
        finer = _with_finer_levels(problem, 2**halvings, budget)
        if short and finer is not problem and not budget.out_of_time(problem):
            problem = finer
            policy = _solve(problem, 2**halvings, executor, portions.next(1.0, 1.0))
            budget.solved()
        error = grid_error(changes) + policy.table.search_error
        room = _halvings_left(problem, halvings, budget)
        logger.debug(
            "halving %d: largest change %.3g, search %.3g, error %.3g, wanted %.3g",
            halvings, changes[-1], policy.table.search_error, error, tolerance,
        )  # fmt: skip
        if halvings > 2:  # the first grids may be too coarse to judge by
            hopeless = hopeless + 1 if _within_reach(error, changes, room) > tolerance else 0
        status = _end(problem, halvings, room, throw and hopeless > 1, budget)
        if (halvings > 1 and error <= tolerance) or status:
            solve = partial(_solve, refine=2**halvings, executor=executor, tell=silent)
            problem, policy, error = _final(problem, policy, error, found, tolerance, solve, budget)
        policy.error = error
        if (halvings > 1 and error <= tolerance) or not problem.axes:
            policy.status = "tolerance reached"
            return policy
        if status:
            policy.status = status
            if throw:
                raise _out_of_reach(tolerance, policy, changes, room, budget)
            return policy
        before = policy
    raise AssertionError("a hopeless tolerance is refused before")


def _final(
    problem: Problem,
    policy: Policy,
    error: float,
    found: list[GridChanges],
    tolerance: float,
    solve: Callable[[Problem], Policy],
    budget: Resources,
) -> tuple[Problem, Policy, float]:
    """Problem, policy and error of the last grid, with what look-ups between nodes and quadrature add."""
    shared = grid_error([each.shared for each in found])
    error = max(error, shared + between_nodes(policy) + policy.table.search_error)
    off = away_error(policy, found)
    problem, policy, noise = _with_enough_noise(problem, policy, tolerance / 4, solve, budget)
    policy.error_away = None if off is None else off + noise
    return problem, policy, error + noise


def _single(
    policy: Policy, tolerance: float, executor: Executor | None, throw: bool, budget: Resources
) -> Policy:
    """The first grid, with an error from half of it, where memory allows no second one."""
    solve = partial(_solve, executor=executor, tell=silent)
    policy.error, policy.error_away = estimated(policy, solve)
    policy.status = "tolerance reached" if policy.error <= tolerance else "memory limit"
    if throw and policy.error > tolerance:
        raise _out_of_reach(tolerance, policy, [policy.error], 0, budget)
    return policy


def _end(problem: Problem, halvings: int, room: int, hopeless: bool, budget: Resources) -> str:
    """Why no further grid is solved; "": one is."""
    if halvings == REFINEMENTS:
        return "finest grid"
    if room == 0:
        return "memory limit"
    if not problem.axes or hopeless:
        return "out of reach" if hopeless else ""
    return "time limit" if budget.out_of_time(problem) else ""


def _work_after(halvings: int, more: int, problem: Problem) -> float:
    """Work after a grid over the work on it, if `more` halvings follow; one axis: 1 : 4 : 16."""
    ratio = 2.0 ** (1 + len(problem.axes))
    return sum(ratio**k for k in range(1, more + 1))


def _halvings_to(
    tolerance: float, changes: list[float], halvings: int, problem: Problem, budget: Resources
) -> int:
    """Number of halvings expected after the next solve; the error falls to a quarter with each."""
    if not changes:
        return FIRST_GUESS - halvings
    later = np.log(max(grid_error(changes) / tolerance, 1.0)) / np.log(4.0) - 1.0
    return int(np.clip(np.ceil(later), 0, _halvings_left(problem, halvings, budget)))


def _stalls(changes: list[float]) -> bool:
    """Whether halving the cells no longer helps; the search between levels may then be at fault."""
    return len(changes) > 2 and changes[-1] > STALLED * changes[-2]


def _rate(changes: list[float]) -> float:
    return min(4.0, max(1.25, changes[-2] / max(changes[-1], 1e-300)))


def _within_reach(error: float, changes: list[float], room: int) -> float:
    """Least error ($) within `room` further halvings, each of which halves it at least."""
    return float(error / max(2.0, _rate(changes)) ** room)


def _out_of_reach(
    tolerance: float, policy: Policy, changes: list[float], room: int, budget: Resources
) -> ToleranceError:
    assert policy.error is not None  # refined policies have one
    late = policy.status == "time limit"
    reachable = 1.5 * policy.error / (1.0 if late or not room else _rate(changes) ** room)
    return ToleranceError(
        f"tolerance must be reachable within {budget.told} ($); got {tolerance:g}: try"
        f" {reachable:.1g}, or throw=False for the best that can be reached",
        policy,
    )


def _halvings_left(problem: Problem, done: int, budget: Resources) -> int:
    """Number of further halvings that memory allows."""
    room = 0
    while done + room < REFINEMENTS and budget.bytes(problem, 2 ** (done + room + 1)) <= budget.largest:
        room += 1
    return room


def _with_finer_levels(problem: Problem, refine: int, budget: Resources) -> Problem:
    """Problem with twice the levels of searched controls; the same where memory does not allow them."""
    moves = []
    for move in problem.moves:
        finer = {
            k: replace(v, count=2 * v.count) if isinstance(v, Levels) and v.search else v
            for k, v in move.controls.items()
        }
        moves.append(replace(move, controls=finer))
    twice = replace(problem, moves=moves)
    return twice if budget.fits(twice, refine) else problem


def _with_enough_noise(
    problem: Problem, policy: Policy, tolerance: float, solve: Callable[[Problem], Policy], budget: Resources
) -> tuple[Problem, Policy, float]:
    """Double the quadrature points of sampled noise until the value settles; return its last change, $.

    With a budget the policy stays, and the change of one doubling is estimated.
    """
    change = 0.0
    if budget.given and (finer := _with_finer_noise(problem)) is not None:
        return problem, policy, float(np.max(np.abs(policy.table.value - solve(finer).table.value)))
    while (finer := _with_finer_noise(problem)) is not None:
        problem, before, policy = finer, policy, solve(finer)
        change = float(np.max(np.abs(policy.table.value - before.table.value)))
        if change <= tolerance:
            break
    return problem, policy, change


def _with_finer_noise(problem: Problem) -> Problem | None:
    """Problem with twice the quadrature points of sampled noise; None without such noise."""
    moves = []
    for move in problem.moves:
        to = move.to
        if isinstance(to, Sampled):
            finer = replace(to, points=2 * to.points)
            to = finer if finer.quadrature()[1].size > to.quadrature()[1].size else to
        moves.append(replace(move, to=to))
    same = all(one.to is other.to for one, other in zip(moves, problem.moves, strict=True))
    return None if same else replace(problem, moves=moves)
