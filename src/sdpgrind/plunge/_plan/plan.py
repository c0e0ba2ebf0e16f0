"""Planning of the fastest plunge cycle."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.progress import Portions, Progress, ProgressOption, reporting
from sdpgrind.plunge._model.dynamics import burns_always, core_at
from sdpgrind.plunge._model.model import FASTEST_WORK
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.cycle import SOLVED, CycleError, CyclePlan, CycleSolution
from sdpgrind.plunge._plan.doubted import DEGREE, Safety, limits_of, margin_and_doubts
from sdpgrind.plunge._plan.exact import fastest
from sdpgrind.plunge._plan.replay import Commands, CycleReplay, replay
from sdpgrind.plunge._plan.trajectory import of_exact, of_replay, switches

METHODS = ("exact", "dp", "collocation")
FEWEST = 40  # chosen: least number of steps; the error estimate needs a quarter of them
# chosen: error relative to the time of closed forms and roots, and of solved and replayed programs
ROUNDING, SOLVING = 1e-12, 1e-6


@reporting
def plan(
    problem: CycleProblem,
    *,
    method: str = "exact",
    confidence: float | None = None,
    gauge: bool = True,
    safety_margin: float = 0.0,
    work_rotation_range: tuple[float, float] | None = None,
    steps: int | None = None,
    throw: bool = True,
    progress: ProgressOption = None,
) -> CyclePlan:
    """Plan the fastest cycle.

    ``"exact"``: the bound of all limits in closed pieces; nothing is faster.
    ``"dp"``: dynamic programming over the remaining stock, by `sdpgrind.sdp`; also for wear in proportion to
    the stock.
    ``"collocation"``: an optimal control problem for CasADi and IPOPT; also for any wear and a free rotation
    of the work. Its minimum is local, near a plain start, without proof that it is global. A free rotation
    may jump, but is constant in the last turn, which makes the part round.

    Parameters
    ----------
    problem : CycleProblem
        Stock and limits.
    method : {"exact", "dp", "collocation"}
        Method.
    confidence : float, optional
        Chance that no finished surface is burned, with what `problem.uncertainty` doubts; at least 0.5. None:
        the values of the problem are taken as exact.
    gauge : bool
        Whether the size is measured. False: the doubts of contact and deflection count in full, as for a
        program that runs without a gauge; only with a confidence.
    safety_margin : float
        Minimum distance between burn depth and remaining stock, mm; (7).
    work_rotation_range : (float, float), optional
        Least and greatest rotation of the work, rad/s, where it is free; "collocation" only.
    steps : int, optional
        Stages of "dp" (200) or intervals of "collocation" (240). The error is estimated from a half and a
        quarter as many.
    throw : bool
        Raise where a solver fails; False: return its last plan with its `status`.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    CyclePlan
        Plan with its time and error in s.

    Raises
    ------
    ValueError
        If the margin is negative or not below the stock (mm), the range of the rotation is invalid (rad/s),
        the method cannot solve the problem, wear makes the work burn at every rate, or no rate is safe with
        the confidence.
    CycleError
        If a solver fails: a ValueError with the last plan reached.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> best = plunge.plan(problem)
    >>> round(best.time, 4), best.error < 1e-9
    (12.0195, True)
    >>> dull = problem.replace(wear=plunge.Wear(growth=0.02))
    >>> [round(plunge.plan(dull, method=name, steps=100).time, 2) for name in ("dp", "collocation")]
    [12.66, 12.66]

    What a doubt of 3 percent of the burn threshold costs, with a wheel known exactly:

    >>> doubted = problem.replace(burning_sd=0.03, sharpness_sd=0.0)
    >>> safe = plunge.plan(doubted, confidence=0.999)
    >>> round(safe.time, 4), {name: round(seconds, 3) for name, seconds in safe.price.items()}
    (12.4643, {'burning_sd': 0.445, 'all': 0.445})
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, CycleProblem, " (see plunge.preset)")
    checks.one_of("method", method, METHODS)
    if checks.nonnegative("safety_margin", safety_margin, "mm") >= problem.stock:
        raise checks.refuse("safety_margin", f"< stock = {problem.stock:g}", safety_margin, "mm")
    _check_confidence(problem, confidence, checks.kind("gauge", gauge, bool), work_rotation_range)
    safety = Safety(safety_margin, confidence, gauge)
    rotation = _rotation(problem, method, work_rotation_range)
    _check_wear(problem, method, rotation)
    if method == "exact":
        if steps is not None:
            raise ValueError(f"steps must be None with method 'exact', which has none; got {steps!r}")
        progress(0.0, "the bound of all limits")
        cycle = _by_envelope(problem, safety)
        progress(1.0, "planned")
        return cycle
    found = _by_stages if method == "dp" else _by_collocation
    count = None if steps is None else checks.count("steps", steps, FEWEST)
    best = found(problem, safety, rotation, count, progress)
    if throw and best.solution is not None and not best.solution.ok:
        raise CycleError(
            f"problem must be one that method {method!r} can solve; it was {best.status}: try other steps,"
            " milder limits, or throw=False for the last that was reached",
            best,
        )
    return best


def _rotation(problem: CycleProblem, method: str, asked: Any) -> tuple[float, float]:
    if asked is None:
        return problem.model.work_rotation, problem.model.work_rotation
    if method != "collocation":
        raise ValueError(f"method must be 'collocation' where work_rotation_range is given; got {method!r}")
    if np.shape(asked) != (2,):
        raise ValueError(
            f"work_rotation_range must be a least and a greatest rotation (rad/s); got {checks.shown(asked)}"
        )
    low, high = (checks.positive(f"work_rotation_range[{k}]", x, "rad/s") for k, x in enumerate(asked))
    if not low <= high <= FASTEST_WORK:
        raise ValueError(
            f"work_rotation_range must rise, up to {FASTEST_WORK:g} at most (rad/s);"
            f" got {checks.shown(asked)}"
        )
    return low, high


def _check_wear(problem: CycleProblem, method: str, rotation: tuple[float, float]) -> None:
    wear = problem.model.wear
    if wear is None or wear.growth == 0:
        return
    if method == "exact":
        raise ValueError("method must be 'dp' or 'collocation' where the model has wear; got 'exact'")
    if wear.exponent != 0 and method == "dp":
        raise ValueError(
            "method must be 'collocation' where wear depends on the rate,"
            f" exponent = {wear.exponent:g}; got 'dp'"
        )
    area = problem.model.wear_flat_area + wear.growth * problem.stock
    if (
        wear.exponent == 0
        and rotation[0] == rotation[1]
        and burns_always(core_at(problem.model, rotation[0], area))
    ):
        raise ValueError(
            f"wear must be less: at the end the wear flat area is {area:.4g}, and the work burns at every"
            f" infeed rate; got growth = {wear.growth:g} (1/mm)"
        )


def _check_confidence(problem: CycleProblem, confidence: float | None, gauge: bool, rotation: Any) -> None:
    if confidence is None:
        if not gauge:
            raise ValueError(
                "confidence must be given where gauge=False: without a gauge the stock is doubted"
            )
        return
    checks.confidence("confidence", confidence)
    if rotation is not None or (problem.model.wear is not None and problem.model.wear.growth > 0.0):
        raise ValueError(
            "confidence must be None where the rotation is free or the model has wear: the chance of burning"
            f" is known for one rotation and one wheel; got {confidence:g}"
        )


def _by_envelope(problem: CycleProblem, safety: Safety) -> CyclePlan:
    limits, coarse = limits_of(problem, safety), limits_of(problem, safety, DEGREE // 2)
    time, ends, course = fastest(limits)
    error = abs(time - fastest(coarse, points=20)[0]) + ROUNDING * time
    course_of = partial(of_exact, problem, course)
    return CyclePlan(problem, safety.margin, error, ends, course_of, **safety.doubts)


def _by_stages(
    problem: CycleProblem, safety: Safety, rotation: tuple[float, float], steps: int | None, tell: Progress
) -> CyclePlan:
    from sdpgrind.plunge._plan import dp as _dp

    played, count = [], steps or _dp.STAGES
    margin, doubted = margin_and_doubts(problem, safety)
    for stages in _told((count // 4, count // 2, count), tell):
        solved = _dp.solve(problem, margin, stages, doubted)
        commands = Commands(solved.command, solved.duration, np.full(stages, rotation[0]))
        played.append(replay(problem, commands, margin, doubted))
    best = played[-1]
    found = CycleSolution(count, 0, 0.0, best.excess, best.left, SOLVED)
    return _refined(problem, safety, "dp", played, found)


def _told(sizes: tuple[int, ...], tell: Progress) -> Iterator[int]:
    """Yield numbers of steps and tell them; the work grows with the steps."""
    portions = Portions(tell)
    for k, size in enumerate(sizes):
        part = portions.next(size, sum(sizes[k + 1 :]))
        part(0.0, f"{size} steps")
        yield size
        part(1.0, f"{size} steps")


def _by_collocation(
    problem: CycleProblem, safety: Safety, rotation: tuple[float, float], steps: int | None, tell: Progress
) -> CyclePlan:
    from sdpgrind.plunge._plan import collocation

    count = steps or collocation.INTERVALS
    margin, doubted = margin_and_doubts(problem, safety)
    solved = [
        collocation.solve_from_guess(problem, margin, rotation, intervals, doubted)
        for intervals in _told((count // 4, count // 2, count), tell)
    ]
    played = [replay(problem, one.commands, margin, doubted) for one in solved]
    fine, best = solved[-1], played[-1]
    found = CycleSolution(count, fine.iterations, fine.residual, best.excess, best.left, fine.message)
    return _refined(problem, safety, "collocation", played, found)


def _refined(
    problem: CycleProblem, safety: Safety, method: str, played: list[CycleReplay], found: CycleSolution
) -> CyclePlan:
    """Plan of the finest of three solutions of second order, each with twice the steps of the one before.

    The last change is three times the error, or by chance less; so a quarter of the change before counts too.
    """
    quarter, half, whole = (float(one.time[-1]) for one in played)
    error = max(abs(whole - half), abs(half - quarter) / 4) + SOLVING * whole if found.ok else np.inf
    course = of_replay(problem, played[-1], safety.margin)
    return CyclePlan(problem, safety.margin, error, switches(course), course, method, found, **safety.doubts)
