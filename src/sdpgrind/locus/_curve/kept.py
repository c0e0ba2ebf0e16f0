"""A problem with some controls kept at given values."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.process import Function, Varying


def kept(problem: Problem, values: Mapping[str, float]) -> Problem:
    """Return the problem over the other controls, with those of `values` fixed, in their units."""
    free = {name: ends for name, ends in problem.controls.items() if name not in values}

    def of_free(function: Function) -> Function:
        def fixed(s: Any, c: Any) -> Any:
            return function(s, SimpleNamespace(**{name: getattr(c, name) for name in free}, **values))

        return fixed

    constraints = [
        Varying(response=of_free(one.response), limit=of_free(one.limit), name=one.name, unit=one.unit)
        for one in problem.varying
    ]
    return Problem(
        controls=free,
        hidden=dict(problem.hidden),
        cost=of_free(problem.objective),
        constraints=constraints,
        units={name: problem.unit(name) for name in (*free, *problem.hidden, "cost")},
    )
