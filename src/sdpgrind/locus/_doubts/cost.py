"""Least cost at the middle of the hidden states, planned again at both ends of each interval."""

import warnings
from collections.abc import Sequence

from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus._problem.problem import Problem


def of_plan(problem: Problem, rows: Sequence[Doubt]) -> tuple[Figure, tuple[Stake, ...]]:
    """Return the least cost as believed, in its unit, and at the ends of each interval."""
    middle = {name: 0.5 * (low + high) for name, (low, high) in problem.hidden.items()}
    where = ", ".join(f"{name} {value:.4g}" for name, value in middle.items())
    figure = Figure(
        f"least cost at {where}", problem.unit("cost"), _cost(problem, middle), "method of `locus.plan`"
    )

    def solved(name: str, value: float) -> float:
        return _cost(problem.replace(model=problem.model.replace(**{name: value})), middle)

    return figure, stakes(rows, figure, solved)


def _cost(problem: Problem, middle: dict[str, float]) -> float:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return float(plan(problem).at(**middle).cost)
