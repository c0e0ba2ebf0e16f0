"""Where no point keeps all constraints: the point that comes nearest to it, and what would do, in words."""

import math
from typing import Any

import numpy as np
from scipy.optimize import minimize

from sdpgrind.base.brief import listed
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.rows import numbers
from sdpgrind.base.doubts.words import amount
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System, system_of

_POINTS = 4000  # chosen: about so many of a lattice, a millisecond of work
_DIGITS = 3  # chosen: of an excess, and of a number that would do
_ROUNDS = 20  # chosen: Dinkelbach's steps, which double the digits; some five are taken
_STEP = 1e-3  # chosen: relative change of a number; limits are linear in theirs


def nearest(problem: Problem, system: System) -> str:
    """Sentence part on the constraint that the nearest point does not keep; empty: a point keeps all."""
    values, excess = _nearest(system)
    return _told(problem, system, values) if np.isfinite(excess) and excess > 0 else ""


def _nearest(system: System) -> tuple[Floats, float]:
    """Controls and hidden states (1, n + h) of the least excess, and that; inf: no law has a value."""
    total = system.n + system.h
    ticks = np.linspace(0.0, 1.0, max(3, round(_POINTS ** (1 / total))))
    lattice = np.stack(np.meshgrid(*[ticks] * total, indexing="ij"), axis=-1).reshape(-1, total)
    each = _excess(system, lattice)
    begin, least = lattice[int(np.argmin(each))], float(np.min(each))
    if not np.isfinite(least):
        return system.unscaled(begin[np.newaxis]), least
    options: dict[str, Any] = {"method": "Nelder-Mead", "bounds": [(0.0, 1.0)] * total}
    found = minimize(lambda at: _excess(system, at)[0], begin, **options)
    best = found.x if found.fun < least else begin
    return system.unscaled(best[np.newaxis]), min(float(found.fun), least)


def _excess(system: System, places: Floats) -> Floats:
    """Greatest scaled excess over a limit at scaled places (k, n + h); inf: a law has no value."""
    _, response, limit = system.values_of(system.unscaled(np.atleast_2d(places)))
    worst = np.max((response - limit) / system.scales, axis=1)
    return np.where(np.isfinite(worst), worst, np.inf)


def _told(problem: Problem, system: System, values: Floats) -> str:
    _, (response,), (limit,) = system.values_of(values)
    worst = int(np.argmax((response - limit) / system.scales))
    name = system.responses[worst]
    above, bound = (
        amount(float(each), problem.unit(name), _DIGITS)
        for each in (response[worst] - limit[worst], limit[worst])
    )
    each = zip((*problem.names, *problem.hidden_names), values[0].tolist(), strict=True)
    where = listed([f"{key} = {amount(value, problem.unit(key), _DIGITS)}" for key, value in each])
    told = f"; nearest is {where}, where {name} is {above} above its limit of {bound}"
    return told + _would_do(problem, values, worst)


def _would_do(problem: Problem, values: Floats, worst: int) -> str:
    """Sentence part on the number of a limit that leaves a feasible point by the least change."""
    found = []
    for name, unit, value in numbers(problem.model) if problem.model is not None else []:
        needed = _needed(problem, values, worst, name, value)
        if needed is not None:
            found.append((abs(needed / value - 1), (name, unit, value, needed)))
    if not found:
        return ""
    _, (name, unit, value, needed) = min(found)
    return f"; {name} = {amount(_least(problem, worst, name, value, needed), unit, _DIGITS)} would do"


def _least(problem: Problem, worst: int, name: str, value: float, needed: float) -> float:
    """Least change of a number that does: with each that does, another point is the best."""
    for _ in range(_ROUNDS):
        changed = problem.replace(model=problem.model.replace(**{name: needed}))
        closer = _needed(problem, _nearest(system_of(changed))[0], worst, name, value)
        if closer is None or abs(closer - value) >= abs(needed - value):
            break
        needed = closer
    return needed


def _needed(problem: Problem, values: Floats, worst: int, name: str, value: float) -> float | None:
    """Value of a number that moves a limit alone, so that all constraints hold there; None: none does."""
    before, moved = (_with(problem, values, name, each) for each in (value, value * (1 + _STEP)))
    if before is None or moved is None or not np.array_equal(before[0], moved[0]):
        return None
    gained = moved[1][worst] - before[1][worst]
    if gained == 0.0:
        return None
    needed = _beyond(value + (before[0] - before[1])[worst] * value * _STEP / gained, value)
    after = _with(problem, values, name, needed)
    return needed if after is not None and np.all(after[0] <= after[1]) else None


def _with(problem: Problem, values: Floats, name: str, value: float) -> tuple[Floats, Floats] | None:
    """Responses and limits (m,) with a number of the model changed; None: no model has it."""
    try:
        changed = problem.replace(model=problem.model.replace(**{name: value}))
    except ValueError:
        return None
    _, (response,), (limit,) = system_of(changed).values_of(values)
    return response, limit


def _beyond(needed: float, value: float) -> float:
    """Number of few digits, by one of the last digit or more beyond the needed one: a point is no stretch."""
    unit = 10.0 ** (math.floor(math.log10(abs(needed) or 1.0)) + 1 - _DIGITS)
    further, rounded = (1, math.ceil) if needed > value else (-1, math.floor)
    return (rounded(needed / unit) + further) * unit
