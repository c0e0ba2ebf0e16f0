"""Bottom tier: follows a planned force at 60 Hz by feedforward of the plan and feedback on the rest."""

from collections.abc import Mapping
from math import inf, isfinite, isnan, nan
from operator import is_
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.base.states import flat
from sdpgrind.control import Law
from sdpgrind.weldbead.force._feedback import ForceLoop
from sdpgrind.weldbead.force._kernels import ControlCore, control_sample
from sdpgrind.weldbead.force._limits import Limits
from sdpgrind.weldbead.force._reference import ForceReference, Trajectory

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

FORCE_MAX = 90.0  # chosen: N; the default limit of a pass problem
_MEASURED = {"force": "N", "pass_time": "s", "center_x": "mm"}
_SET_POINTS = {
    "plan_time": "s", "normal_force_plan": "N", "fly_height_plan": "mm", "center_x_plan": "mm",
    "face_leaves_plan": "s",
}  # fmt: skip
_PLACE_TRUST = 0.2  # chosen: weight of the measured place in the time of a sample; the rest is the clock's


class ForceController(Stateful):
    """Follows a pass plan with the platform: feedforward and feedback, or feedback alone.

    Feedforward sends the planned height ahead by the lag of the loop; feedback acts on the difference between
    the reading and that foreseen by the model of the loop. Without feedforward (Brown's way) it acts on the
    force error. Steps once a sample; commands ``platform_command``: datum - fly height + correction (mm, up
    positive).

    Where the reading stays below the contact force although more is foreseen, the law is frozen and the
    platform approaches at a limited speed; the law then resumes without a bump. NaN (no reading) holds the
    correction; so does the face of the disc as it leaves the bead, where the plan says when: the same force
    on less contact would dig.

    The time in the plan comes from the place of the disc, so that a lead-in or a feed off the plan do no
    harm; without it from the clock of the pass. Outside the plan the force is 0, at the height of its end.

    Parameters
    ----------
    plan : PassPlan or None
        Arrays ``time`` (s), ``normal_force`` (N), ``fly_height`` (mm); ``center_x`` (mm) and ``face_leaves``
        (s) where known.
        None: the plan comes as set-points ``plan_time``, ``normal_force_plan``, ``fly_height_plan``,
        ``center_x_plan``, ``face_leaves_plan``.
    loop : ForceLoop
        Law and model of the loop.
    feedforward : bool
        Whether the planned height is used; False: feedback alone, from the plan's first height on.
    blend : float
        Weight of the planned height against the planned force in the feedback, dimensionless; 0 holds the
        force, 1 the height.
    force_max : float, optional
        Greatest planned force, N. Default: the plan's own limit, or 90 N.
    limits : Limits, optional
        Limits of the command, in mm and s.
    datum : float
        Fly height at which the platform command is 0, mm.

    Raises
    ------
    ValueError
        When the plan demands a negative force or more than `force_max` (N), or a value is not in its range.

    Examples
    --------
    >>> import types
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead.force import PI
    >>> loop = PI.design(crossover=units.hz(3.0))
    >>> plan = types.SimpleNamespace(time=[0.0, 1.0], normal_force=[30.0, 30.0], fly_height=[10.0, 10.0])
    >>> ForceController(plan, loop).step(force=30.0)
    {'platform_command': -10.0}
    """

    tier = "force"
    _changing: ClassVar[tuple[str, ...]] = ("_state", "_work")
    _state: Floats
    _work: Floats
    _samples: int
    commands: Mapping[str, str] = {"platform_command": "mm"}
    reports: Mapping[str, str] = {"force_demand": "N", "force_reference": "N", "correction": "mm"}

    def __init__(
        self,
        plan: Trajectory | None,
        loop: ForceLoop,
        *,
        feedforward: bool = True,
        blend: float = 0.0,
        force_max: float | None = None,
        limits: Limits | None = None,
        datum: float = 0.0,
    ) -> None:
        self._loop, self._plan = checks.kind("loop", loop, ForceLoop, ", as PI.design gives it"), plan
        self._feedforward = bool(feedforward)
        self._blend = checks.within("blend", blend, 0.0, 1.0)
        if self._blend and not self._feedforward:
            raise checks.refuse("blend", "0 without feedforward: there is no height to hold", self._blend)
        own = getattr(getattr(plan, "problem", None), "normal_force_max", FORCE_MAX)
        self._force_max = checks.positive("force_max", own if force_max is None else force_max, "N")
        self._limits = Limits() if limits is None else checks.kind("limits", limits, Limits)
        self._datum = checks.number("datum", datum, "mm")
        self._core, self._lag = self._control_core(), loop.plant.lag
        self._order = loop.law.system.order
        self._core_row = flat(*self._core.law, *self._core.model, *self._core[2:])
        self._reference = None if plan is None else ForceReference.of(plan, self._force_max)
        self.reset()

    @property
    def period(self) -> float:
        """Time between two steps, s."""
        return self._loop.sample_time

    @property
    def reads(self) -> Mapping[str, str]:
        """Measurements, and set-points where it was given no plan, with their units (N, s, mm)."""
        return _MEASURED if self._plan is not None else _MEASURED | _SET_POINTS

    @property
    def loop(self) -> ForceLoop:
        """Law and model, in mm, N and s."""
        return self._loop

    @property
    def core(self) -> ControlCore:
        """Constants of `control_step`, in mm, N and samples."""
        return self._core

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine of the plan (mm, s, N); `hwsim` refuses to run it on others."""
        return getattr(getattr(self._plan, "problem", None), "job", None) or {}

    @property
    def identity(self) -> tuple[Any, ...]:
        """Class, loop, limits and plan: equal ones are the same controller."""
        reference = self._reference if self._plan is not None else None
        plan = None if reference is None else (reference.time, reference.normal_force, reference.fly_height)
        return (
            type(self).__name__,
            self._loop.identity,
            self._limits,
            self._blend,
            self._feedforward,
            self._datum,
            plan,
        )

    def follow(self, plan: Trajectory) -> None:
        """Start a new pass with a plan: arrays ``time`` (s), ``normal_force`` (N), ``fly_height`` (mm)."""
        self._reference = ForceReference.of(plan, self._force_max)
        self._restart()

    def reset(self) -> None:
        """Forget the last pass; a plan given at the start is kept."""
        self._set_points: tuple[Any, ...] = ()
        if self._plan is None:
            self._reference = None
        else:
            self._reference = ForceReference.of(self._plan, self._force_max)
        self._restart()

    def start(self) -> Floats:
        """Return a fresh state of `control_step` (mm and N) for time 0 of the pass."""
        return self._settled(self._ahead(0.0)[0])

    def _settled(self, demand: float) -> Floats:
        """State after an endless demand, N."""
        law, model = self._loop.law.system, self._loop.plant.sampled
        foreseen = np.linalg.solve(np.eye(model.order) - model.A, model.B * demand)
        return np.concatenate([np.zeros(law.order), foreseen, [0.0, nan, 0.0, 0.0]])

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes: a pass along the plan; without one the law.

        Planned force (N) and position (mm) are then inputs.
        """
        from sdpgrind.weldbead.force._recipe import law_recipe, pass_recipe

        if self._plan is None:
            return law_recipe(self._core, self._settled(0.0), self.period, self._force_max)
        reference, first = self._known(), self._ahead(0.0)[0]
        settings = {
            "feedforward": self._feedforward, "datum": self._datum, "lag": self._lag, "period": self.period,
            "face_leaves": reference.face_leaves, "has_place": reference.center_x is not None,
            "place_trust": _PLACE_TRUST, "first_demand": first,
        }  # fmt: skip
        settled = np.array([self._settled(first), self._settled(1.0)])
        return pass_recipe(self._core, reference, settings, settled, self._force_max, self.job)

    def planned(self, time: float) -> tuple[float, float]:
        """Return planned force (N) and platform position (mm) at a time (s) of the pass."""
        force, height = self._known().at(time)
        return force, self._datum - height

    def planned_along(self, time: Floats) -> tuple[Floats, Floats]:
        """Return planned forces (N) and platform positions (mm) at many times (s) of the pass."""
        force, height = self._known().along(time)
        return force, self._datum - height

    def trajectory(self, samples: int) -> tuple[Floats, Floats]:
        """Return force (N) and position (mm) for `control_step` in the first `samples` of the pass."""
        time = self.period * np.arange(checks.count("samples", samples), dtype=float)
        if self._feedforward:
            return self.planned_along(time + self._lag)
        force, _ = self.planned_along(time)
        return force, np.full(force.shape, self._datum - float(self._known().fly_height[0]))

    def step(
        self,
        *,
        force: float,
        pass_time: float = nan,
        center_x: float = nan,
        plan_time: npt.ArrayLike | None = None,
        normal_force_plan: npt.ArrayLike | None = None,
        fly_height_plan: npt.ArrayLike | None = None,
        center_x_plan: npt.ArrayLike | None = None,
        face_leaves_plan: float = inf,
        **others: Any,
    ) -> dict[str, float]:
        """Return the platform command (mm) of this sample; nothing while set-points are NaN.

        Parameters
        ----------
        force : float
            Reading of the sensor, N; NaN: none.
        pass_time : float
            Time since the start of the pass, s, used where the place is unknown. A clock that goes back
            starts a new pass. Without both, steps are counted.
        center_x : float
            Position of the disc's center, mm; it gives the time where the plan has ``center_x``.
        plan_time, normal_force_plan, fly_height_plan, center_x_plan : array, optional
            Plan as set-points (s, N, mm, mm); new ones start a new pass. The last one may be missing.
        face_leaves_plan : float
            Time in that plan from which on the face leaves the bead, s.
        **others
            Further measurements, ignored.

        Raises
        ------
        ValueError
            When there is no plan yet, or the set-points demand a forbidden force (N).
        """
        self._take(plan_time, normal_force_plan, fly_height_plan, center_x_plan, face_leaves_plan)
        if self._reference is None and plan_time is not None:
            return {}  # no set-points from the tier above yet
        time = self._now(pass_time, center_x)
        demand, position = self._ahead(time)
        if not self._state.size:
            self._state = self._settled(demand)
            self._work = np.empty_like(self._state)
        leaves = time + self._lag >= self._known().face_leaves
        reading = nan if leaves or not isfinite(force) else float(force)  # an infinite reading is none
        command = self._command(reading, demand, position, time)
        self._samples, self._time, self._demand = self._samples + 1, time, demand
        return {"platform_command": command}

    def report(self) -> dict[str, float]:
        """Return force demanded and reading foreseen next, N, and the correction of the position, mm."""
        if not self._state.size:
            return dict.fromkeys(self.reports, nan)
        gain = self._core.model.C
        held = self._state[self._order : self._order + len(gain)]
        foreseen = float(gain.dot(held))  # "@" takes twice as long
        reference = foreseen if self._feedforward else self._demand
        return {
            "force_demand": self._demand,
            "force_reference": reference,
            "correction": float(self._state[-4]),
        }

    def _command(self, force: float, demand: float, position: float, time: float) -> float:
        """Command of one sample, mm."""
        found = control_sample(self._core_row, self._order, self._state, self._work, force, demand, position)
        return float(found)

    def _restart(self) -> None:
        self._samples, self._time, self._clock, self._demand = 0, nan, nan, nan
        self._state = self._work = np.zeros(0)

    def _take(self, time: Any, force: Any, height: Any, place: Any, leaves: float) -> None:
        """Follow new set-points; repeated ones change nothing."""
        given = (time, force, height, place, leaves)
        known = bool(self._set_points)
        if known and all(map(is_, self._set_points, given)):
            return
        if self._plan is not None or any(each is None for each in given[:3]) or not np.all(np.isfinite(time)):
            return
        if not (known and all(map(np.array_equal, self._set_points, given))):
            self._set_points = given
            self._reference = ForceReference.arrays(time, force, height, self._force_max, place, leaves)
            self._restart()

    def _now(self, pass_time: float, center_x: float) -> float:
        """Time in the plan, s."""
        reference = self._known()
        if pass_time < self._clock:
            self._restart()
        self._clock = pass_time if not isnan(pass_time) else self._clock
        told = self._plan is None  # by set-points: the pass begins after the sample in which they come
        if not isnan(center_x) and reference.center_x is not None:
            place = reference.when(center_x)
            counted = nan if told and self._samples == 1 else self._time + self.period
            return place if isnan(counted) else counted + _PLACE_TRUST * (place - counted)
        if told and self._samples == 0 and isnan(pass_time):
            return -self._lag
        return self._samples * self.period if isnan(pass_time) else pass_time

    def _known(self) -> ForceReference:
        if self._reference is None:
            names = ", ".join(_SET_POINTS)
            raise ValueError(
                f"plan must be given before the first step, or come with it as set-points {names}"
            )
        return self._reference

    def _ahead(self, time: float) -> tuple[float, float]:
        """Force, N, and platform position, mm, to act on now."""
        reference = self._known()
        if not self._feedforward:
            return reference.at(time)[0], self._datum - float(reference.fly_height[0])
        force, height = reference.at(time + self._lag)
        return force, self._datum - height

    def _control_core(self) -> ControlCore:
        plant, limits, period = self._loop.plant, self._limits, self._loop.sample_time
        model = plant.sampled.scaled(1 / plant.contact_stiffness)
        return ControlCore(
            *(
                self._loop.law.core,
                Law(model, np.zeros(model.order)).core,
                plant.contact_stiffness,
                self._blend,
                self._feedforward,
            ),
            *(limits.command_min, limits.command_max, limits.command_rate_max * period),
            *(limits.contact_force, limits.patience, limits.approach_rate_max * period),
        )
