"""Controller of the grinding sequence."""

from collections.abc import Mapping
from contextlib import suppress
from copy import copy
from math import isnan, nan
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.controllers import Stateful
from sdpgrind.weldbead.sequence._bead_estimator import BeadEstimator
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._replan import NextPass, next_pass
from sdpgrind.weldbead.sequence._simple_policy import SimplifiedPolicy

# chosen: a bead of the greatest height is read higher half of the time; more would hide one that is too high
_SCAN = 0.01
READINGS: Mapping[str, str] = {
    "normal_force": "N", "tangential_force": "N", "grinding_power": "W", "removal_rate": "mm^3/s",
    "cut_depth": "mm",
}  # fmt: skip
_BELIEVED: Mapping[str, str] = {
    "specific_energy": "J/mm^3", "idle_power": "W", "friction_ratio": "", "learns": "",
}  # fmt: skip


class SequenceController(Stateful):
    """Looks up the next pass in a policy from the scanned height, after each pass.

    Steps once per event (a pass is over, the bead was scanned). Commands ``duration`` (s), ``feed_rate``
    (mm/s) and ``normal_force`` (N) of the next pass, or ``stop``. Reports the expected penalty-to-go
    ``penalty`` ($), the expected mean cut ``mean_cut`` (mm) and the cost of the next best duration ``gap``
    ($).

    A scan up to 1 % above the greatest height of the policy counts as that height. A missing scan (NaN) is
    replaced by the height expected after the last pass, a missing clock by the duration of that pass.

    Where beads differ (`SequenceProblem.bead_scatter`) it learns the coefficients of the bead from each pass
    and plans again with what it still does not know, by the policy's method. It then reads power, removal
    rate and forces, too, and reports the believed ``specific_energy`` (J/mm^3), ``idle_power`` (W) and
    ``friction_ratio``, and ``learns``: 0 after readings that are not those of such a bead.

    Parameters
    ----------
    policy : SequencePolicy
        Plan to follow, from `plan`.
    learn : bool
        Whether the bead is learned; False: the policy is followed as it is.
    estimator : BeadEstimator, optional
        Belief with which each bead begins, with the noise of the gauges; a copy is kept as it is now. One
        that has been updated is believed from the first pass on. Default: a fresh one, gauges without noise.

    Raises
    ------
    ValueError
        For an estimator of other beads. From `step`: a bead higher (mm) or a deadline farther (s) than
        the policy's; no first reading.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101)
    >>> controller = weldbead.SequenceController(policy)
    >>> command = controller.step(height=1.0, time_left=10.0)
    >>> command["duration"], command["stop"], controller.report()["penalty"] > 0
    (10.0, 0.0, True)
    >>> controller.step(height=0.0, time_left=0.0)
    {'stop': 1.0}
    """

    period: float | None = None
    tier = "sequence"
    _changing = ("_belief",)
    reads: Mapping[str, str] = {"height": "mm", "time_left": "s"}
    commands: Mapping[str, str] = {"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "stop": ""}
    reports: Mapping[str, str] = {"penalty": "$", "mean_cut": "mm", "gap": "$"}

    def __init__(
        self, policy: SequencePolicy, *, learn: bool = True, estimator: BeadEstimator | None = None
    ) -> None:
        self._given: SequenceProblem | None = None
        self._believed: SequenceProblem | None = None
        self._fresh = self._belief = _learner(policy, estimator) if learn else None
        self.follow(policy)
        if self._belief is not None:
            self.reads = {**self.reads, **READINGS}
            self.reports = {**self.reports, **_BELIEVED}
        self.reset()

    def follow(self, policy: SequencePolicy) -> None:
        """Follow another policy; the state of the bead (mm, s) is kept.

        Parameters
        ----------
        policy : SequencePolicy
            From `plan`, with the same durations, s; where beads are learned, for the same beads.

        Raises
        ------
        TypeError, ValueError
            When it is no policy; when its beads are others than those that are learned.
        """
        checks.able("policy", policy, "a policy, as weldbead.plan gives it", "action")
        if self._belief is not None:
            _refuse_other_beads("policy", policy.problem, self._belief.problem)
        self._policy = policy
        if self._fresh is not None and self._fresh.passes:
            self._given = self._learned(self._fresh)
        if self._belief is not None and self._believed is not None:
            self._believed = self._learned(self._belief)

    def believe(self, problem: SequenceProblem) -> None:
        """Plan each next pass anew for a problem (mm, s, N) with the policy's durations, until `reset`."""
        self._believed = problem

    @property
    def policy(self) -> SequencePolicy:
        """Plan that is followed until something is learned."""
        return self._policy

    @property
    def problem(self) -> SequenceProblem:
        """Problem (N, mm, s) of the next pass, with the process as it is believed now."""
        return self._policy.problem if self._believed is None else self._believed

    @property
    def identity(self) -> tuple[Any, ...]:
        """Class, problem and tables of the policy: equal ones are the same controller."""
        own = () if self._fresh is None else self._fresh.identity
        return type(self).__name__, self._policy.problem, self._policy.dataset, *own

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine of the policy (mm, s, N); `hwsim` refuses to run it on others."""
        return self._policy.problem.job

    def reset(self) -> None:
        """Forget the last bead."""
        self._begun, self._belief, self._believed = False, copy(self._fresh), self._given
        self._expected_height = self._expected_time = nan
        self._last: dict[str, float] = {}  # the last pass, where a finish is charged
        self._report = dict.fromkeys(self.reports, nan)

    def step(self, *, height: float, time_left: float, **others: Any) -> dict[str, float]:
        """Return the next pass (s, mm/s, N), or ``{"stop": 1.0}``.

        Parameters
        ----------
        height : float
            Scanned bead height, mm; < 0: overground.
        time_left : float
            Time to the deadline, s; < 0: late.
        **others
            Further measurements: readings of the last pass where the bead is learned, others are ignored.
        """
        height, time_left = self._known(height, time_left)
        if self._belief is not None:
            self._learn(self._belief, others)
        self._check(height, time_left)
        height = min(height, self._policy.problem.height_max)
        found = self._next(height, time_left)
        action = found.action
        stop = bool(action.stop)
        mean_cut = 0.0 if stop else float(action.mean_cut)
        self._report = {"penalty": found.penalty, "mean_cut": mean_cut, "gap": float(action.gap)}
        if self._belief is not None:
            self._report |= self._belief.report()
        if stop:
            return {"stop": 1.0}
        self._remember(height - mean_cut, time_left, float(action.duration))
        return {name: float(getattr(action, name)) for name in ("duration", "feed_rate", "normal_force")} | {
            "stop": 0.0
        }

    def report(self) -> dict[str, float]:
        """Return expected penalty-to-go, $, mean cut, mm, and gap, $, of the last step."""
        return self._report

    def _learn(self, belief: BeadEstimator, readings: Mapping[str, float]) -> None:
        """Take in the last pass."""
        if self._begun:
            belief.learn(**{name: readings[name] for name in READINGS if name in readings})
            self._believed = self._learned(belief) or self._believed
        self._begun = True

    def _learned(self, belief: BeadEstimator) -> SequenceProblem | None:
        """Problem of the next pass; None: as planned, or no force removes what is believed."""
        with suppress(ValueError):
            told = belief.believed
            return self._policy.problem.replace(model=told.model, bead_scatter=told.bead_scatter)
        return None

    def _next(self, height: float, time_left: float) -> NextPass:
        """Plan the next pass with what has been learned; look it up where nothing has, or nothing is left."""
        if self._believed is not None and height > 0:
            return next_pass(self._believed, self._policy.method, height, time_left, **self._last)
        action = self._policy.action(height, time_left, **self._last)
        penalty = float(self._policy.value(height, time_left, **self._last))
        return NextPass(action, penalty)

    def _remember(self, height: float, time_left: float, duration: float) -> None:
        """Keep the state expected after the pass, for a missing reading."""
        self._expected_height, self._expected_time = height, time_left - duration
        if self._policy.problem.finish_charge is not None:
            self._last = {"last_duration": duration}

    def _known(self, height: float, time_left: float) -> tuple[float, float]:
        """Fill in missing readings."""
        height = self._expected_height if isnan(height) else float(height)
        time_left = self._expected_time if isnan(time_left) else float(time_left)
        if isnan(height) or isnan(time_left):
            raise ValueError("height (mm) and time_left (s) must both be read before the first pass; got nan")
        return height, time_left

    def _check(self, height: float, time_left: float) -> None:
        problem = self._policy.problem
        if height > problem.height_max * (1 + _SCAN):
            raise ValueError(
                f"height must be <= height_max = {problem.height_max:g} of the policy (mm); got {height!r}: "
                "plan with a larger height_max, it costs little"
            )
        if time_left > problem.horizon:
            raise ValueError(
                f"time_left must be <= horizon = {problem.horizon:g} of the policy (s); got {time_left!r}: "
                "plan with a longer horizon"
            )


def knowing(policy: SequencePolicy, process: GrindingProcess) -> SequenceController:
    """Return a controller that knows a bead's coefficients (J/mm^3, W, 1) and plans each pass for them.

    Where no admissible force removes such metal, it follows the policy.
    """
    found, problem = SequenceController(policy, learn=False), policy.problem
    scatter = problem.scatter.replace(mean="coefficient")
    with suppress(ValueError):
        found._given = problem.replace(model=process, scatter=scatter, bead_scatter=None)
    found.reset()
    return found


def _learner(policy: SequencePolicy, estimator: BeadEstimator | None) -> BeadEstimator | None:
    """Estimator of a controller's own; refuse one whose beads are others than those of the plan."""
    problem = getattr(policy, "problem", None)
    if isinstance(policy, SimplifiedPolicy):
        return None  # what is printed stays
    if estimator is None:
        beads = getattr(problem, "bead_scatter", None)
        return None if beads is None else BeadEstimator(policy.problem)
    _refuse_other_beads("estimator", checks.kind("estimator", estimator, BeadEstimator).problem, problem)
    return copy(estimator)


def _refuse_other_beads(name: str, given: SequenceProblem, known: Any) -> None:
    """Refuse the problem of an argument whose beads or passes are others than those that are known."""
    for field in ("model", "scatter", "bead_scatter"):
        told, wanted = getattr(given, field), getattr(known, field)
        if told != wanted:
            owner = "the policy" if name == "estimator" else "the beads that are learned"
            raise checks.refuse(f"{name}.problem.{field}", f"that of {owner}, {wanted!r}", told)
