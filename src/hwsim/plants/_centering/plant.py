"""A centering machine: a ring on a turning table, and a slide with probe and pusher that centres it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import ClassVar, Self, TypeAlias

import numpy as np

from centering import CenteringProblem, PushScatter
from centering.kernels import (
    ProbeErrors,
    Ring,
    core_settings,
    gauge_settings,
    lag_time,
    lobes_of,
    shape_of,
)
from centering.push import PushModel
from hwsim._part.clock import Clock, exact
from hwsim._processor.scheduler import Scheduler
from hwsim.plants._centering.machine import LEAST_FRICTION, CenteringPart, CenteringRig
from hwsim.plants._centering.tasks import control_period, source_tasks
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described, flag, part, quantity

Truth: TypeAlias = PushModel | Callable[[np.random.Generator], PushModel] | None
_NEAREST = 0.1  # default smallest offset over the greatest; chosen: a part that needs pushes


@described()
class CenteringMachine(Described):
    """A ring off the axis of a turning table; a slide probes and pushes its rim: Mears (2006), ch. 3, 5.

    Measured at each sample: ``time`` (s), ``angle`` of the spindle (rad, continuous over turns; the rim is
    farthest at the angle of the offset), ``slide`` (tip of the pusher, mm from the axis), ``probe`` (rim from
    the tip outwards, mm: -follow_gap while following, 0 where the tip touches; NaN: beyond its stroke),
    ``force`` (N), ``peak_force`` since the last sample, ``spindle_speed`` (rad/s), ``pushing`` (1 while a
    profile runs), ``refreshed`` (see `scheduler`). Slide plus probe is the reading.

    Accepted: ``velocity`` of the slide (mm/s, towards the axis, clipped); ``profile`` of its motion towards
    the axis (rows of duration in s, initial velocity in mm/s, acceleration in mm/s^2, or a
    `centering.TipProfile`), which begins at ``profile_angle`` (rad), inside a tick, or at once where the
    angle is missing or passed. A new profile replaces a waiting one (no rows: cancels it) and is dropped
    while another one runs. A slide at another speed joins the profile at ``acceleration_max``; the difference
    in position stays. ``spindle_speed`` (rad/s) is reached at ``spindle_acceleration`` (rad/s^2), at first
    and at most that of the limits. ``retract`` ends the part, given up unless ``finished`` is commanded;
    ``finished`` alone ends it, too.

    Between ticks slide and spindle move in closed form, and the ring by the laws of contact and friction on
    the turning table, with centrifugal and Coriolis forces. A table that changes its speed while the ring
    slides spins it by the friction of a thin ring with even pressure (its lobes do not turn with it). A tip
    that the rim hits without a push (a collision) pushes it, too.

    Outcome of a part: ``time`` (s), ``pushes``, the hidden final ``offset`` (mm), ``said_finished``,
    ``finished`` (1: said so, and within tolerance), ``timed_out`` (1: ended by ``time_max``), ``slipped`` (1:
    the table threw the ring), ``lost`` (1: the axis left the ring), ``collisions`` (contacts that begin
    without a profile), ``peak_force`` (N), ``true_mu_static``, ``true_mu_kinetic``, ``overruns`` of tasks,
    ``worst_response`` of the controller's task (s), and ``center_x``, ``center_y`` (mm, on the table) before
    each push and at the end. Controllers of `centering` add ``state``, the number of the final
    `centering.cycle.CycleState` (6: centred; 7 and above: reason for giving up).

    Parameters
    ----------
    problem : CenteringProblem
        Part, friction, limits, scatter, tolerance.
    truth : PushModel or callable, optional
        True part and friction, or a function of a Generator that draws them. None: the problem's model.
    ring : Ring, optional
        Initial ring with its form and position, in place of `start_offset`. Its radius is that of the part;
        its rim is within ``problem.offset_max`` of a centred circle.
    start_offset : tuple or float, optional
        Initial offset, mm: range of a uniform draw, or one value; at most ``problem.offset_max``. Its
        direction is uniform. None: a tenth of ``offset_max`` to ``offset_max``.
    scatter : PushScatter, optional
        Scatter of parts and pushes. None: that of the problem.
    errors : ProbeErrors, optional
        Errors of the gauges, in addition to ``scatter.measuring_sd``. None: none, not even steps of encoders.
    scheduler : Scheduler, optional
        Tasks of the computer: the controller samples when its task ``control`` starts, its command takes
        effect when the task is complete; ``refreshed`` is 1 where a task ``model`` was completed since the
        last sample. Default: the four loops of the source, with chosen execution times. None: both at once,
        at each tick.
    tip_radius : float
        Radius of the probe's roller, mm.
    start_gap : float, optional
        Initial distance from the tip of the pusher to the rim, mm. None: the problem's follow_gap.
    gain_scheduling : bool
        Whether the drive's gains follow the load, so that a pushing slide has no lag. False: it has the lag
        of Table 3.2 of the source, 0.24 ms with 0.8 kg, 2.49 ms with 18.9 kg, linear in mass. For a
        controller: ``CycleSettings(following_lag=machine.following_lag)``.
    tick : float
        Time step, s.
    time_max : float
        Time limit for one part, s.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be carried out.

    Examples
    --------
    >>> import centering, hwsim
    >>> machine = hwsim.CenteringMachine(centering.preset("printed"), start_offset=2.0)
    >>> sample = machine.start(np.random.default_rng(0)).step({}, 0)
    >>> round(sample["probe"], 3), sample["force"]  # mm, N
    (-7.928, 0.0)
    """

    problem: CenteringProblem = part(CenteringProblem, " (see centering.preset)")
    _: KW_ONLY
    truth: Truth = part(PushModel, ", a function of rng, or None", or_function=True, default=None)
    ring: Ring | None = part(Ring, " or None", default=None)
    start_offset: tuple[float, float] | float | None = custom(unit="mm", default=None)
    scatter: PushScatter | None = part(PushScatter, " or None", default=None)
    errors: ProbeErrors | None = part(
        ProbeErrors, " or None", default_factory=lambda: ProbeErrors(noise_sd=0.0, runout=0.0)
    )
    scheduler: Scheduler | None = part(Scheduler, " or None", default_factory=source_tasks)
    tip_radius: float = quantity("mm", at_least=0, usual=(0.0, 500.0), typical=4, default=3.75)
    start_gap: float | None = quantity("mm", above=0, usual=(0.0, 1000.0), typical=8, default=None)
    gain_scheduling: bool = flag(default=True)
    tick: float = quantity("s", above=0, default=1e-3)
    time_max: float = quantity("s", above=0, default=300.0)

    _inside: ClassVar[str] = "problem"

    def _check(self) -> None:
        clock = Clock(exact("tick", self.tick))
        if self.scheduler is not None:
            clock.ticks("period of the task control", control_period(self.scheduler))
        self._check_start()

    def _check_start(self) -> None:
        """Refuse an initial offset that a controller does not plan for."""
        radius, most = self.problem.model.part.radius, self.problem.offset_max
        for name, offset in zip(("start_offset[0]", "start_offset[1]"), self._offsets, strict=True):
            checks.nonnegative(name, offset, "mm")
        if max(self._offsets) > most:
            raise self._refused("start_offset", f"<= offset_max = {most:g}")
        if self._offsets[0] > self._offsets[1]:
            raise self._refused("start_offset", "of a least and a greatest")
        if self.ring is not None:
            if self.start_offset is not None:
                raise ValueError(
                    "start_offset must be left out with a ring, which says where it lies; "
                    f"got {self.start_offset!r} (mm)"
                )
            _check_ring(self.ring, radius, most)

    @property
    def _offsets(self) -> tuple[float, float]:
        if self.start_offset is None:
            return _NEAREST * self.problem.offset_max, self.problem.offset_max
        if isinstance(self.start_offset, tuple | list):
            if len(self.start_offset) != 2:
                raise self._refused("start_offset", "a number or a pair of them")
            return self.start_offset[0], self.start_offset[1]
        return self.start_offset, self.start_offset

    @property
    def _control_ticks(self) -> int:
        """Ticks between releases of the controller's task; 1 without scheduler."""
        clock = Clock(exact("tick", self.tick))
        return (
            1
            if self.scheduler is None
            else clock.ticks("period of the task control", control_period(self.scheduler))
        )

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        lengths, forces = dict.fromkeys(("slide", "probe"), "mm"), dict.fromkeys(("force", "peak_force"), "N")
        return {
            "time": "s",
            "angle": "rad",
            **lengths,
            **forces,
            "spindle_speed": "rad/s",
            "pushing": "",
            "refreshed": "",
        }

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands; for a profile see the class."""
        motion = {"velocity": "mm/s", "profile": "s, mm/s, mm/s^2", "profile_angle": "rad"}
        table = {"spindle_speed": "rad/s", "spindle_acceleration": "rad/s^2"}
        return {**motion, "retract": "", **table, "finished": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that stops table (rad/s) and slide (mm/s) and withdraws the slide, at any moment."""
        return {"velocity": 0.0, "spindle_speed": 0.0, "retract": 1.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command (rad/s, rad/s^2); the velocity is clipped instead."""
        limits = self.problem.limits
        return {
            "spindle_speed": (0.0, float(limits.spindle_speed_max)),
            "spindle_acceleration": (0.0, float(limits.spindle_acceleration_max)),
            "retract": (0.0, 1.0),
            "finished": (0.0, 1.0),
        }

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the commands that are tables (s, mm/s, mm/s^2)."""
        return ("profile",)

    @property
    def sample_ticks(self) -> int:
        """Ticks between two samples of the computer's task ``control``."""
        return self._control_ticks

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of the outcomes, with the dimension of those by push."""
        ends = dict.fromkeys(("said_finished", "finished", "timed_out", "slipped", "lost", "collisions"), "")
        true = {"true_mu_static": "", "true_mu_kinetic": "", "overruns": "", "worst_response": "s"}
        places: dict[str, str | tuple[str, str]] = dict.fromkeys(("center_x", "center_y"), ("mm", "push"))
        return {"time": "s", "pushes": "", "offset": "mm", **ends, "peak_force": "N", **true, **places}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Part (kg, mm), tolerance (mm) and radius of the roller (mm), for the log."""
        ring, tolerance = self.problem.model.part, self.problem.tolerance
        return {
            "mass": ring.mass,
            "radius": ring.radius,
            "tolerance": tolerance,
            "tip_radius": self.tip_radius,
        }

    @property
    def job(self) -> Mapping[str, object]:
        """Part (kg, mm), tolerance (mm) and limits (mm/s, rad/s) of the problem; `truth` may differ."""
        return self.problem.job

    @property
    def following_lag(self) -> float:
        """Lag of a slide that pushes the problem's part, s (Mears, Table 3.2); 0 with gain_scheduling."""
        return 0.0 if self.gain_scheduling else lag_time(self.problem.model.part.mass)

    def with_tick(self, tick: float) -> Self:
        """Return the same plant with another `tick` (s)."""
        return self.replace(tick=tick)

    def start(self, rng: np.random.Generator) -> CenteringPart:
        """Draw the truth of the next part from `rng` and return it at time 0 s, the table at rest.

        Truth, pushes and gauges draw from a child each.
        """
        of_truth, *others = rng.spawn(4)
        model, ring = self._model(of_truth), self._ring(of_truth)
        scatter = self.problem.scatter if self.scatter is None else self.scatter
        friction = max(1.0 + scatter.friction_part_sd * float(of_truth.standard_normal()), LEAST_FRICTION)
        phase = float(of_truth.uniform(-math.pi, math.pi))
        rig = CenteringRig(
            self.problem,
            scatter,
            model,
            friction,
            ring.radius,
            shape_of(ring, self.tip_radius),
            lobes_of(ring),
            gauge_settings(self.errors, scatter, phase, ring.radius, self.tip_radius),
            core_settings(
                self.problem.limits,
                model,
                ring.radius,
                0.0 if self.gain_scheduling else lag_time(model.part.mass),
            ),
            Clock(exact("tick", self.tick)),
            self.time_max,
            self.scheduler,
            self._control_ticks,
        )
        gap = self.problem.limits.follow_gap if self.start_gap is None else self.start_gap
        return CenteringPart(rig, ring, float(gap), others)

    def _model(self, rng: np.random.Generator) -> PushModel:
        truth = self.problem.model if self.truth is None else self.truth
        return truth if isinstance(truth, PushModel) else checks.kind("truth(rng)", truth(rng), PushModel)

    def _ring(self, rng: np.random.Generator) -> Ring:
        """The ring as put on the table."""
        low, high = self._offsets
        offset, angle = float(rng.uniform(low, high)), float(rng.uniform(-math.pi, math.pi))
        return Ring(self.problem.model.part.radius, offset, angle) if self.ring is None else self.ring


def _check_ring(ring: object, radius: float, most: float) -> None:
    """Refuse a ring of another part, or one that a slide searching within `most` (mm) does not find."""
    given = checks.kind("ring", ring, Ring, " or None")
    if given.radius != radius:
        raise checks.refuse("radius of ring", f"that of the part, {radius:g}", given.radius, "mm")
    out = given.offset + sum(amplitude for amplitude, _ in given.lobes.values())
    if out > most:
        raise checks.refuse(
            "offset and amplitudes of lobes of ring", f"<= offset_max = {most:g} together", out, "mm"
        )
