"""Problem of centering: model of the push, limits of the machine, scatter of pushes, tolerance."""

from collections.abc import Mapping
from math import inf, isfinite
from typing import Any, ClassVar, Self

from centering._problem.model import PushModel
from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.doubts.record import Doubts, asked
from sdpgrind.base.quantities import Described, count, custom, described, part, quantity, valued
from sdpgrind.identify import Estimate, Status

_RAPID = 5000.0 / 60.0  # mm/s; source: Mears (2006), 5000 mm/min, the greatest commanded speed of his slide

_SLOWEST = 20.0  # mm/s^2, chosen: no slide accelerates more slowly; a smaller value is in m/s^2
_MICROMETRES = "; units.um(...) for micrometres"
_COARSEST = 0.1  # chosen: share of the greatest offset; with a coarser tolerance hardly a ring needs a push


@described("centering.limits")
class CenteringLimits(Described):
    """Limits of slide, table and controller; the defaults are those of the source.

    Parameters
    ----------
    approach_speed, push_speed_max : float
        Speed of the rapid approach v_r and greatest speed of a push, mm/s.
    slide_speed_max : float
        Greatest speed of the slide, mm/s.
    acceleration_max : float
        Greatest acceleration of the slide, mm/s^2.
    settle_time : float
        Pause between approach and push, s; may be 0.
    safety : float
        Distance left to the rim by the approach, mm.
    follow_gap : float
        Distance from the rim to the pusher tip while the probe follows the rim, mm.
    spindle_speed_max : float
        Greatest speed of the table, rad/s.
    spindle_acceleration_max : float
        Greatest acceleration of the table, rad/s^2.
    sample_time : float
        Sample time of the controller, s.
    stroke_offset_max : float
        Greatest running correction of the stroke, mm.

    Raises
    ------
    ValueError
        When a value is not > 0 (settle_time: < 0) or in another unit, or a speed is above slide_speed_max.

    Examples
    --------
    >>> CenteringLimits().slide_speed_max, CenteringLimits(follow_gap=5.0).follow_gap  # mm/s, mm
    (120.0, 5.0)
    """

    approach_speed: float = quantity("mm/s", above=0, usual=(0.5, 2000.0), typical=80, default=_RAPID)
    push_speed_max: float = quantity("mm/s", above=0, usual=(0.5, 2000.0), typical=80, default=_RAPID)
    slide_speed_max: float = quantity(
        "mm/s",
        above=0,
        below=2000.0,
        hint="; mm/min over 60",
        usual=(0.5, 2000.0),
        typical=120,
        default=120.0,
    )
    acceleration_max: float = quantity("mm/s^2", above=0, default=2560.0)
    settle_time: float = quantity("s", at_least=0, below=5.0, hint="; ms/1000", default=0.05)
    safety: float = quantity(
        "mm", above=0, below=100.0, hint=_MICROMETRES, usual=(0.005, 100.0), typical=0.5, default=0.5
    )
    follow_gap: float = quantity(
        "mm", above=0, below=200.0, hint=_MICROMETRES, usual=(0.1, 200.0), typical=8, default=7.928
    )
    spindle_speed_max: float = quantity(
        "rad/s",
        above=0,
        below=30.0,
        hint="; units.rpm(...) for rev/min",
        usual=(0.05, 30.0),
        typical=10,
        default=units.rpm(100.0),
    )
    spindle_acceleration_max: float = quantity("rad/s^2", above=0, default=10.0)
    sample_time: float = quantity("s", above=0, below=1.0, hint="; ms/1000", default=0.01)
    stroke_offset_max: float = quantity(
        "mm", above=0, below=50.0, hint=_MICROMETRES, usual=(0.001, 50.0), typical=0.5, default=0.5
    )

    def _check(self) -> None:
        speeds = {name: getattr(self, name) for name in ("approach_speed", "push_speed_max")}
        fast = {name: speed for name, speed in speeds.items() if speed > self.slide_speed_max}
        if fast:
            rule = (
                f"<= slide_speed_max = {self.slide_speed_max:g}; lower {'it' if len(fast) == 1 else 'both'}"
            )
            raise checks.refuse(" and ".join(fast), rule, max(fast.values()), "mm/s")
        if self.acceleration_max <= _SLOWEST:
            raise self._refused("acceleration_max", f"> {_SLOWEST:g}; 1000 times m/s^2")


@described("centering.scatter")
class PushScatter(Described):
    """Standard deviations of pushes about the model.

    Parameters
    ----------
    friction_part_sd, friction_push_sd : float
        Of friction from part to part and from push to push of one part, relative; both coefficients vary
        together.
    direction_sd : float
        Of the direction of a push, rad.
    stop_sd : float
        Of the position at which the slide stops, mm.
    measuring_sd : float
        Of the measured offset in each direction, mm.

    Raises
    ------
    ValueError
        When a value is < 0 or in another unit, or a relative one is >= 1.

    Examples
    --------
    >>> PushScatter().friction_part_sd, PushScatter(stop_sd=0.0).stop_sd
    (0.08, 0.0)
    """

    friction_part_sd: float = quantity("relative", at_least=0, default=0.08)
    friction_push_sd: float = quantity("relative", at_least=0, default=0.04)
    direction_sd: float = quantity(
        "rad", at_least=0, below=0.3, hint="; units.deg(...) for degrees", default=units.deg(1.5)
    )
    stop_sd: float = quantity("mm", at_least=0, below=0.1, hint=_MICROMETRES, default=0.5e-3)
    measuring_sd: float = quantity("mm", at_least=0, below=0.1, hint=_MICROMETRES, default=0.3e-3)

    def _check(self) -> None:
        for name in ("friction_part_sd", "friction_push_sd"):
            if getattr(self, name) >= 1:
                raise self._refused(name, "in [0, 1)")


_MACHINE = (
    "slide_speed_max",
    "acceleration_max",
    "follow_gap",
    "spindle_speed_max",
    "spindle_acceleration_max",
)
_DOUBT = (0.8, 1.25)  # chosen: a friction looked up in a table is seldom further off
_HELD = (0.41, 2.46)  # derived: ends of the friction scales that a strategy tabulates, rounded inward
_ESTIMATED = ("mu_static", "mu_kinetic", "viscous_coefficient", "contact_stiffness", "contact_damping")


def checked_range(name: str, value: Any) -> tuple[float, float]:
    """Lowest and highest factor of friction, 1 between them, within the tables of a strategy."""
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise TypeError(f"{name} must be a pair (lowest, highest factor); got {checks.shown(value)}")
    low, high = (checks.number(f"{name}[{k}]", factor) for k, factor in enumerate(value))
    if not 0.0 < low <= 1.0:
        raise checks.refuse(f"{name}[0]", "in (0, 1]: true friction over that of the model", low)
    if not high >= 1.0:
        raise checks.refuse(f"{name}[1]", ">= 1: true friction over that of the model", high)
    if low < _HELD[0] or high > _HELD[1]:
        rule = f"in [{_HELD[0]:g}, {_HELD[1]:g}], the factors that the tables of a strategy hold"
        raise checks.refuse(name, rule, (low, high))
    return low, high


@described("centering.problem")
class CenteringProblem(Described):
    """Bring a ring to the axis of a turning table by pushes, in the least time.

    Parameters
    ----------
    model : PushModel
        Part, contact and friction. `replace` also takes its fields, and those of its part, of limits and of
        scatter.
    limits : CenteringLimits
        Limits of slide, table and controller.
    scatter : PushScatter
        Standard deviations of pushes about the model.
    tolerance : float
        Greatest offset of a centred part, mm; below a tenth of offset_max.
    offset_max : float
        Greatest offset of a part before its first push, mm; smaller than its radius.
    pushes_max : int
        Number of pushes after which a part is given up.
    friction_range : tuple of float
        Lowest and highest factor of the true mean friction over that of the model, for both coefficients,
        unit 1, in [0.41, 2.46]; 1 is between them. Parts scatter about it. The table is kept slow enough for
        the lowest.

    Raises
    ------
    TypeError
        When friction_range is no pair.
    ValueError
        When a value is out of range or in another unit.

    Examples
    --------
    >>> from centering import preset
    >>> problem = preset("printed").replace(mass=0.8, tolerance=0.005)
    >>> problem.model.part.mass, problem.tolerance, problem.quantum_note
    (0.8, 0.005, '')
    >>> problem.replace(spindle_acceleration_max=5.0).limits.spindle_acceleration_max  # rad/s^2
    5.0
    """

    model: PushModel = part(PushModel)
    limits: CenteringLimits = part(CenteringLimits, default_factory=CenteringLimits)
    scatter: PushScatter = part(PushScatter, default_factory=PushScatter)
    tolerance: float = quantity("mm", above=0, usual=(2e-5, 10.0), typical=0.0025, default=0.0025)
    offset_max: float = quantity("mm", above=0, usual=(0.001, 1000.0), typical=10, default=10.0)
    pushes_max: int = count(default=60)
    friction_range: tuple[float, float] = custom(checked_range, "1", default=_DOUBT)
    _inside: ClassVar[tuple[str, ...]] = ("model", "limits", "scatter")

    def _check(self) -> None:
        coarsest = _COARSEST * self.offset_max
        if self.tolerance >= coarsest:
            raise self._refused("tolerance", f"< a tenth of offset_max, {coarsest:g}{_MICROMETRES}")
        if self.offset_max >= self.model.part.radius:
            raise self._refused("offset_max", f"< the radius of the part = {self.model.part.radius:g}")

    @property
    def job(self) -> Mapping[str, tuple[float, str]]:
        """Values that identify part and machine, with their units (kg, mm, mm/s, mm/s^2, rad/s, rad/s^2)."""
        of_part = valued(self.model.part, ("mass", "radius")) | valued(self, ("tolerance",))
        return of_part | valued(self.limits, _MACHINE)

    @property
    def quantum_note(self) -> str:
        """Warning of planners: tolerance below half of `stick_slip_quantum` (mm); else empty."""
        half = self.model.stick_slip_quantum / 2
        if self.tolerance >= half:
            return ""
        return (
            f"the tolerance of {self.tolerance * 1e3:.3g} µm is below half the jump of stick and slip,"
            f" {half * 1e3:.3g} µm: slow pushes alone centre this part by luck only"
        )

    def updated(self, estimate: Estimate) -> Self:
        """Return the problem with what was estimated of a part.

        Parameters
        ----------
        estimate : Estimate
            Values of one or several of ``mu_static``, ``mu_kinetic`` (dimensionless), ``viscous_coefficient``
            (N s/mm), ``contact_stiffness`` (N/mm), ``contact_damping`` (N s/mm). The relative standard
            deviation of ``mu_kinetic``, if there, becomes `PushScatter.friction_part_sd`.

        Raises
        ------
        ValueError
            When the estimation has failed or names another quantity.

        Examples
        --------
        >>> from centering import preset
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
        return (
            changed.replace(scatter=self.scatter.replace(friction_part_sd=spread)) if spread < 1 else changed
        )

    def doubts(self, data: Any) -> Doubts:
        """Return what scans or pushes say about this problem, and what they do not.

        Radius, place, noise and form from a scan; both coefficients of friction from pushes, with the scatter
        of the problem as belief before. The expected time is planned again at both ends of the intervals of
        the friction, on a coarse table: a plan takes some 3 s.

        Parameters
        ----------
        data : pair of arrays, mapping, scan, pushes, log, or table of a log
            As for ``centering.identify``: angle (rad) and reading (mm), or pushes.

        Returns
        -------
        Doubts
            Rows, sentences and stakes; ``print`` shows the page.

        Raises
        ------
        ValueError, TypeError
            For missing or bad data.

        Examples
        --------
        >>> import numpy as np
        >>> from centering import preset
        >>> angle = np.radians(np.arange(0, 360))
        >>> reading = 89.5 + 0.05 * np.cos(angle) + np.random.default_rng(0).normal(0.0, 1e-3, 360)
        >>> found = preset("printed").doubts((angle, reading))
        >>> found["radius"].verdict, found["mu_kinetic"].verdict
        ('agrees', 'not told')
        """
        return asked("centering._doubts.doubts:doubts", self, data)


def _relative_sd(estimate: Estimate) -> float:
    """Relative standard deviation of the kinetic friction; infinite without an estimate of it."""
    if "mu_kinetic" not in estimate.names:
        return inf
    sd = float(estimate.sd[estimate.names.index("mu_kinetic")]) / estimate["mu_kinetic"]
    return sd if isfinite(sd) else inf
