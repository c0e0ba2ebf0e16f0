"""Least cost at the middle of the hidden states, planned again at both ends of each interval."""

import warnings
from collections.abc import Sequence
from functools import partial

from sdpgrind.base.brief import listed
from sdpgrind.base.doubts.stakes import Figure, Stake, jointly, stakes
from sdpgrind.identify import Estimate
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus._curve.point import Point
from sdpgrind.locus._doubts.sets import FieldRow
from sdpgrind.locus._problem.problem import Problem


def of_plan(
    problem: Problem, told: Sequence[FieldRow], pairs: Sequence[Estimate]
) -> tuple[Figure, tuple[Stake, ...], dict[str, float]]:
    """Return the least cost as believed, in its unit, at the ends of each interval, and with each pair.

    Last the controls of the plan as believed, in their units.
    """
    estimates = {each.row.name: each.estimate for each in told if each.estimate is not None and each.fits}
    middle = {name: 0.5 * (low + high) for name, (low, high) in problem.hidden.items()}
    where = ", ".join(f"{name} {value:.4g}" for name, value in middle.items())
    best = _best(problem, middle)
    figure = Figure(f"least cost at {where}", problem.unit("cost"), best.cost, "method of `locus.plan`")

    def solved(name: str, value: float) -> float:
        changed = _moved(estimates[name], name, value)
        return _best(problem.replace(model=problem.model.replace(**changed)), middle).cost

    alone = stakes([each.row for each in told], figure, solved)
    joint = [jointly(listed(each.names), partial(_updated, problem, each, middle)) for each in pairs]
    return figure, (*alone, *joint), best.controls


def _moved(estimate: Estimate, name: str, value: float) -> dict[str, float]:
    """Values of the fields with one at the end of its interval, and those fitted along as it goes there."""
    k = estimate.names.index(name)
    shares = estimate.covariance[k] / (estimate.covariance[k, k] or 1.0)
    moved = estimate.value + shares * (value - estimate.value[k])
    return dict(zip(estimate.names, moved.tolist(), strict=True)) | {name: value}


def _updated(problem: Problem, estimate: Estimate, middle: dict[str, float]) -> float:
    return _best(problem.updated(estimate), middle).cost


def _best(problem: Problem, middle: dict[str, float]) -> Point:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        point: Point = plan(problem).at(**middle)
    return point
