"""Recursive Constraint Bounding of a cycle of three stages with several constraints."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.plunge._learn.readings import at_size, measured
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._stages.controller import StagedController
from sdpgrind.plunge._stages.program import CONSTRAINTS, SETTINGS, program
from sdpgrind.plunge._stages.solvers import SOLVED, QuadraticProgram, optimum

if TYPE_CHECKING:
    import cvxpy

BUFFERS: Mapping[str, float] = {"burned_layer": 0.003, "roundness": 6e-5, "grinding_power": 0.0}
CAPS: Mapping[str, float] = {"burned_layer": 0.02, "roundness": 5e-4, "grinding_power": 500.0}
RULES, METHODS = ("contracting", "printed"), ("qp", "nlp")


class ConstraintBounding:
    """Recursive Constraint Bounding of several constraints: the fastest three stages of a model within bounds that learn.

    Before each part the settings x of a `StagedController` are those of the model's least time T(x) with g_j(x) <= b_j: the
    burned layer (how much deeper the damage goes than the stock that is left, mm, at most 0), out-of-roundness (mm) and, with
    `power_max`, the greatest power (W). After it b_j moves by c (s_j - n_j), where s_j is what was measured to be left to
    limit j: what is left tends to the buffer n_j. At first b_j is what the model says of the settings of the first part, which
    have to be safe.

    This is constraint adaptation: it moves bounds and leaves the model as it is. Where it settles, s_j = n_j for all that is
    active, however wrong the model. That is the fastest cycle of the real machine only when as many constraints are active as
    there are settings. Otherwise settings are left over that the model chooses by its own slopes, and these are wrong: parts are
    good, but slower than need be. Correcting the slopes, too, is modifier adaptation: it needs trials about each setting, and
    is not done here. To say so: with all four settings free and two limits, one setting is left to the model.

    Parameters
    ----------
    power_max : float, optional
        Greatest power, W; it is not limited when left out.
    step : float or mapping
        Share c of what is left that is taken, 0 to 1, unit 1; also for each of "burned_layer", "roundness", "grinding_power".
    noise_buffer : mapping, optional
        What is to be left for noise, n: 0.003 mm of "burned_layer", 6e-5 mm of "roundness", 0 W of "grinding_power".
    cap : mapping, optional
        How far beyond its limit a bound may go, as the model may be too careful: 0.02 mm, 5e-4 mm, 500 W.
    rule : {"contracting", "printed"}
        Printed: c (s + n) while s > n, as in Dong, Danai and Malkin (2004), (9); where a limit was exceeded its last good
        bound comes back and its c is halved. Contracting takes all of s - n back then, as does printed where no bound was good.
    method : {"qp", "nlp"}
        The model's optimum by quadratic programs about the last one (`statement`, OSQP), or by IPOPT (CasADi).
    settings : iterable of str, optional
        Which may move, of "rough_rate", "stage_rate", "final_rate" (mm/s) and "stage_remaining" (mm); all when left out.

    Raises
    ------
    ValueError
        When a value is out of range, or a name is not known.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> safe = plunge.StagedController(problem.replace(wear_flat_area=0.0234), stage_remaining=0.12, stage_rate=0.006)  # mm, mm/s
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), safe, parts=6, adapt=plunge.ConstraintBounding(step=0.5))
    >>> bool(log.outcome.time[-1] < 0.85 * log.outcome.time[0]), int(log.outcome.burned.sum())
    (True, 0)
    """

    def __init__(
        self,
        *,
        power_max: float | None = None,
        step: float | Mapping[str, float] = 0.25,
        noise_buffer: Mapping[str, float] | None = None,
        cap: Mapping[str, float] | None = None,
        rule: str = "contracting",
        method: str = "qp",
        settings: Iterable[str] = SETTINGS,
    ) -> None:
        self.power_max = None if power_max is None else checks.positive("power_max", power_max, "W")
        self.step = _steps(step)
        self.noise_buffer = _amounts("noise_buffer", noise_buffer, BUFFERS)
        self.cap = _amounts("cap", cap, CAPS)
        self.rule = checks.one_of("rule", rule, RULES)
        self.method = checks.one_of("method", method, METHODS)
        self.settings = checks.unique(
            "settings", [checks.one_of("settings", name, SETTINGS) for name in settings]
        )
        self._bounds: dict[str, float] = {}
        self._good: dict[str, float] = {}
        self._left: dict[str, float] = {}
        self._message = "no part yet"
        self._program: QuadraticProgram | None = None

    @property
    def bounds(self) -> dict[str, float]:
        """Bounds b of the model now, mm and W; none before the first part."""
        return dict(self._bounds)

    @property
    def left(self) -> dict[str, float]:
        """What the last part left to each limit, s, mm and W."""
        return dict(self._left)

    @property
    def status(self) -> str:
        """What the last optimum came to, in words (dimensionless): "solved", or that there is none and the settings stayed."""
        return self._message

    @property
    def statement(self) -> "cvxpy.Problem":
        """The first quadratic program of the last part as it is read, in cvxpy: a step of the settings, scaled (dimensionless).

        Raises ValueError before the first part, and with ``method="nlp"``.
        """
        if self._program is None:
            raise ValueError(
                "statement must be asked for after a part, with method='qp': there is no program yet"
            )
        return self._program.statement()

    def next(self, controller: StagedController, part_log: Any) -> StagedController:
        """Return the controller of the next part, with other settings (mm/s, mm).

        Parameters
        ----------
        controller : StagedController
            That of the last part, as it began.
        part_log : Log
            Of the last part, with the out-of-roundness that was measured after it.
        """
        checks.kind("controller", controller, StagedController, " to be adapted")
        if not at_size(part_log):
            self._message = "the part was broken off before it came to size: nothing is learned"
            return controller
        now = {name: float(getattr(controller, name)) for name in SETTINGS}
        self._learn(controller.problem, now, measured(part_log, controller))
        found = optimum(
            controller.problem, now, bounds=self._bounds, moving=self.settings, method=self.method
        )
        self._message, self._program = found.message, found.first
        if found.message != SOLVED:
            self._message = f"no setting is within the bounds, the last stays: {found.message}"
            return controller
        return controller.replace(**found.settings)

    def _learn(self, problem: CycleProblem, now: Mapping[str, float], seen: Mapping[str, float]) -> None:
        limits, foreseen = self._limits(problem), program(problem)
        reached = foreseen.reached(foreseen.at(now))[1]
        for name, limit in limits.items():
            self._left[name] = limit - seen[name]
            bound = min(self._bounds.get(name, limit), reached[name])  # what was not tried teaches nothing
            if np.isfinite(seen[name]):
                bound = self._moved(name, bound, self._left[name])
            self._bounds[name] = min(bound, limit + self.cap[name])

    def _limits(self, problem: CycleProblem) -> dict[str, float]:
        limits = {"burned_layer": 0.0} if program(problem).burns else {}
        limits["roundness"] = float(problem.roundness_max)
        return limits if self.power_max is None else {**limits, "grinding_power": self.power_max}

    def _moved(self, name: str, bound: float, left: float) -> float:
        """The next bound; a limit that was exceeded is stepped back from."""
        buffer = self.noise_buffer[name]
        if left >= 0:
            self._good[name] = bound
            return moved(bound, left, step=self.step[name], buffer=buffer, rule=self.rule)
        back = moved(bound, left, step=1.0, buffer=buffer, rule="contracting")
        if self.rule == "contracting":
            return back
        self.step[name] /= 2
        good = self._good.get(name, bound)
        return good if good < bound else back


def moved(bound: float, left: float, *, step: float, buffer: float, rule: str) -> float:
    """(9) of a bound: as printed it stays once no more than the buffer is left."""
    if rule == "printed":
        return bound + step * (left + buffer) if left > buffer else bound
    return bound + step * (left - buffer)


def _steps(step: float | Mapping[str, float]) -> dict[str, float]:
    given = dict(step) if isinstance(step, Mapping) else dict.fromkeys(CONSTRAINTS, step)
    for name in given:
        checks.one_of("step", name, CONSTRAINTS)
    return {name: checks.within("step", given.get(name, 0.25), 0.0, 1.0) for name in CONSTRAINTS}


def _amounts(what: str, given: Mapping[str, float] | None, usual: Mapping[str, float]) -> dict[str, float]:
    if given is not None and not isinstance(given, Mapping):
        raise TypeError(
            f"{what} must be a mapping of {', '.join(CONSTRAINTS)} to amounts (mm, W); got {checks.shown(given)}"
        )
    for name in given or {}:
        checks.one_of(what, name, CONSTRAINTS)
    amounts = {**usual, **(given or {})}
    return {
        name: checks.nonnegative(f"{what}[{name!r}]", value, CONSTRAINTS[name])
        for name, value in amounts.items()
    }
