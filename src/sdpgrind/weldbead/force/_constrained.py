"""Predictive controller: a linear law within limits, a quadratic program (OSQP) at them."""

from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.states import width
from sdpgrind.codegen import StepProgram
from sdpgrind.weldbead.force._controller import ForceController
from sdpgrind.weldbead.force._limits import Limits
from sdpgrind.weldbead.force._predictive import Predictive
from sdpgrind.weldbead.force._predictive_kernels import BEHIND, BIG, PredictiveCore, answer, ask
from sdpgrind.weldbead.force._reference import Trajectory

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

_LEAST = 0.01  # chosen: N, between limits; OSQP takes 1e-4 and less, scaled, for an equation
# N, chosen: error of force by which OSQP scales the cost. measured: 3 and 100 take up to 4 times as long
_TYPICAL = 10.0
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
        self._solved = self._unsolved = 0
        super().__init__(plan, predictive.loop, force_max=force_max, limits=limits, datum=datum)

    @property
    def programs(self) -> tuple[int, int]:
        """Quadratic programs that were solved and that were not, a whole number each."""
        return self._solved, self._unsolved

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes: a pass along the plan, and the program by OSQP's code."""
        from sdpgrind.weldbead.force._recipe import predictive_recipe

        if self._plan is None:
            raise checks.refuse("plan", "given at the start: set-points are not exported", None)
        core = self._core
        room = core.stiffness * min(core.high - core.low, 2.0 * core.rate)
        if room < _LEAST:
            rule = f"{_LEAST:g} N apart at least: narrower ones are equations to OSQP, but not in its C"
            raise checks.refuse("limits", rule, room, "N")
        return predictive_recipe(super().__export__(), self._predicts, self._program, len(self._estimate))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = super().__deepcopy__(memo)
        twin.__dict__.pop("_program", None)  # copies may run in threads: each has a solver of its own
        return twin

    def _restart(self) -> None:
        super()._restart()
        self._estimate = np.zeros(self._predictive.drifting.order)

    @cached_property
    def _predicts(self) -> PredictiveCore:
        """Constants of the sample, mm and N."""
        law, core = self._predictive, self._core
        model, drift, look = law.scaled, law.drifting, law.prediction
        return PredictiveCore(
            *(model.A, model.B, model.C, drift.A, drift.B, drift.C, law.corrects),
            *(look.free, look.held, look.moves, look.gain),
            *(
                core.stiffness,
                core.low,
                core.high,
                core.rate,
                core.contact,
                float(core.patience),
                core.approach,
            ),
        )

    def _command(self, force: float, demand: float, position: float, time: float) -> float:
        """Command of one sample, mm; the loop model's state is kept as in `ForceController`."""
        n, core = self._predictive.horizon, self._predicts
        ahead = np.array([self._ahead(time + k * self.period) for k in range(n)])
        room = np.zeros(self._program.width)
        demands, positions = np.ascontiguousarray(ahead.T)
        if ask(core, self._state, self._estimate, room, force, demands, positions):
            solved = self._program.solve(room)
            self._solved, self._unsolved = self._solved + solved, self._unsolved + (not solved)
        return float(answer(core, self._state, self._estimate, room))

    def _rows(self) -> Floats:
        n, moves = self._predictive.horizon, self._predictive.prediction.moves
        sums = np.hstack([np.tril(np.ones((n, n))), np.zeros((n, 1))])
        steps = np.hstack([np.eye(n), np.zeros((n, 1))])
        contact = np.hstack([moves, np.ones((n, 1))])
        return np.vstack([sums, steps, contact, np.eye(n + 1)[-1]])

    @cached_property
    def _program(self) -> StepProgram:
        """Program of a sample, scaled for errors of `_TYPICAL`."""
        n, look = self._predictive.horizon, self._predictive.prediction
        hessian = np.zeros((n + 1, n + 1))
        hessian[:n, :n], hessian[n, n] = look.hessian, _SLACK_WEIGHT
        linear = np.append(look.moves.T @ np.full(n, _TYPICAL), 0.0)
        return StepProgram(hessian, self._rows(), linear, _SETTINGS, BIG, width(BEHIND))
