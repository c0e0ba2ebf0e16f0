"""A problem as text, and back: a built-in one by its numbers, one's own by its expressions."""

import json
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca

from sdpgrind.base import stored
from sdpgrind.locus._problem.problem import Problem, Varying
from sdpgrind.locus._problem.system import system_of


@dataclass(frozen=True)
class Expression:
    """One of the functions of a problem that was written down: the k-th output of a function of CasADi."""

    text: str = field(repr=False)
    k: int
    names: tuple[str, ...]
    hidden: tuple[str, ...]

    def __call__(self, s: Any, c: Any) -> Any:
        """Its value, of hidden states and controls."""
        given = [[getattr(c, name) for name in self.names], [getattr(s, name) for name in self.hidden]]
        return _function(self.text)(*(ca.vertcat(*values) for values in given))[self.k]


@lru_cache
def _function(text: str) -> Any:
    return ca.Function.deserialize(text)


def written(problem: Problem) -> str:
    """The problem as text."""
    if problem.model is not None:
        return stored.encode(problem)
    ranges = {"controls": dict(problem.controls), "hidden": dict(problem.hidden), "units": dict(problem.units)}
    named = [[one.name, one.unit] for one in problem.varying]
    return json.dumps({"function": system_of(problem).function.serialize(), "constraints": named, **ranges})


def read_problem(text: str) -> Problem:
    """The problem that `written` told of."""
    known = json.loads(text)
    if "function" not in known:
        problem: Problem = stored.decode(text)
        return problem
    ranges = {key: {name: tuple(ends) for name, ends in known[key].items()} for key in ("controls", "hidden")}
    names, m = (tuple(ranges["controls"]), tuple(ranges["hidden"])), len(known["constraints"])
    cost, *rest = (Expression(known["function"], k, *names) for k in range(1 + 2 * m))
    constraints = [
        Varying(response=rest[j], limit=rest[m + j], name=name, unit=unit) for j, (name, unit) in enumerate(known["constraints"])
    ]
    return Problem(**ranges, cost=cost, constraints=constraints, units=known["units"])
