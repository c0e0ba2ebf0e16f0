"""A centering machine: a ring on a turning table, a slide with a probe and a pusher that bring it to the
axis.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import ClassVar, Self, TypeAlias

import numpy as np

from centering import CenteringProblem, PushScatter
from centering.push import PushModel
from hwsim._part.clock import Clock, exact
from hwsim._processor.scheduler import Scheduler
from hwsim.plants._centering.lag import lag_time
from hwsim.plants._centering.machine import LEAST_FRICTION, CenteringPart, CenteringRig
from hwsim.plants._centering.settings import core_settings, gauge_settings
from hwsim.plants._centering.tasks import control_period, source_tasks
from hwsim.plants._probe.errors import ProbeErrors
from hwsim.plants._probe.ring import Ring, lobes_of, shape_of
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described, flag, part, quantity

Truth: TypeAlias = PushModel | Callable[[np.random.Generator], PushModel] | None
_NEAREST = 0.1  # of the greatest offset: where parts begin, if nobody says


@described()
class CenteringMachine(Described):
    """A ring off the axis of a turning table; a slide follows its rim with a probe and pushes it: Mears
    (2006), chapters 3 and 5.

    Measured, at each sample: ``time`` (s), ``angle`` of the spindle (rad, it goes on over turns; the rim
    stands out furthest where it is that of the offset), ``slide`` (mm from the axis: where the tip of the
    pusher is), ``probe`` (mm from there out to the rim: -follow_gap while following, 0 where the tip touches;
    NaN: beyond its stroke), ``force`` (N) and ``peak_force`` since the sample before, ``spindle_speed``
    (rad/s), ``pushing`` (1 while a profile runs), ``refreshed`` (see `scheduler`). Slide and probe together
    are the reading.

    Taken: ``velocity`` of the slide (mm/s, toward the axis; greater ones are cut), ``profile`` of its motion
    toward the axis (rows of duration in s, velocity in mm/s at its start, acceleration in mm/s^2, or a
    `centering.TipProfile`) that begins at ``profile_angle`` (rad), inside a tick, or at once where none is
    given or it has passed; a profile that waits is replaced by another, or taken back by one of no rows, and
    one that comes while another runs is dropped. A profile is one of speeds: a slide that goes otherwise when
    it begins, or where its speed jumps, joins it at ``acceleration_max``, and the way that it gains or loses
    meanwhile stays. ``spindle_speed`` (rad/s) is reached at limited acceleration. ``retract`` ends the part,
    given up unless ``finished`` is commanded; so does ``finished`` alone.

    Between ticks slide and spindle move in closed form and the ring by the laws of its contact and friction,
    on the turning table, centrifugal and Coriolis forces included; it spins against a table that changes its
    speed while it slides, with the friction of even pressure along a thin ring (the turn of its lobes by that
    is not followed). A tip that the rim runs into without a push (a collision) pushes it, too.

    Outcome of a part: ``time`` (s), ``pushes``, the hidden ``offset`` (mm) once the ring lies still,
    ``said_finished``, ``finished`` (1: said so, and within tolerance), ``timed_out`` (1: cut off at
    ``time_max``), ``slipped`` (1: the table threw the ring), ``lost`` (1: the axis came out of the part),
    ``collisions`` (contacts that begin while no profile runs), ``peak_force`` (N), ``true_mu_static``,
    ``true_mu_kinetic`` of this part, ``overruns`` of tasks, ``worst_response`` (s) of the controller's, and
    ``center_x``, ``center_y`` (mm, on the table) before each push and at the end. The controllers of
    `centering` add ``state``: as what the cycle ended, the number of a `centering.cycle.CycleState` (6:
    centred; 7 and above: why it was given up).

    Parameters
    ----------
    problem : CenteringProblem
        Part, friction, limits, scatter, tolerance.
    truth : PushModel or callable, optional
        What part and friction really are, or a function of a Generator that draws it. None: the problem's own
        model.
    ring : Ring, optional
        The ring as it lies at first, its form included, rather than a place by `start_offset`; its radius is
        that of the part, and nowhere is its rim further than ``problem.offset_max`` from that of a round one
        at the axis.
    start_offset : tuple or float, optional
        Offset at the start, mm: uniform between two, or always the same; at most ``problem.offset_max``.
        None: from a tenth of that on. Its direction is uniform.
    scatter : PushScatter, optional
        How much parts and pushes differ; None: that of the problem.
    errors : ProbeErrors, optional
        What the gauges do not tell truly, beside ``scatter.measuring_sd`` of each reading; None: nothing, not
        even steps of encoders.
    scheduler : Scheduler, optional
        Tasks of the computer: the controller samples when its task, ``control``, starts, and its command
        takes effect when that is complete; ``refreshed`` is 1 where a task ``model`` was completed since the
        last sample. Default: the source's four loops, with execution times that are chosen. None: both at
        once, at each tick.
    tip_radius : float
        Of the probe's roller, mm.
    start_gap : float, optional
        From the tip of the pusher to the rim at the start, mm; None: the problem's follow_gap.
    gain_scheduling : bool
        The gains of the drive go with the load, so that a slide that pushes follows without delay. False: it
        follows late, by a time constant that is calibrated to the source's Table 3.2: 0.24 ms with 0.8 kg,
        2.49 ms with 18.9 kg, linear in mass; tell a controller:
        ``CycleSettings(following_lag=machine.following_lag)``.
    tick : float
        In which time is counted, s.
    time_max : float
        The part is broken off then, s.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be done.

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
        """Where the ring lies at first: no further from the axis than a controller plans for."""
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
                    "start_offset must be left out with a ring, which says where it lies; got "
                    f"{self.start_offset!r} (mm)"
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
        """Ticks between two releases of the controller's task; 1 where nothing schedules it."""
        clock = Clock(exact("tick", self.tick))
        return (
            1
            if self.scheduler is None
            else clock.ticks("period of the task control", control_period(self.scheduler))
        )

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of what is measured."""
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
        """Name -> unit of what can be commanded; of a profile see the class."""
        motion = {"velocity": "mm/s", "profile": "s, mm/s, mm/s^2", "profile_angle": "rad"}
        return {**motion, "retract": "", "spindle_speed": "rad/s", "finished": ""}

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of what became of a part, and the dimension of what is told push by push."""
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
        """Part (kg, mm), tolerance (mm) and limits (mm/s, rad/s) of the problem; `truth` may differ, as
        nobody knows it.
        """
        return self.problem.job

    @property
    def following_lag(self) -> float:
        """How late a slide that pushes the part of the problem follows, s, Mears, Table 3.2; 0 with
        gain_scheduling.
        """
        return 0.0 if self.gain_scheduling else lag_time(self.problem.model.part.mass)

    def with_tick(self, tick: float) -> Self:
        """Return the same plant with another tick.

        Parameters
        ----------
        tick : float
            In which time is counted, s.
        """
        return self.replace(tick=tick)

    def start(self, rng: np.random.Generator) -> CenteringPart:
        """Draw the truth of the next part and return it, at time 0, the table at rest.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random source of this part: the truth, the pushes and the gauges draw from a child each.

        Returns
        -------
        Machine
            See `hwsim.protocols.Machine`; its time is in ticks.
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
        """The ring as it is put on the table."""
        low, high = self._offsets
        offset, angle = float(rng.uniform(low, high)), float(rng.uniform(-math.pi, math.pi))
        return Ring(self.problem.model.part.radius, offset, angle) if self.ring is None else self.ring


def _check_ring(ring: object, radius: float, most: float) -> None:
    """Refuse a ring of another part, or one that a slide which looks for a part within `most` (mm) would not
    find.
    """
    given = checks.kind("ring", ring, Ring, " or None")
    if given.radius != radius:
        raise checks.refuse("radius of ring", f"that of the part, {radius:g}", given.radius, "mm")
    out = given.offset + sum(amplitude for amplitude, _ in given.lobes.values())
    if out > most:
        raise checks.refuse(
            "offset and amplitudes of lobes of ring", f"<= offset_max = {most:g} together", out, "mm"
        )
