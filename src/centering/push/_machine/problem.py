"""What is to be centred: the model of the push, the machine's limits, how much pushes scatter, how near is near enough."""

import dataclasses
from collections.abc import Mapping
from math import inf, isfinite
from typing import ClassVar, Self

from centering.push._machine.model import PushModel, below
from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.identify import Estimate, Status

_RAPID = 5000.0 / 60.0  # mm/s: 5000 mm/min, the fastest that the source's slide is told to go

_SPEEDS = ("approach_speed", "push_speed_max", "slide_speed_max")
_OTHERS = {
    "acceleration_max": "mm/s^2",
    "safety": "mm",
    "follow_gap": "mm",
    "spindle_speed_max": "rad/s",
    "spindle_acceleration_max": "rad/s^2",
    "sample_time": "s",
    "stroke_offset_max": "mm",
}
# What no machine reaches: number, unit, what was meant then.
_TOO_MUCH = {
    "slide_speed_max": (2000.0, "mm/s", "mm/min over 60"),
    "settle_time": (5.0, "s", "ms/1000"),
    "safety": (100.0, "mm", "units.um(...) for micrometres"),
    "follow_gap": (200.0, "mm", "units.um(...) for micrometres"),
    "spindle_speed_max": (30.0, "rad/s", "units.rpm(...) for rev/min"),
    "sample_time": (1.0, "s", "ms/1000"),
    "stroke_offset_max": (50.0, "mm", "units.um(...) for micrometres"),
}
_SLOWEST = 20.0  # mm/s^2
_SCATTERED = {
    "direction_sd": (0.3, "rad", "units.deg(...) for degrees"),
    "stop_sd": (0.1, "mm", "units.um(...) for micrometres"),
    "measuring_sd": (0.1, "mm", "units.um(...) for micrometres"),
}
_COARSEST = 0.1  # of the greatest offset: a ring that is centred to that needs no push


@stored("centering.limits")
@dataclasses.dataclass(frozen=True)
class CenteringLimits(Frozen):
    """What slide, table and controller can do; the defaults are those of the source.

    Parameters
    ----------
    approach_speed, push_speed_max : float
        Speed of the rapid approach v_r, and the greatest of a push, mm/s.
    slide_speed_max : float
        Greatest speed of the slide, mm/s.
    acceleration_max : float
        Greatest acceleration of the slide, mm/s^2.
    settle_time : float
        Pause between approach and push, s; may be 0.
    safety : float
        Distance that the approach leaves before the rim, mm.
    follow_gap : float
        Distance from the rim to the pusher tip while the probe follows, mm.
    spindle_speed_max : float
        rad/s.
    spindle_acceleration_max : float
        rad/s^2.
    sample_time : float
        Of the controller, s.
    stroke_offset_max : float
        Greatest running correction of the stroke, mm.

    Raises
    ------
    ValueError
        When a value is not > 0 (settle_time: < 0), a speed is above slide_speed_max, or a value smells of another unit.

    Examples
    --------
    >>> CenteringLimits().slide_speed_max, CenteringLimits(follow_gap=5.0).follow_gap  # mm/s, mm
    (120.0, 5.0)
    """

    approach_speed: float = _RAPID
    push_speed_max: float = _RAPID
    slide_speed_max: float = 120.0
    acceleration_max: float = 2560.0
    settle_time: float = 0.05
    safety: float = 0.5
    follow_gap: float = 7.928
    spindle_speed_max: float = units.rpm(100.0)
    spindle_acceleration_max: float = 10.0
    sample_time: float = 0.01
    stroke_offset_max: float = 0.5

    def __post_init__(self) -> None:
        speeds = {name: checks.positive(name, getattr(self, name), "mm/s") for name in _SPEEDS}
        fast = {name: speed for name, speed in speeds.items() if speed > self.slide_speed_max}
        if fast:
            rule = f"<= slide_speed_max = {self.slide_speed_max:g}; lower {'it' if len(fast) == 1 else 'both'}"
            raise checks.refuse(" and ".join(fast), rule, max(fast.values()), "mm/s")
        for name, unit in _OTHERS.items():
            checks.positive(name, getattr(self, name), unit)
        checks.nonnegative("settle_time", self.settle_time, "s")
        for name, (most, unit, hint) in _TOO_MUCH.items():
            below(name, getattr(self, name), most, unit, hint)
        if self.acceleration_max <= _SLOWEST:
            raise checks.refuse("acceleration_max", f"> {_SLOWEST:g}; 1000 times m/s^2", self.acceleration_max, "mm/s^2")


@stored("centering.scatter")
@dataclasses.dataclass(frozen=True)
class PushScatter(Frozen):
    """How much pushes differ, as standard deviations.

    Parameters
    ----------
    friction_part_sd, friction_push_sd : float
        Of the friction from part to part, and from push to push of a part, relative; both coefficients move together.
    direction_sd : float
        Of the direction of a push, rad.
    stop_sd : float
        Of the place where the slide stops, mm.
    measuring_sd : float
        Of a measured offset, in each direction, mm.

    Raises
    ------
    ValueError
        When a value is < 0 or smells of another unit, or a relative one is >= 1.

    Examples
    --------
    >>> PushScatter().friction_part_sd, PushScatter(stop_sd=0.0).stop_sd
    (0.08, 0.0)
    """

    friction_part_sd: float = 0.08
    friction_push_sd: float = 0.04
    direction_sd: float = units.deg(1.5)
    stop_sd: float = 0.5e-3
    measuring_sd: float = 0.3e-3

    def __post_init__(self) -> None:
        for name in ("friction_part_sd", "friction_push_sd"):
            if checks.nonnegative(name, getattr(self, name), "relative") >= 1:
                raise checks.refuse(name, "in [0, 1)", getattr(self, name), "relative")
        for name, (most, unit, hint) in _SCATTERED.items():
            below(name, checks.nonnegative(name, getattr(self, name), unit), most, unit, hint)


_MACHINE = {
    "slide_speed_max": "mm/s",
    "acceleration_max": "mm/s^2",
    "follow_gap": "mm",
    "spindle_speed_max": "rad/s",
    "spindle_acceleration_max": "rad/s^2",
}
_ESTIMATED = ("mu_static", "mu_kinetic", "viscous_coefficient", "contact_stiffness", "contact_damping")


@stored("centering.problem")
@dataclasses.dataclass(frozen=True)
class CenteringProblem(Frozen):
    """Bring a ring to the axis of a turning table by pushes, in the least time.

    Parameters
    ----------
    model : PushModel
        Part, contact and friction; `replace` takes its fields too, and those of its part, of limits and scatter.
    limits : CenteringLimits
        Of slide, table and controller.
    scatter : PushScatter
        How much pushes differ.
    tolerance : float
        Offset at which a part is centred, mm; below a tenth of offset_max.
    offset_max : float
        Greatest offset that a part begins with, mm; smaller than its radius.
    pushes_max : int
        After so many pushes a part is given up.

    Raises
    ------
    ValueError
        When a value is out of range, or smells of another unit.

    Examples
    --------
    >>> from centering.push._machine.presets import preset
    >>> problem = preset("printed").replace(mass=0.8, tolerance=0.005)
    >>> problem.model.part.mass, problem.tolerance, problem.quantum_note
    (0.8, 0.005, '')
    >>> problem.replace(spindle_acceleration_max=5.0, stop_sd=0.001).limits.spindle_acceleration_max  # rad/s^2
    5.0
    """

    model: PushModel
    limits: CenteringLimits = dataclasses.field(default_factory=CenteringLimits)
    scatter: PushScatter = dataclasses.field(default_factory=PushScatter)
    tolerance: float = 0.0025
    offset_max: float = 10.0
    pushes_max: int = 60
    _inside: ClassVar[tuple[str, ...]] = ("model", "limits", "scatter")

    def __post_init__(self) -> None:
        checks.kind("model", self.model, PushModel)
        checks.kind("limits", self.limits, CenteringLimits)
        checks.kind("scatter", self.scatter, PushScatter)
        checks.positive("tolerance", self.tolerance, "mm")
        checks.count("pushes_max", self.pushes_max)
        coarsest = _COARSEST * checks.positive("offset_max", self.offset_max, "mm")
        if self.tolerance >= coarsest:
            rule = f"< a tenth of offset_max, {coarsest:g}; units.um(...) for micrometres"
            raise checks.refuse("tolerance", rule, self.tolerance, "mm")
        if self.offset_max >= self.model.part.radius:
            raise checks.refuse("offset_max", f"< the radius of the part = {self.model.part.radius:g}", self.offset_max, "mm")

    @property
    def job(self) -> Mapping[str, tuple[float, str]]:
        """What tells part and machine from others, with units: mass kg, lengths mm, speeds mm/s and rad/s, and so on."""
        part = {
            "mass": (self.model.part.mass, "kg"),
            "radius": (self.model.part.radius, "mm"),
            "tolerance": (self.tolerance, "mm"),
        }
        return part | {name: (float(getattr(self.limits, name)), unit) for name, unit in _MACHINE.items()}

    @property
    def quantum_note(self) -> str:
        """What planners warn of: a tolerance below half the jump of stick and slip (both mm), in a sentence; else nothing."""
        half = self.model.stick_slip_quantum / 2
        if self.tolerance >= half:
            return ""
        return (
            f"the tolerance of {self.tolerance * 1e3:.3g} µm is below half the jump of stick and slip,"
            f" {half * 1e3:.3g} µm: slow pushes alone centre this part by luck only"
        )

    def updated(self, estimate: Estimate) -> Self:
        """Return the problem with what was learned of a part: the loop from log back to model.

        Parameters
        ----------
        estimate : Estimate
            Values of ``mu_static``, ``mu_kinetic`` (dimensionless), ``viscous_coefficient`` (N s/mm), ``contact_stiffness``
            (N/mm) or ``contact_damping`` (N s/mm), or several. Where ``mu_kinetic`` is among them, its relative standard
            deviation becomes `PushScatter.friction_part_sd`.

        Raises
        ------
        ValueError
            When the estimation has failed, or names something else.

        Examples
        --------
        >>> from centering.push._machine.presets import preset
        >>> from sdpgrind.identify import Estimate
        >>> found = preset("printed").updated(Estimate(("mu_kinetic",), [0.16], [[0.0016**2]]))
        >>> found.model.mu_kinetic, round(found.scatter.friction_part_sd, 6)
        (0.16, 0.01)
        """
        checks.kind("estimate", estimate, Estimate, ", as FrictionEstimator gives it")
        if estimate.status in (Status.NOT_IDENTIFIED, Status.IMPOSSIBLE):
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        for name in estimate.names:
            checks.one_of("estimate.names", name, _ESTIMATED)
        changed = self.replace(**{name: estimate[name] for name in estimate.names})
        spread = _relative_sd(estimate)
        return changed.replace(scatter=self.scatter.replace(friction_part_sd=spread)) if spread < 1 else changed


def _relative_sd(estimate: Estimate) -> float:
    """Relative standard deviation of the kinetic friction; infinite where nothing is said of it."""
    if "mu_kinetic" not in estimate.names:
        return inf
    sd = float(estimate.sd[estimate.names.index("mu_kinetic")]) / estimate["mu_kinetic"]
    return sd if isfinite(sd) else inf
