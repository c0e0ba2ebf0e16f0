"""Models that disagree, each with its locus, evaluated at points off the locus."""

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.locus import Locus
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus._path.inverse import hidden_of
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.tape import tape
from sdpgrind.locus._problem.tape_kernels import run_many

WIDER = (3.0, 1.5)  # chosen: factors on the range of the hidden state; samples meet a point at other states
SOFT = 0.05  # chosen: relative width of the soft edges of the range; less is a kink of the locus
FAINT = 1e-9  # chosen: likelihood far beyond; 0 would leave no condition there


class Sample:
    """A model with its locus, evaluated at any controls."""

    def __init__(self, problem: Problem, curve: Locus, stretch: Stretch, x: tuple[float, float]):
        self.problem, self.curve, self.stretch, self.x = problem, curve, stretch, x

    def hidden(self, controls: Floats) -> Floats:
        """Return the hidden states X (k,) at which controls (k, 2) meet the limit."""
        limit = self.stretch.values(controls, np.full(len(controls), self.stretch.x[0]))[1]
        return hidden_of(
            self.stretch.values, controls, limit, self.curve.problem.hidden[self.stretch.hidden_name]
        )

    def condition(self, controls: Floats) -> Floats:
        """Return Q/|P_x|, weighted by likelihood, and its slopes by the two controls: (k, 3)."""
        out = np.empty((len(controls), 3))
        run_many(self._tape, np.column_stack([controls, self.hidden(controls)]), out)
        return out

    @cached_property
    def _tape(self) -> Floats:
        z, x = ca.SX.sym("z", 2), ca.SX.sym("x")
        cost, response, limit = ca.vertsplit(self.problem.system.function(z, x))
        P = response - limit
        (phi_u, phi_v), (P_u, P_v) = (ca.vertsplit(ca.gradient(f, z)) for f in (cost, P))
        P_x = ca.gradient(P, x)
        condition = _likely(x, *self.x) * (phi_u * P_v - phi_v * P_u) / ca.fabs(P_x)
        # x moves with z, on P = 0
        slopes = ca.gradient(condition, z) - ca.gradient(condition, x) * ca.gradient(P, z) / P_x
        return tape(ca.Function("f", [z, x], [ca.vertcat(condition, slopes)]))

    def loss(self, controls: Floats) -> Floats:
        """Return the cost (k,) above the optimum at the hidden states of controls.

        It is a difference of Lagrangians: errors of the table of optima enter squared.
        """
        x = np.clip(self.hidden(controls), *self.curve.range)
        best, multiplier = np.empty((len(x), 2)), np.empty(len(x))
        which = np.searchsorted([high for high, _, _ in self._optima[:-1]], x)
        for k, (_, spline, multipliers) in enumerate(self._optima):
            inside = which == k
            best[inside], multiplier[inside] = spline(x[inside]), np.interp(x[inside], spline.x, multipliers)
        return np.asarray(self._lagrangian(controls, x, multiplier) - self._lagrangian(best, x, multiplier))

    def _lagrangian(self, controls: Floats, x: Floats, multiplier: Floats) -> Floats:
        cost, response, limit = self.problem.system.values(controls, x[:, None])
        return np.asarray(cost + multiplier * (response - limit)[:, 0])

    @cached_property
    def _optima(self) -> list[tuple[float, Any, Floats]]:
        """Controls and multipliers of the optima by the hidden state, piece by piece."""
        found = []
        for piece in self.curve.best:
            table, (low, high) = piece.table, piece.range
            apart = np.all(np.isfinite(table.slope), axis=1)
            apart[1:] &= table.hidden[1:] > np.maximum.accumulate(table.hidden)[:-1] + 1e-9 * (high - low)
            if np.sum(apart) > 1:
                spline = CubicHermiteSpline(table.hidden[apart], table.controls[apart], table.slope[apart])
                found.append((high, spline, table.multipliers[apart, 0]))
        return found


def _likely(x: Any, low: float, high: float) -> Any:
    """Likelihood of a hidden state: 1 in its range with soft edges, so that the locus stays smooth."""
    beyond = ca.fmax(ca.fmax(low - x, x - high), 0) / (SOFT * (high - low))
    return ca.exp(-0.5 * beyond**2) + FAINT


def traced(problem: Problem, along: str, points: int) -> tuple[Locus, Stretch]:
    """Return locus and stretch of a sample over a widened range of its hidden state, if possible."""
    name = problem.hidden_names[0]
    low, high = problem.hidden[name]
    for factor in WIDER:
        room = 0.5 * (factor - 1) * (high - low)
        wider = (low / factor, high * factor) if low > 0 else (low - (room if low < 0 else 0.0), high + room)
        try:
            return _on(problem.replace(hidden={name: wider}), along, points)
        except ValueError:  # the model is invalid there, or its locus folds
            pass
    return _on(problem, along, points)


def _on(problem: Problem, along: str, points: int) -> tuple[Locus, Stretch]:
    curve = plan(problem, points=points)
    return curve, curve.stretch(along, _walkable(curve, 0.5 * sum(curve.problem.hidden[curve.hidden_name])))


def _walkable(curve: Locus, middle: float) -> tuple[float, float]:
    """Return the range around `middle` of adjacent pieces with an active constraint and free controls."""
    pieces = list(curve.best)
    free = [bool(piece.active) and not piece.bounds for piece in pieces]
    if not any(free):
        raise ValueError(
            "samples must have a locus on which the constraint is active and both controls are free;"
            f" got {curve}"
        )
    k = min(
        (k for k, good in enumerate(free) if good),
        key=lambda k: max(pieces[k].range[0] - middle, middle - pieces[k].range[1]),
    )
    first = last = k
    while first > 0 and free[first - 1] and pieces[first].start != "jump":
        first -= 1
    while last < len(pieces) - 1 and free[last + 1] and pieces[last].end != "jump":
        last += 1
    beyond = 1e-9 * (pieces[last].range[1] - pieces[first].range[0])  # beyond an inactive end
    low = beyond if first > 0 and not pieces[first - 1].active else 0.0
    high = beyond if last < len(pieces) - 1 and not pieces[last + 1].active else 0.0
    return pieces[first].range[0] - low, pieces[last].range[1] + high


def checked(samples: Any, along: str) -> tuple[Problem, ...]:
    given = tuple(
        checks.kind(f"samples[{k}]", one, Problem, " (see locus.preset)") for k, one in enumerate(samples)
    )
    if len(given) < 2:
        raise checks.refuse("samples", "two problems or more, that disagree", len(given))
    first = given[0]
    checks.one_of("along", along, first.names)
    for k, one in enumerate(given):
        if len(one.names) != 2 or len(one.hidden) != 1 or len(one.varying) != 1:
            raise ValueError(
                f"samples[{k}] must have two controls, one hidden state and one constraint; got {_told(one)}"
            )
        if dict(one.controls) != dict(first.controls) or one.hidden_names != first.hidden_names:
            raise ValueError(
                f"samples[{k}] must have controls and hidden state of samples[0], {_told(first)};"
                f" got {_told(one)}"
            )
    _check_limits(given)
    return given


def _check_limits(samples: tuple[Problem, ...]) -> None:
    """Refuse different limits: feedback needs a single computed one."""
    points = samples[0].system.unscaled(samples[0].system.lattice(5))
    limits = np.array([one.system.values(points[:, :2], points[:, 2:])[2][:, 0] for one in samples])
    apart = np.abs(limits - limits[0]) > 1e-9 * np.abs(limits[0])
    if np.any(apart & np.isfinite(limits)):
        k = int(np.flatnonzero(np.any(apart, axis=1))[0])
        raise ValueError(
            f"samples[{k}] must have the limit of samples[0], which is computed;"
            " models may differ in response and cost"
        )


def _told(problem: Problem) -> str:
    limits = ", ".join(f"{name} in {low:g}..{high:g}" for name, (low, high) in problem.controls.items())
    return f"{limits}; {', '.join(problem.hidden_names)}; {len(problem.varying)} constraints"


def shares(given: Any, count: int) -> Floats:
    if given is None:
        return np.full(count, 1 / count)
    weights = checks.finite_array("weights", given)
    if weights.shape != (count,) or np.any(weights < 0) or not np.sum(weights) > 0:
        raise checks.refuse("weights", f"{count} numbers >= 0, one for each sample, not all 0", given)
    return weights / np.sum(weights)


def declared_range(problem: Problem, x: Any) -> tuple[float, float]:
    name = problem.hidden_names[0]
    if np.shape(x) != (2,):
        raise checks.refuse("x", f"the least and the greatest {name}", x)
    low, high = (checks.number(f"x[{k}]", value, problem.unit(name)) for k, value in enumerate(x))
    if not low < high:
        raise checks.refuse(
            "x", f"the least and the greatest {name}, rising", (low, high), problem.unit(name)
        )
    return low, high
