"""Time of the plunge cycle, planned again at both ends of each interval."""

import warnings
from collections.abc import Callable, Sequence

from sdpgrind.base import checks
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes, together
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.plan import plan

_STEPS = 80  # chosen: of "dp" and "collocation"; the time is known to some 1e-3
_SOLVED = {"exact": "exact", "dp": f"dp, {_STEPS} steps", "collocation": f"collocation, {_STEPS} steps"}

_OF_THE_PLAN = ("linear_time_constant", "normal_force_ratio", "wear_flat_area")


def of_plan(
    problem: CycleProblem, rows: Sequence[Doubt], updated: Callable[[], CycleProblem] | None
) -> tuple[Figure, tuple[Stake, ...]]:
    """Return the time of the cycle as believed, s, at the ends of each interval, and with all values.

    `updated`: the problem with all of them; None: there is no such one.
    """
    figure = Figure("cycle time", "s", _time(problem), f"method {_SOLVED[_method(problem)]}")
    found = stakes(rows, figure, lambda name, value: _with(problem, name, value))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return figure, found if updated is None else together(found, lambda: _time(updated()))


def _with(problem: CycleProblem, name: str, value: float) -> float | None:
    """Time of the cycle with another value, s; None: it does not depend on it.

    A time constant beside the deflection of a model, which does not fit where it is told, is a linear lag.
    """
    if name == "time_constant" and problem.model.linear_time_constant is None:
        name = "linear_time_constant"
    if name not in _OF_THE_PLAN:
        return None
    checks.positive(name, value)  # an interval may end at 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return _time(problem.replace(**{name: value}))


def _method(problem: CycleProblem) -> str:
    wear = problem.model.wear
    if wear is None or wear.growth == 0:
        return "exact"
    return "dp" if wear.exponent == 0 else "collocation"


def _time(problem: CycleProblem) -> float:
    method = _method(problem)
    return plan(problem, method=method, steps=None if method == "exact" else _STEPS).time
