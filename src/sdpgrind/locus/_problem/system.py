"""Cost and constraints of a problem as expressions with exact derivatives, in compiled tapes."""

import math
import warnings
from collections.abc import Sequence
from functools import cache, cached_property
from types import SimpleNamespace
from typing import Any, Protocol

import casadi as ca
import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.process import Function, Ranges, Varying
from sdpgrind.locus._problem.tape import tape
from sdpgrind.locus._problem.tape_kernels import run_many

# chosen: starts and samples for scales, scaled; denser at the ends, where optima are frequent
SPREAD = (0.003, 0.03, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97, 0.997)
# chosen: lattice points per control, by their number; 3 beyond. Less: optima missed
TICKS = {1: 11, 2: 11, 3: 7, 4: 5}

MADE = "_systems"
"""Attribute of a problem that caches its systems."""
KINKED = {
    ca.OP_FABS: "abs",
    ca.OP_FMIN: "minimum",
    ca.OP_FMAX: "maximum",
    ca.OP_LT: "a comparison",
    ca.OP_LE: "a comparison",
    ca.OP_EQ: "a comparison",
    ca.OP_NE: "a comparison",
    ca.OP_IF_ELSE_ZERO: "a choice (where, interp)",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_SIGN: "sign",
    ca.OP_COPYSIGN: "copysign",
    ca.OP_FMOD: "a remainder",
    ca.OP_REMAINDER: "a remainder",
}
"""Operations that are not smooth, with their names for users."""
TIE = 1e-6  # chosen: weight of the summed slacks; more would raise the cost


class Stated(Protocol):
    """Problem as seen by its system: names, ranges, cost and constraints; see `Problem`."""

    @property
    def controls(self) -> Ranges: ...
    @property
    def hidden(self) -> Ranges: ...
    @property
    def names(self) -> Sequence[str]: ...
    @property
    def hidden_names(self) -> Sequence[str]: ...
    @property
    def responses(self) -> tuple[str, ...]: ...
    @property
    def varying(self) -> Sequence[Varying]: ...
    @property
    def objective(self) -> Function: ...


@cache
def starts_of(n: int) -> Floats:
    """Return the scaled lattice (k, n) of starts for n controls."""
    ticks = np.asarray(SPREAD)[np.linspace(0, len(SPREAD) - 1, TICKS.get(n, 3)).round().astype(int)]
    return np.stack(np.meshgrid(*[ticks] * n, indexing="ij"), axis=-1).reshape(-1, n)


def system_of(problem: Stated, tie: bool = False) -> "System":
    """Return the cached `System` of a problem."""
    made: dict[bool, System] = problem.__dict__.setdefault(MADE, {})
    if tie not in made:
        made[tie] = System(problem, tie)
    return made[tie]


class System:
    """Tapes of a problem, in the user's units and scaled: ranges to 0..1, logarithmically where positive.

    `value_tape`: controls and hidden states to cost, responses, limits. `response_tape`: to responses and
    their slopes by the hidden states, row by row. `kkt_tape`, scaled: input of `kkt_kernels`, in its order.
    `tie` selects the largest slack among several optima.
    """

    def __init__(self, problem: Stated, tie: bool = False):
        ranges = np.array([*problem.controls.values(), *problem.hidden.values()], dtype=float)
        self.responses = problem.responses
        self.n, self.h, self.m = len(problem.controls), len(problem.hidden), len(problem.varying)
        self.low, self.high = ranges.T.copy()
        self.logarithmic = self.low > 0
        z, x = ca.SX.sym("z", self.n), ca.SX.sym("x", self.h)
        states = SimpleNamespace(**dict(zip(problem.hidden_names, ca.vertsplit(x), strict=True)))
        controls = SimpleNamespace(**dict(zip(problem.names, ca.vertsplit(z), strict=True)))
        self._z, self._x = z, x
        self._cost = _expression("cost", problem.objective, states, controls)
        pairs = [(one.response, one.limit) for one in problem.varying]
        self._response = ca.vertcat(
            *(
                _expression(f"constraints[{j}].response", f, states, controls)
                for j, (f, _) in enumerate(pairs)
            )
        )
        self._limit = ca.vertcat(
            *(_expression(f"constraints[{j}].limit", f, states, controls) for j, (_, f) in enumerate(pairs))
        )
        self.value_tape = self._tape(self._cost, self._response, self._limit)
        self.response_tape = self._tape(self._response, ca.vec(ca.jacobian(self._response, x).T))
        self.cost_scale, self.scales = self._scales()
        self.kkt_tape, self.first_tape = self._scaled_tapes(TIE if tie else 0.0)

    def _tape(self, *outputs: Any) -> Floats:
        return tape(ca.Function("f", [self._z, self._x], [ca.densify(ca.vertcat(*outputs))]))

    def values(self, controls: Any, hidden: Any) -> tuple[Floats, Floats, Floats]:
        """Return cost (...), responses and limits (..., m) of controls (..., n), hidden states (..., h)."""
        z, x = np.asarray(controls, dtype=float), np.asarray(hidden, dtype=float)
        shape = np.broadcast_shapes(z.shape[:-1], x.shape[:-1])
        inputs = np.concatenate(
            [np.broadcast_to(z, (*shape, self.n)), np.broadcast_to(x, (*shape, self.h))], axis=-1
        )
        cost, response, limit = self.values_of(inputs.reshape(-1, self.n + self.h))
        return cost.reshape(shape), response.reshape(*shape, self.m), limit.reshape(*shape, self.m)

    def values_of(self, inputs: Floats) -> tuple[Floats, Floats, Floats]:
        """Return cost (k,), responses and limits (k, m) of rows of controls and hidden states (k, n + h)."""
        out = np.empty((len(inputs), 1 + 2 * self.m))
        run_many(self.value_tape, inputs, out)
        return out[:, 0], out[:, 1 : 1 + self.m], out[:, 1 + self.m :]

    @property
    def function(self) -> Any:
        """Cost, responses and limits as one CasADi function."""
        return ca.Function("f", [self._z, self._x], [ca.vertcat(self._cost, self._response, self._limit)])

    def slopes(self, controls: Floats, hidden: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return slopes (k, m) of responses and limits along directions (k, n), at fixed hidden states."""
        out = np.empty((len(controls), 2 * self.m))
        run_many(self._slope_tape, np.hstack([controls, hidden, direction]), out)
        return out[:, : self.m], out[:, self.m :]

    @cached_property
    def _slope_tape(self) -> Floats:
        direction = ca.SX.sym("d", self.n)
        slopes = [ca.jtimes(f, self._z, direction) for f in (self._response, self._limit)]
        return tape(ca.Function("f", [self._z, self._x, direction], [ca.densify(ca.vertcat(*slopes))]))

    @property
    def limit_varies(self) -> bool:
        """Whether a limit depends on a hidden state."""
        return bool(ca.depends_on(self._limit, self._x))

    def _ends(self, values: Floats, first: int) -> tuple[Floats, Floats, Any]:
        """Return the ranges of columns from index `first` on, and whether they are logarithmic."""
        part = slice(first, first + values.shape[-1])
        return self.low[part], self.high[part], self.logarithmic[part]

    def scaled(self, values: Any, first: int = 0) -> Floats:
        """Scale values (..., k) of controls, or from index `first` on of hidden states, to 0..1."""
        x = np.asarray(values, dtype=float)
        low, high, logarithmic = self._ends(x, first)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(x / low) / np.log(high / low)
        places: Floats = np.where(logarithmic, ratio, (x - low) / (high - low))
        return places

    def unscaled(self, places: Any, first: int = 0) -> Floats:
        """Return the values of scaled places (..., k); inverse of `scaled`."""
        q = np.asarray(places, dtype=float)
        low, high, logarithmic = self._ends(q, first)
        grown = low * self._ratio[first : first + q.shape[-1]] ** q
        values: Floats = np.where(logarithmic, grown, low + q * (high - low))
        return values

    def unscaled_slope(self, places: Any, first: int = 0) -> Floats:
        """Return the slopes (..., k) of the values by the places."""
        q = np.asarray(places, dtype=float)
        low, high, logarithmic = self._ends(q, first)
        safe = np.where(logarithmic, low, 1.0)
        grow = np.log(np.where(logarithmic, high, math.e) / safe)
        slopes: Floats = np.where(logarithmic, self.unscaled(q, first) * grow, high - low)
        return slopes

    def stretch(self, values: Floats) -> Floats:
        """Return the slopes (..., n + h) of all values by their places, at these values."""
        return np.where(self.logarithmic, values * self._growth, self.high - self.low)

    @cached_property
    def _growth(self) -> Floats:
        """Logarithm of greatest over least value; 0 for linear scales."""
        growth: Floats = np.log(self._ratio)
        return growth

    @cached_property
    def _ratio(self) -> Floats:
        """Greatest over least value; 1 for linear scales."""
        return np.where(self.logarithmic, self.high, 1.0) / np.where(self.logarithmic, self.low, 1.0)

    def lattice(self, places: int) -> Floats:
        """Return a scaled lattice (k, n + h) over controls and hidden states."""
        ticks = np.asarray(SPREAD)[np.linspace(0, len(SPREAD) - 1, places).round().astype(int)]
        return np.stack(np.meshgrid(*[ticks] * (self.n + self.h), indexing="ij"), axis=-1).reshape(
            -1, self.n + self.h
        )

    def on_lattice(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return a scaled lattice with cost, responses and limits."""
        total = self.n + self.h
        points = self.lattice(max(3, min(11, int(2000 ** (1 / total)))))
        values = self.unscaled(points)
        return points, *self.values(values[:, : self.n], values[:, self.n :])

    def _scales(self) -> tuple[float, Floats]:
        """Return the spreads of cost and slacks (m,) over the ranges."""
        _, cost, response, limit = self.on_lattice()
        return _spread("cost", cost), np.array(
            [_spread(f"constraints[{j}]", e) for j, e in enumerate((response - limit).T)]
        )

    def response_slopes(self) -> Floats:
        """Return finite slopes (k, m) of the responses by the first hidden state over a lattice."""
        points, out = self.unscaled(self.lattice(5)), np.empty((len(self.lattice(5)), self.m * (1 + self.h)))
        run_many(self.response_tape, points, out)
        slopes: Floats = out[np.all(np.isfinite(out), axis=1), self.m :: self.h]
        return slopes

    @cached_property
    def slopes_by_hidden(self) -> Floats:
        """Slopes (k, m, h) of the constraints by the hidden states over a lattice."""
        points = self.lattice(5)
        slopes = np.empty((len(points), self.m * self.h))
        by_hidden = ca.jacobian(self._response - self._limit, self._x)
        run_many(self._tape(ca.vec(by_hidden.T)), self.unscaled(points), slopes)
        return slopes.reshape(-1, self.m, self.h)

    def _scaled_tapes(self, tie: float) -> tuple[Floats, Floats]:
        n, h = self.n, self.h
        y = ca.SX.sym("y", n + h)
        values = [_unscaled(y[k], self.low[k], self.high[k], self.logarithmic[k]) for k in range(n + h)]
        given = [ca.vertcat(*values[:n]), ca.vertcat(*values[n:])]
        whole = ca.Function("f", [self._z, self._x], [self._cost, self._response - self._limit])
        cost, slack = whole(*given)
        slack = slack / ca.DM(self.scales)
        cost = cost / self.cost_scale + tie * ca.sum1(slack)
        parts = [cost, slack, *_by_controls([cost, *ca.vertsplit(slack)], y[:n], y[n:])]
        whole_tape, first_tape = (
            tape(ca.Function("f", [y], [ca.densify(ca.vertcat(*out))])) for out in (parts, parts[:2])
        )
        return whole_tape, first_tape


def _by_controls(functions: list[Any], q: Any, p: Any) -> list[Any]:
    """Return gradients, Hessians, mixed derivatives and slopes by hidden states, function by function."""
    gradients = [ca.gradient(f, q) for f in functions]
    hessians = [ca.vec(ca.hessian(f, q)[0]) for f in functions]
    mixed = [ca.vec(ca.jacobian(g, p).T) for g in gradients]
    slopes = [ca.vec(ca.jacobian(f, p)) for f in functions]
    return [*gradients, *hessians, *mixed, *slopes]


def _unscaled(place: Any, low: float, high: float, logarithmic: bool) -> Any:
    return low * ca.exp(place * np.log(high / low)) if logarithmic else low + place * (high - low)


def _expression(name: str, function: Function, states: SimpleNamespace, controls: SimpleNamespace) -> Any:
    """Return the expression of a user's function."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # of numpy functions on symbols
        try:
            found = function(states, controls)
        except AttributeError as error:
            known = ", ".join([*vars(states), *vars(controls)])
            raise ValueError(
                f"{name} must use names of hidden states and controls, {known}; got {error.name!r}"
            ) from None
        except Exception as error:
            raise ValueError(
                f"{name} must be made of operators, ** and functions that take symbols; {error}"
            ) from error
    try:
        value = ca.SX(found)
    except (RuntimeError, TypeError):
        raise TypeError(f"{name} must give a number for each point; got {type(found).__name__}") from None
    if value.shape != (1, 1):
        raise ValueError(f"{name} must give one number for each point; got shape {value.shape}")
    _check_smooth(name, value)
    return value


def _check_smooth(name: str, value: Any) -> None:
    """Refuse kinks and steps: optima there would be missed."""
    function = ca.Function("f", ca.symvar(value), [value])
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    bad = sorted(told for operation, told in KINKED.items() if operation in used)
    if bad:
        raise ValueError(
            f"{name} must be smooth, for its slopes are followed; it has {', '.join(bad)}: take a smooth"
            " form, a polynomial or a spline of powers, or split the range"
        )


def _spread(name: str, values: Floats) -> float:
    """Return the spread of finite values between their deciles; their size, at least 1, where it is 0."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        raise ValueError(
            f"{name} must be finite somewhere in the ranges of controls and hidden states; it is nowhere:"
            " functions of math do not take symbols, ** and those of numpy do"
        )
    low, high = np.quantile(finite, (0.1, 0.9))
    return float(high - low) if high > low else max(1.0, abs(float(high)))
