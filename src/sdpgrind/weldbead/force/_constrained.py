"""Predictive controller: a linear law within limits, a quadratic program (OSQP) at them."""

from math import inf, isnan
from typing import Any, NoReturn, Self

import numpy as np
import osqp
import scipy.sparse

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.force._controller import ForceController
from sdpgrind.weldbead.force._limits import Limits
from sdpgrind.weldbead.force._predictive import Predictive
from sdpgrind.weldbead.force._reference import Trajectory

# N, chosen: error of force by which OSQP scales the cost. measured: 3 and 100 take up to 4 times as long
_TYPICAL = 10.0
_BIG = 1e20  # chosen: stands for no limit; OSQP takes 1e30 and more for infinite
_SLACK_WEIGHT = 1e3  # chosen: weight of missing contact force; errors of force weigh 1
# Code that OSQP generates does not polish, so neither does this; nothing depends on a clock or on earlier
# samples. chosen: iterations between looks at the error. measured: 479 programs of four loops at their limits
# need 375 to 500, their first moves are within 4e-9 N of those solved to 1e-12
_SETTINGS: Any = {
    "verbose": False,
    "eps_abs": 1e-9,
    "eps_rel": 1e-9,
    "check_termination": 500,
    "max_iter": 4000,
    "adaptive_rho": False,
    "rho": 0.01,
    "polishing": False,
}


class PredictiveController(ForceController):
    """Follows a pass plan by model predictive control with limits on command, its rate, and contact.

    The planned height is sent ahead as in `ForceController`; a quadratic program in the changes of the
    correction runs at each sample. Readings foreseen above `Limits.contact_force` are kept above it (softly).
    The law without limits is used as it is where it keeps them all, and within the limits of this sample
    where the program is not solved.

    Parameters
    ----------
    predictive : Predictive
        Weights, horizon and model (N, mm, s).
    plan, force_max, limits, datum
        Plan (s, N, mm) and its limits; see `ForceController`.

    Raises
    ------
    ValueError
        When the plan demands a negative force or more than `force_max` (N).

    Examples
    --------
    >>> import types
    >>> from sdpgrind.weldbead import force
    >>> plan = types.SimpleNamespace(time=[0.0, 1.0], normal_force=[30.0, 30.0], fly_height=[10.0, 10.0])
    >>> low = force.Limits(command_max=-10.0)
    >>> controller = force.PredictiveController(plan, force.Predictive(), limits=low)
    >>> round(controller.step(force=10.0)["platform_command"], 3)
    -10.0
    """

    _changing = (*ForceController._changing, "_estimate")

    def __init__(
        self,
        plan: Trajectory | None,
        predictive: Predictive,
        *,
        force_max: float | None = None,
        limits: Limits | None = None,
        datum: float = 0.0,
    ) -> None:
        self._predictive = checks.kind("predictive", predictive, Predictive)
        self._solver: Any = None
        self._solved = self._unsolved = 0
        super().__init__(plan, predictive.loop, force_max=force_max, limits=limits, datum=datum)

    @property
    def programs(self) -> tuple[int, int]:
        """Quadratic programs that were solved and that were not, a whole number each."""
        return self._solved, self._unsolved

    def __export__(self) -> NoReturn:
        """Refuse: the quadratic program (N, mm) is not exported; units do not matter."""
        raise TypeError("a PredictiveController is not exported: its quadratic program is solved by OSQP")

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_solver": None}

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = super().__deepcopy__(memo)
        twin._solver = None  # OSQP cannot be copied
        return twin

    def _restart(self) -> None:
        super()._restart()
        self._estimate = np.zeros(self._predictive.drifting.order)
        self._lost = 0

    def _command(self, force: float, demand: float, position: float, time: float) -> float:
        """Command of one sample, mm; the loop model's state is kept as in `ForceController`."""
        law, model, stiffness = self._predictive, self._loop.plant.sampled, self._loop.plant.contact_stiffness
        m = self._loop.law.system.order
        foreseen, rest = self._state[m : m + model.order], self._state[m + model.order :]
        wanted = float(law.scaled.C @ foreseen)
        lost = self._without_contact(force, wanted)
        held = stiffness * rest[0]
        if not (lost or isnan(force)):
            self._estimate += law.corrects * (force - wanted - float(law.drifting.C @ self._estimate))
        change = self._first_move(held, position, foreseen, time)
        command = (
            rest[1] + min(self._core.approach, self._core.rate)
            if lost
            else position + (held + change) / stiffness
        )
        command = self._within(command, rest[1])
        foreseen[:] = law.scaled.A @ foreseen + law.scaled.B * demand
        self._estimate = law.drifting.A @ self._estimate + law.drifting.B * stiffness * (command - position)
        rest[0], rest[1] = command - position, command
        return command

    def _without_contact(self, force: float, wanted: float) -> bool:
        limits = self._limits
        self._lost = self._lost + 1 if force < limits.contact_force < wanted else 0
        return self._lost >= limits.patience

    def _within(self, command: float, last: float) -> float:
        core = self._core
        if not isnan(last):
            command = min(max(command, last - core.rate), last + core.rate)
        return float(min(max(command, core.low), core.high))

    def _first_move(self, held: float, position: float, foreseen: Floats, time: float) -> float:
        """First change of the correction within limits over the horizon, N."""
        look = self._predictive.prediction
        base = look.free @ self._estimate + look.held * held
        moves = -look.gain @ base
        low, high, rows = self._bounds(held, position, foreseen, base, time)
        reached = rows @ np.append(moves, 0.0)
        if np.all(reached >= low - 1e-9) and np.all(reached <= high + 1e-9):
            return float(moves[0])
        found = self._solve(np.append(look.moves.T @ base, 0.0), low, high, rows, np.append(moves, 0.0))
        return float(found if found is not None else moves[0])

    def _bounds(
        self, held: float, position: float, foreseen: Floats, base: Floats, time: float
    ) -> tuple[Floats, Floats, Floats]:
        """Limits of command, rate, contact and slack over the horizon, N of the correction."""
        n, stiffness, core = self._predictive.horizon, self._loop.plant.contact_stiffness, self._core
        ahead = [self._ahead(time + k * self.period) for k in range(n)]
        planned = np.array([position, *(each[1] for each in ahead[1:])])
        command = stiffness * np.vstack([core.low - planned, core.high - planned]) - held
        correction, last = self._state[-4:-2]
        first = isnan(last)
        shift = stiffness * np.diff(planned, prepend=position if first else last - correction)
        room = inf if first else stiffness * core.rate
        free = self._forecast(foreseen, [each[0] for each in ahead])
        contact = np.where(free > self._limits.contact_force, self._limits.contact_force - free - base, -inf)
        low = np.concatenate([command[0], -room - shift, contact, [0.0]])
        high = np.concatenate([command[1], room - shift, np.full(n, inf), [inf]])
        return low, high, self._rows()

    def _forecast(self, foreseen: Floats, demands: list[float]) -> Floats:
        """Readings of the next samples if everything goes as planned, N."""
        model, state, out = self._predictive.scaled, foreseen, np.empty(len(demands))
        for k, demand in enumerate(demands):
            state = model.A @ state + model.B * demand
            out[k] = model.C @ state
        return out

    def _rows(self) -> Floats:
        n, moves = self._predictive.horizon, self._predictive.prediction.moves
        sums = np.hstack([np.tril(np.ones((n, n))), np.zeros((n, 1))])
        steps = np.hstack([np.eye(n), np.zeros((n, 1))])
        contact = np.hstack([moves, np.ones((n, 1))])
        return np.vstack([sums, steps, contact, np.eye(n + 1)[-1]])

    def _solve(self, linear: Floats, low: Floats, high: Floats, rows: Floats, guess: Floats) -> float | None:
        """First change of the program's solution, N; None: not solved."""
        if self._solver is None:
            self._solver = self._prepared(rows)
        self._solver.update(q=linear, l=np.maximum(low, -_BIG), u=np.minimum(high, _BIG))
        self._solver.warm_start(x=guess, y=np.zeros(len(low)))
        result = self._solver.solve(raise_error=False)
        if result.info.status_val != 1:
            self._unsolved += 1
            return None
        self._solved += 1
        return float(checks.number("x", float(result.x[0])))

    def _prepared(self, rows: Floats) -> Any:
        """Return a solver, scaled for `_TYPICAL` all along: no sample depends on which one came first."""
        n, size, look = self._predictive.horizon, len(rows), self._predictive.prediction
        hessian = np.zeros((n + 1, n + 1))
        hessian[:n, :n], hessian[n, n] = look.hessian, _SLACK_WEIGHT
        matrices = scipy.sparse.csc_matrix(np.triu(hessian)), scipy.sparse.csc_matrix(rows)
        solver = osqp.OSQP()
        linear = np.append(look.moves.T @ np.full(n, _TYPICAL), 0.0)
        free = {"q": linear, "l": np.full(size, -_BIG), "u": np.full(size, _BIG)}
        solver.setup(P=matrices[0], A=matrices[1], **free, **_SETTINGS)
        return solver
