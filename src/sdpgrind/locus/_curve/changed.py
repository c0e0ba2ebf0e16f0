"""Optima of a problem with margins from its limits, or with some controls kept."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.process import Function, Varying


@lru_cache(maxsize=8)  # the controllers of a series have the same margins
def tightened(area: Area, margins: tuple[tuple[str, float], ...]) -> Area:
    """Return the optima at distances from the limits, by name of the response, in its unit."""
    kept = {name: margin for name, margin in margins if margin}
    if not kept:
        return area
    constraints = [
        one.replace(limit=_less(one.limit, kept.get(one.name, 0.0))) for one in area.problem.varying
    ]
    found: Area = plan(_changed(area.problem, lambda function: function, constraints, {}))
    return found


def fixed(area: Area, values: Mapping[str, float]) -> Area:
    """Return the optima over the other controls, with those of `values` fixed, in their units."""
    return _fixed(area, tuple(values.items()))


@lru_cache(maxsize=8)  # what a part teaches is found with the controls that were held in it
def _fixed(area: Area, held: tuple[tuple[str, float], ...]) -> Area:
    values = dict(held)
    free = [name for name in area.names if name not in values]

    def of_free(function: Function) -> Function:
        return lambda s, c: function(s, SimpleNamespace(**{n: getattr(c, n) for n in free}, **values))

    constraints = [
        one.replace(response=of_free(one.response), limit=of_free(one.limit)) for one in area.problem.varying
    ]
    found: Area = plan(_changed(area.problem, of_free, constraints, values))
    return found


def _less(function: Function, margin: float) -> Function:
    def limit(s: Any, c: Any) -> Any:
        return function(s, c) - margin

    return limit


def _changed(
    problem: Problem,
    change: Callable[[Function], Function],
    constraints: list[Varying],
    fixed: Mapping[str, float],
) -> Problem:
    """Return the problem with other functions, and without the fixed controls."""
    controls = {name: ends for name, ends in problem.controls.items() if name not in fixed}
    return Problem(
        controls=controls,
        hidden=dict(problem.hidden),
        cost=change(problem.objective),
        constraints=constraints,
        units={name: problem.unit(name) for name in (*controls, *problem.hidden, "cost")},
    )
