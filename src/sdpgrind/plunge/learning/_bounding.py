"""Recursive Constraint Bounding of several constraints in a cycle of three stages."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._stages.controller import StagedController
from sdpgrind.plunge._stages.program import CONSTRAINTS, SETTINGS, program
from sdpgrind.plunge._stages.solvers import SOLVED, QuadraticProgram, optimum
from sdpgrind.plunge.learning._readings import at_size, measured

if TYPE_CHECKING:
    import cvxpy

# chosen: the buffers cover the noise of the preset's gauges; greater caps trust a cautious model less
BUFFERS: Mapping[str, float] = {"burned_layer": 0.003, "roundness": 6e-5, "grinding_power": 0.0}
CAPS: Mapping[str, float] = {"burned_layer": 0.02, "roundness": 5e-4, "grinding_power": 500.0}
RULES, METHODS = ("contracting", "printed"), ("qp", "nlp")


class ConstraintBounding:
    """Recursive Constraint Bounding: the fastest three stages of a model in bounds learned from part to part.

    Before each part the settings x of a `StagedController` minimise the model's time T(x) subject to g_j(x)
    <= b_j: burned layer (damage deeper than the remaining stock, mm, at most 0), out-of-roundness (mm) and,
    with `power_max`, greatest power (W). After it b_j moves by c (s_j - n_j), where s_j is the measured
    distance to limit j; s_j tends to the buffer n_j. At first b_j is the model's value at the settings of the
    first part, which must be safe.

    This is constraint adaptation: the bounds move, the model stays. At its fixed point s_j = n_j for all
    active constraints, however wrong the model. The cycle is the fastest of the real machine only with as
    many active constraints as settings; any further setting follows the model's slopes, which are wrong:
    parts are good, but slower than possible. With all four settings free and two limits, one setting is left
    to the model. Modifier adaptation would correct the slopes by trials about each setting, and is not done
    here.

    Parameters
    ----------
    power_max : float, optional
        Greatest power, W. None: no limit.
    step : float or mapping
        Share c in 0..1, unit 1; one for all, or each of "burned_layer", "roundness", "grinding_power".
    noise_buffer : mapping, optional
        Distance n to each limit kept for noise. Default: 0.003 mm of "burned_layer", 6e-5 mm of "roundness",
        0 W of "grinding_power".
    cap : mapping, optional
        Greatest excess of a bound over its limit, for a model that is too cautious. Default: 0.02 mm, 5e-4
        mm, 500 W.
    rule : {"contracting", "printed"}
        Printed: c (s + n) while s > n, as in Dong, Danai and Malkin (2004), (9); after a limit was exceeded
        the last good bound returns and its c is halved. Contracting: c (s - n); after a limit was exceeded c
        = 1, as with printed before the first good bound.
    method : {"qp", "nlp"}
        Optimum of the model by sequential quadratic programs (`statement`, OSQP), or by IPOPT (CasADi).
    settings : iterable of str, optional
        Free settings of "rough_rate", "stage_rate", "final_rate" (mm/s) and "stage_remaining" (mm). Default:
        all.

    Raises
    ------
    ValueError
        If a value is out of range, or a name is not known.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> assumed = problem.replace(wear_flat_area=0.0234)
    >>> safe = plunge.StagedController(assumed, stage_remaining=0.12, stage_rate=0.006)  # mm, mm/s
    >>> rule = learning.ConstraintBounding(step=0.5)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), safe, parts=6, adapt=rule)
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
        """Present bounds b of the model, mm and W; empty before the first part."""
        return dict(self._bounds)

    @property
    def left(self) -> dict[str, float]:
        """Distances s of the last part to each limit, mm and W."""
        return dict(self._left)

    @property
    def status(self) -> str:
        """Result of the last optimum in words (dimensionless): "solved", or why the settings stayed."""
        return self._message

    @property
    def statement(self) -> "cvxpy.Problem":
        """First quadratic program of the last part in cvxpy: a scaled step of the settings (dimensionless).

        Raises ValueError before the first part, and with ``method="nlp"``.
        """
        if self._program is None:
            raise ValueError(
                "statement must be asked for after a part, with method='qp': there is no program yet"
            )
        return self._program.statement()

    def next(self, controller: StagedController, part_log: Any) -> StagedController:
        """Return `controller` with new settings (mm/s, mm), by the `part_log` of the last part."""
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
            bound = min(self._bounds.get(name, limit), reached[name])  # no bound beyond what was tried
            if np.isfinite(seen[name]):
                bound = self._moved(name, bound, self._left[name])
            self._bounds[name] = min(bound, limit + self.cap[name])

    def _limits(self, problem: CycleProblem) -> dict[str, float]:
        limits = {"burned_layer": 0.0} if program(problem).burns else {}
        limits["roundness"] = float(problem.roundness_max)
        return limits if self.power_max is None else {**limits, "grinding_power": self.power_max}

    def _moved(self, name: str, bound: float, left: float) -> float:
        """Next bound; after an excess the bound steps back."""
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
    """Bound after (9); by the printed rule it stays while no more than the buffer is left."""
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
            f"{what} must be a mapping of {', '.join(CONSTRAINTS)} to amounts (mm, W);"
            f" got {checks.shown(given)}"
        )
    for name in given or {}:
        checks.one_of(what, name, CONSTRAINTS)
    amounts = {**usual, **(given or {})}
    return {
        name: checks.nonnegative(f"{what}[{name!r}]", value, CONSTRAINTS[name])
        for name, value in amounts.items()
    }
