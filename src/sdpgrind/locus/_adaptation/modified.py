"""The corrected model of modifier adaptation: bias and gradient modifiers as hidden states."""

from functools import cached_property
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._adaptation.modifier_kernels import resettle
from sdpgrind.locus._curve.inversion_kernels import find_state
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.process import Varying
from sdpgrind.locus._problem.system import System
from sdpgrind.locus._problem.tape import tape
from sdpgrind.locus._problem.tape_kernels import run, work_size
from sdpgrind.locus._trace.trace import Tracer

SMALL = 1e-3  # chosen: ranges of modifiers over the spread of cost and constraint; they set the scaling only


class Modified:
    """A problem with one hidden state and one constraint, extended by modifiers.

    Its hidden states (2 + 2n,): that of the model, constraint bias, constraint gradient (n), cost gradient
    (n).
    """

    def __init__(self, problem: Problem):
        self.problem, self.model = problem, problem.system
        self.n = self.model.n
        self.system = System(_with_modifiers(problem))
        self.point = np.zeros(self.n + 3)
        self.held = np.zeros(self.n + 1, dtype=np.int64)
        self._out, self._work = np.empty(2), np.empty(work_size(self.model.response_tape))
        self._inputs = np.empty(self.n + 1)

    @cached_property
    def _slope_tape(self) -> Floats:
        z, x = ca.SX.sym("z", self.n), ca.SX.sym("x")
        cost, response, limit = ca.vertsplit(self.model.function(z, x))
        parts = [response - limit, cost, ca.gradient(response - limit, z)]
        return tape(ca.Function("f", [z, x], [ca.densify(ca.vertcat(*parts))]))

    def values(self, controls: Floats, x: float) -> tuple[float, float, Floats]:
        """Return P = response - limit, cost, and the gradient (n,) of P by the controls, of the model."""
        out = np.empty(2 + self.n)
        run(self._slope_tape, np.append(controls, x), np.empty(work_size(self._slope_tape)), out)
        return float(out[0]), float(out[1]), out[2:]

    @property
    def active(self) -> bool:
        """Whether the constraint is active at the last optimum."""
        return bool(self.held[self.n] == 1)

    def limit(self, controls: Floats) -> float:
        """Return the limit P_b at controls (n,)."""
        return float(self.model.values(controls, self.middle)[2][0])

    @cached_property
    def middle(self) -> Floats:
        """Middle of the range of the hidden state (1,); the limit is independent of it."""
        return np.array([0.5 * sum(ends) for ends in self.problem.hidden.values()])

    def hidden_of(self, controls: Floats, response: float) -> float:
        """Return the hidden state that explains a response at controls (n,), clamped to its range."""
        (low, high), inputs = next(iter(self.problem.hidden.values())), self._inputs
        inputs[: self.n], inputs[self.n] = controls, 0.5 * (low + high)
        run(self.model.response_tape, inputs, self._work, self._out)
        sign = np.sign(self._out[1])
        find_state(
            self.model.response_tape, inputs, (self.n, 0, 1), low, high, sign, response, self._work, self._out
        )
        return float(inputs[self.n])

    def begin(self, modifiers: Floats) -> bool:
        """Search the optimum globally; return whether one exists."""
        places = self.system.scaled(modifiers, self.n)
        found = list(Tracer(self.system, places).seeds(float(places[0])))
        if not found:
            return False
        costs = [
            float(self.system.values(self.system.unscaled(point[: self.n]), modifiers)[0])
            for point, _ in found
        ]
        point, held = found[int(np.argmin(costs))]
        self.point[:], self.held[:] = point, held
        return True

    def best(self, modifiers: Floats) -> Floats | None:
        """Return the scaled optimal controls (n,), by continuation from the last ones; None: no optimum."""
        places, n = self.system.scaled(modifiers, self.n), self.n
        point, held = self.point.copy(), self.held.copy()
        if resettle(self.system.kkt_tape, n, 1, 2 + 2 * n, places, point, held) > 0:
            self.point, self.held = point, held
        elif not self.begin(modifiers):
            return None
        return self.point[:n].copy()


def _with_modifiers(problem: Problem) -> Problem:
    system, names = problem.system, problem.names
    cost, slack = SMALL * system.cost_scale, SMALL * float(system.scales[0])
    widths = [high - low for low, high in problem.controls.values()]
    hidden = dict(problem.hidden) | {"_bias": (-slack, slack)}
    hidden |= {
        f"_p_{name}": (-slack / width, slack / width) for name, width in zip(names, widths, strict=True)
    }
    hidden |= {f"_q_{name}": (-cost / width, cost / width) for name, width in zip(names, widths, strict=True)}
    (one,) = problem.varying

    def response(s: SimpleNamespace, c: SimpleNamespace) -> Any:
        return (
            one.response(s, c) + s._bias + sum(getattr(s, f"_p_{name}") * getattr(c, name) for name in names)
        )

    def tilted(s: SimpleNamespace, c: SimpleNamespace) -> Any:
        return problem.objective(s, c) + sum(getattr(s, f"_q_{name}") * getattr(c, name) for name in names)

    varying = Varying(response=response, limit=one.limit, name=one.name, unit=one.unit)
    return Problem(controls=problem.controls, hidden=hidden, cost=tilted, constraints=[varying])
