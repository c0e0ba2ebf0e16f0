"""Three tiers in one controller: sequence, pass and force loop; Brown (1988), chapter 3.

After each pass the bead is scanned, the coefficients are estimated anew, sequence and pass are planned again.
"""

from collections.abc import Mapping
from contextlib import suppress
from math import floor, isnan, nan
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.controllers import Stateful
from sdpgrind.weldbead._hierarchy.ends import ends_raised
from sdpgrind.weldbead.force import ForceController, ForceLoop
from sdpgrind.weldbead.passes import Contour, PassPlan, PassProblem, TiltedDisc
from sdpgrind.weldbead.passes import plan as plan_pass
from sdpgrind.weldbead.sequence._bead_estimator import BeadEstimator, with_beads
from sdpgrind.weldbead.sequence._controller import READINGS, SequenceController
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._process import GrindingProcess

_ASKED = {"mean_cut": "mm", "cut_sd": "mm", "planned_feed": "mm/s"}
_ESTIMATED = {"specific_energy": "J/mm^3", "idle_power": "W", "friction_ratio": ""}
_LEAD = 0.3  # chosen: start of a pass before its plan, s: the platform is down before the disc meets the bead
_SPARE = 0.1  # chosen: time of a pass beyond its travel, s: ticks, and the wound disc
_LEAST_CUT = 1e-3  # chosen: mean depth below which no pass is planned, mm


class Hierarchy:
    """Sequence, pass and force control of a weld bead as one controller of three tiers.

    The tier "sequence" looks up depth and feed in the policy after each scan; the tier "pass" turns them into
    a contour, heights and forces on the scanned bead; the tier "force" follows those 60 times a second.
    Set-points go down; each tier has its table in the log.

    Parameters
    ----------
    policy : SequencePolicy
        Sequence to follow.
    disc : TiltedDisc
        Disc, with the process of the policy's problem.
    loop : ForceLoop
        Force loop, from ``force.PI.design``.
    reestimate : bool
        Whether energy, idle power and friction are estimated from each pass and used for the next plans:
        where beads differ (`SequenceProblem.bead_scatter`), with what is not known of them yet; else as if
        the estimates, which assume a scatter of 15 % between passes and between beads, were true.
    replan : bool
        Whether the sequence is looked up from the scanned height; False: from the expected one.
    feedforward : bool
        Passed on to `force.ForceController`.
    parent : Contour, optional
        Surface below the bead, which passes parallel, mm. Default: level at 0.
    datum : float
        Fly height at which the platform command is 0, mm, as in the stand.
    lead_out : float
        Travel of the tip beyond the bead at the end of a pass, mm. The feed is raised so that a pass with its
        leads takes no longer than planned.

    Raises
    ------
    ValueError
        When the processes of policy and disc differ (J/mm^3, W, mm, rad/s).

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> from sdpgrind.weldbead import force, passes
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> times = {"durations": range(12, 41, 4), "stage": 4.0}
    >>> problem = weldbead.preset("P4").replace(model=process, bead_length=150.0, **times)
    >>> policy = weldbead.plan(problem, tolerance=None, nodes=101)
    >>> tiers = Hierarchy(policy, disc, force.PI.design(crossover=units.hz(3.0))).tiers
    >>> list(tiers)
    ['sequence', 'pass', 'force']
    """

    def __init__(
        self,
        policy: SequencePolicy,
        disc: TiltedDisc,
        loop: ForceLoop,
        *,
        reestimate: bool = True,
        replan: bool = True,
        feedforward: bool = True,
        parent: Contour | None = None,
        datum: float = 0.0,
        lead_out: float = 5.0,
    ) -> None:
        checks.kind("policy", policy, SequencePolicy, ", as weldbead.plan gives it")
        checks.kind("disc", disc, TiltedDisc)
        checks.kind("loop", loop, ForceLoop, ", as force.PI.design gives it")
        _refuse_other_process(policy.problem.model, disc.model)
        checks.nonnegative("lead_out", lead_out, "mm")
        if parent is not None:
            checks.kind("parent", parent, Contour)
        options = (reestimate, replan, feedforward, parent, datum, lead_out)
        self._identity = (policy.problem, policy.dataset, disc, loop.identity, *options)
        self._job = (
            dict(policy.problem.job)
            | disc.job
            | {"datum": (datum, "mm"), "lead_out": (lead_out, "mm"), "parent": parent}
        )
        most = policy.problem.force_max * (1 + 1e-9)  # a pass at its limit may exceed it by rounding
        self.tiers: dict[str, Any] = {
            "sequence": _SequenceTier(policy, reestimate, replan),
            "pass": _PassTier(policy, disc, parent, lead_out),
            "force": ForceController(None, loop, feedforward=feedforward, force_max=most, datum=datum),
        }

    @property
    def period(self) -> float:
        """Time between two steps of the fastest tier, s."""
        return float(self.tiers["force"].period)

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine of the policy (mm, s)."""
        return {name: value for name, value in self._job.items() if name != "force_max"}

    @property
    def identity(self) -> tuple[Any, ...]:
        """Class, policy, disc, loop and options: equal ones are the same controller."""
        return type(self).__name__, *self._identity

    def reset(self) -> None:
        """Forget the last bead, in all tiers."""
        for tier in self.tiers.values():
            tier.reset()

    def step(self, **measurement: Any) -> Mapping[str, Any]:
        """Step all tiers once with a `measurement` (mm, s, N, W); `hwsim.run` steps each at its time."""
        command: dict[str, Any] = {}
        for tier in self.tiers.values():
            command |= tier.step(**(measurement | command))
        return command


def _refuse_other_process(planned: GrindingProcess, own: GrindingProcess) -> None:
    if planned != own:
        raise ValueError(
            f"policy must be for the process of the disc; got one for {planned!r} and a disc with {own!r}"
        )


class _SequenceTier(Stateful):
    """Looks up the next pass, with the coefficients of this bead."""

    tier, period = "sequence", None
    _changing = ("_belief", "_follow")
    commands: Mapping[str, str] = _ASKED | {"stop": ""} | _ESTIMATED

    def __init__(self, policy: SequencePolicy, reestimate: bool, replan: bool) -> None:
        self._policy, self._replan = policy, replan
        self._beads = reestimate and policy.problem.bead_scatter is not None
        self._belief = BeadEstimator(with_beads(policy.problem)) if reestimate and not self._beads else None
        self.reads = {"height": "mm", "time_left": "s", **({} if self._belief is None else READINGS)}
        self.reset()
        self.reads = {**self._follow.reads, **self.reads}
        self.reports: Mapping[str, str] = {
            name: unit for name, unit in self._follow.reports.items() if name not in _ESTIMATED
        }

    def reset(self) -> None:
        self._model = self._policy.problem.model
        self._follow = SequenceController(self._policy, learn=self._beads)
        if self._belief is not None:
            self._belief.reset()
        self._begun = False

    def step(self, *, height: float, time_left: float, **others: Any) -> dict[str, float]:
        if self._begun and self._belief is not None:
            self._learn(self._belief, others)
        if self._begun and not self._replan:
            height = nan
        self._begun = True
        command = self._follow.step(height=height, time_left=self._on_lattice(time_left), **others)
        if command["stop"]:
            return {"stop": 1.0}
        if self._beads:  # the pass is planned with the process of the mean cut, which the sequence asks for
            believed = self._follow.problem
            self._model = believed.depths.expected(believed.model)
        feed, cut = command["feed_rate"], self._follow.report()["mean_cut"]
        planned = self._follow.problem
        doubt = float(planned.depths.moments(planned.model, command["normal_force"], feed)[1])
        asked = {"mean_cut": cut, "cut_sd": doubt, "planned_feed": feed}
        return asked | {name: getattr(self._model, name) for name in _ESTIMATED}

    def _learn(self, belief: BeadEstimator, readings: Mapping[str, float]) -> None:
        """Take the believed means as those of the bead, where a plan with them is possible."""
        belief.learn(**{name: readings[name] for name in READINGS if name in readings})
        with suppress(ValueError):
            if belief.passes:
                self._follow.believe(self._policy.problem.replace(model=belief.model))
                self._model = belief.model

    def report(self) -> dict[str, float]:
        told = self._follow.report()
        return {name: told[name] for name in self.reports}

    def _on_lattice(self, time_left: float) -> float:
        """Time left, s, at the stage below when late; 0 where lateness is not planned."""
        if time_left >= 0 or isnan(time_left):
            return time_left
        problem = self._policy.problem
        return (
            0.0
            if problem.lateness_charge is None
            else floor(time_left / problem.stage + 1e-9) * problem.stage
        )


class _PassTier:
    """Plans the next pass on the scanned bead."""

    tier, period = "pass", None
    reads: Mapping[str, str] = {"profile": "mm", "profile_x": "mm"} | _ASKED | _ESTIMATED
    commands: Mapping[str, str] = {
        "start": "", "feed_rate": "mm/s", "start_x": "mm",
        "plan_time": "s", "normal_force_plan": "N", "fly_height_plan": "mm", "center_x_plan": "mm",
        "face_leaves_plan": "s",
    }  # fmt: skip
    reports: Mapping[str, str] = {
        "volume": "mm^3", "shortfall": "mm^3", "force": "N",
        "burn_margin": "N", "power_max": "W", "contour_height": "mm",
    }  # fmt: skip

    def __init__(
        self, policy: SequencePolicy, disk: TiltedDisc, parent: Contour | None, lead_out: float
    ) -> None:
        self._disk, self._problem, self._parent, self._lead_out = disk, policy.problem, parent, lead_out
        self.reset()

    def reset(self) -> None:
        self._report = dict.fromkeys(self.reports, nan)

    def step(
        self,
        *,
        profile: npt.ArrayLike,
        profile_x: npt.ArrayLike,
        mean_cut: float = nan,
        cut_sd: float = 0.0,
        planned_feed: float = nan,
        stop: float = 0.0,
        **others: Any,
    ) -> dict[str, Any]:
        self.reset()
        if stop or isnan(mean_cut) or mean_cut < _LEAST_CUT:
            return {"stop": 1.0} if not stop and mean_cut < _LEAST_CUT else {}
        model = {name: others[name] for name in _ESTIMATED if not isnan(others.get(name, nan))}
        bead = Contour(np.asarray(profile_x, dtype=float), np.asarray(profile, dtype=float))
        asked = self._asked(bead, mean_cut, planned_feed, self._disk.replace(**model))
        plan = plan_pass(ends_raised(self._in_time(asked), cut_sd))
        self._report = _summary(plan)
        names = {"plan_time": "time", "normal_force_plan": "normal_force", "fly_height_plan": "fly_height"}
        arrays = {
            name: getattr(plan, column) for name, column in (names | {"center_x_plan": "center_x"}).items()
        }
        feed = plan.problem.feed_rate
        arrays["face_leaves_plan"] = plan.face_leaves
        return arrays | {"start": 1.0, "feed_rate": feed, "start_x": float(plan.center_x[0]) - _LEAD * feed}

    def _asked(self, bead: Contour, mean_cut: float, feed_rate: float, disk: TiltedDisc) -> PassProblem:
        limits: dict[str, Any] = {
            "burn_limit": self._problem.burn_limit,
            "normal_force_max": self._problem.force_max,
        }
        limits["allow_overground"] = True  # the sequence decides on depth and pays for it
        return PassProblem(
            disk, bead, mean_cut=mean_cut, feed_rate=feed_rate, target_shape=self._parent, **limits
        )

    def _in_time(self, asked: PassProblem) -> PassProblem:
        """Raise the feed so that the pass takes no longer, leads included: a stage begun is lost."""
        planned = (asked.bead.length + self._problem.lead_length) / asked.feed_rate
        moving = planned - _LEAD - _SPARE
        way = asked.lead_in + asked.bead.length + self._lead_out
        return asked.replace(feed_rate=way / moving) if moving > 0.5 * planned else asked

    def report(self) -> dict[str, float]:
        return self._report


def _summary(plan: PassPlan) -> dict[str, float]:
    on = plan.normal_force > 0
    force = float(np.mean(plan.normal_force[on])) if np.any(on) else 0.0
    margin = plan.burn_margin if np.isfinite(plan.burn_margin) else nan
    return {
        "volume": plan.volume, "shortfall": plan.shortfall, "force": force, "burn_margin": margin,
        "power_max": float(np.max(plan.grinding_power)), "contour_height": plan.contour.mean,
    }  # fmt: skip
