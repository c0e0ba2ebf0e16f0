"""Readings of a ring over the spindle angle, and their surface in the part frame."""

import dataclasses
from functools import cached_property
from math import copysign, cos, inf
from typing import Any

import numpy as np

from centering.circle._fit.arguments import readings
from centering.circle._fit.estimate import CircleEstimate
from centering.roundness._datum import Datum, axis_of, axis_there
from centering.roundness._form import largest_between
from centering.roundness._harmonic_fit import even_harmonics
from centering.roundness._origin import MEASURED, Origin
from centering.roundness._part_frame import circle_of, into_part, tip_centers
from centering.roundness._sampling import rise, turns_of, unwrapped_turns, widest_gap
from centering.roundness._slope import Slope
from centering.roundness._slope_kernels import steepest_window
from centering.roundness._turn import NOT_GIVEN, placed, refuse_deviations, without_closing
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.plausible import refuse_other_length
from sdpgrind.base.columns.source import Source
from sdpgrind.base.columns.table import Meant, quantity_of

TIP = Meant("mm", 1e-3, 50.0)  # chosen: from a stylus to the roller of a follower

_STEPS = 2  # derived: of the samples; a window below holds no more than its ends


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PartReadings(ByValue):
    """A profile before any step; `Profile` describes the fields (mm, rad)."""

    angle: Floats = dataclasses.field(default_factory=lambda: NOT_GIVEN)
    reading: Floats = dataclasses.field(default_factory=lambda: NOT_GIVEN)
    _: dataclasses.KW_ONLY
    tip_radius: float = 0.0
    internal: bool = False
    plausible: dataclasses.InitVar[bool] = True
    circle: CircleEstimate = dataclasses.field(init=False)
    _origin: Origin = dataclasses.field(default=MEASURED, init=False)

    def __post_init__(self, plausible: bool) -> None:
        angle, reading = readings(*placed(self.angle, self.reading))
        refuse_deviations(reading)
        tip = checks.nonnegative("tip_radius", self.tip_radius, "mm")
        if checks.kind("plausible", plausible, bool):
            refuse_other_length("reading", float(np.median(reading)), quantity_of("reading"))
            refuse_other_length("tip_radius", tip, TIP)
        turn = without_closing(unwrapped_turns(angle), reading)
        object.__setattr__(self, "angle", lasting(turn.angle))
        object.__setattr__(self, "reading", lasting(turn.reading))
        self._note(steps=turn.told)
        object.__setattr__(self, "tip_radius", tip)
        checks.kind("internal", self.internal, bool)
        object.__setattr__(self, "circle", circle_of(self.angle, self.reading, self._tip))

    def _note(self, **changes: Any) -> None:
        """Change the origin of a profile that was just made."""
        object.__setattr__(self, "_origin", dataclasses.replace(self._origin, **changes))

    @property
    def source(self) -> Source | None:
        """Origin of a profile that was read: file, units, factors, rows left out; None: of arrays."""
        return Source.from_json(self._origin.source) if self._origin.source else None

    @property
    def radius(self) -> float | None:
        """Radius of the part's circle, mm; None: not known, as deviations were given without it."""
        return self.circle.radius if self._origin.radius_known else None

    @property
    def _tip(self) -> float:
        """Distance of the tip's centre beyond the surface, mm; negative in a bore."""
        return copysign(self.tip_radius, -1.0 if self.internal else 1.0)

    @cached_property
    def _part_frame(self) -> tuple[Floats, Floats]:
        """Part angle (rad) and distance of the surface from the part's centre (mm)."""
        part_angle, distance = into_part(self.angle, self.reading, self._tip, self.circle.value[1:])
        return lasting(part_angle), lasting(distance - self._tip)

    @property
    def part_angle(self) -> Floats:
        """Angle of the tip's centre about the part's centre, continuous over the turns, (n,), rad."""
        return self._part_frame[0]

    @property
    def radii(self) -> Floats:
        """Distance of the surface from the part's centre, (n,), mm: that of the tip -/+ its radius.

        Raises ValueError where the radius is not known.
        """
        self._need_radius("radii")
        return self._part_frame[1]

    @cached_property
    def deviation(self) -> Floats:
        """Deviation from the part's circle, (n,), mm; positive outside."""
        return lasting(self._part_frame[1] - self.circle.radius)

    @cached_property
    def points(self) -> Floats:
        """Centres of the tip about the spindle axis, (n, 2), mm."""
        return lasting(tip_centers(self.angle, self.reading, self._tip))

    @property
    def removed(self) -> Floats:
        """Readings that were taken out, (m, 2): part angle, rad, and height above the form, mm."""
        return np.column_stack([self._taken_out[0], self._removed[2]])

    @cached_property
    def _taken_out(self) -> tuple[Floats, Floats]:
        """Part angle (rad) and deviation (mm) of readings that were taken out."""
        angle, reading, _ = self._removed
        part_angle, distance = into_part(angle, reading, self._tip, self.circle.value[1:])
        return part_angle, distance - self._tip - self.circle.radius

    @property
    def _removed(self) -> Floats:
        """Spindle angles (rad), readings and heights (mm) of what was taken out, (3, m)."""
        return np.array(self._origin.removed, dtype=float).reshape(-1, 3).T

    @property
    def _removed_points(self) -> Floats:
        """Centres of the tip where readings were taken out, (m, 2), mm."""
        angle, reading, _ = self._removed
        return tip_centers(angle, reading, self._tip)

    @property
    def _seen_gap(self) -> float:
        """Widest angle without a reading, those included that were taken out, rad."""
        return widest_gap(np.append(self.part_angle, self._taken_out[0]))

    @cached_property
    def turns(self) -> float:
        """Turns covered by the angles, including the last step, unit 1."""
        return turns_of(self.part_angle if self._origin.filter else self.angle)

    @property
    def points_per_turn(self) -> float:
        """Samples over turns, unit 1."""
        return self.angle.size / self.turns

    @property
    def nyquist(self) -> float:
        """Half of the measured points of one turn, upr (unit 1): faster waves alias."""
        return self._origin.nyquist or self.points_per_turn / 2

    def radial_runout(
        self, datum: Datum = None, *, heights: float | tuple[float, float, float] | None = None
    ) -> float:
        """Return the circular radial run-out about a datum axis, mm: the range of the readings (ISO 1101).

        With eccentricity e it lies between 2 e - RONt and 2 e + RONt. Unfiltered unless the profile is.

        Parameters
        ----------
        datum : (float, float), Cylinder or (Profile, Profile), optional
            Datum axis: parallel to the spindle axis, relative to it, mm, the axis of a cylinder, or the line
            through the centres of two sections. Default: the spindle axis.
        heights : float or (float, float, float), optional
            Height of this section for a cylinder, mm; of this section and the two of the datum for sections.

        Raises
        ------
        ValueError, TypeError
            For a datum of another kind, or without the heights that it needs; for two sections of one height.

        Examples
        --------
        >>> from centering.roundness import Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> ring = Profile(angle, 30.0 + 0.005 * np.cos(angle) + 0.001 * np.cos(3 * angle))
        >>> round(ring.radial_runout(), 4), round(ring.concentricity(), 4)
        (0.012, 0.01)
        >>> bearings = ring, Profile(angle, 30.0 + 0.001 * np.cos(2 * angle))
        >>> round(ring.radial_runout(bearings, heights=(10.0, 0.0, 20.0)), 4)  # half off that line
        0.007
        """
        if datum is None:
            return float(np.ptp(self.reading))
        axis = axis_there("datum", datum, heights)
        return float(np.ptp(np.hypot(*(self.points - axis).T)))

    def concentricity(self, datum: tuple[float, float] = (0.0, 0.0)) -> float:
        """Return the concentricity of the part's circle to a datum axis, mm: twice its eccentricity.

        The tolerance zone of ISO 1101 is a circle about the datum, whose diameter this is.

        Parameters
        ----------
        datum : (float, float)
            Datum axis relative to the spindle axis, mm.
        """
        return 2 * float(np.hypot(*(self.circle.value[1:] - axis_of("datum", datum))))

    def slope(self, window: float) -> Slope:
        """Return the local slope dfTc: the greatest difference of the deviation in a window, mm.

        Parameters
        ----------
        window : float
            Width of the window in the part angle, rad, below pi; both of its ends count.

        Raises
        ------
        ValueError
            For a window of less than two steps of the samples, or of half a turn or more.
        """
        width, step = checks.positive("window", window, "rad"), 2 * np.pi / self.points_per_turn
        if not _STEPS * step * (1 - 1e-6) <= width < np.pi:
            raise checks.refuse("window", f"{_STEPS * step:.4g}, two steps, ... pi", width, "rad")
        place = np.mod(self.part_angle, 2 * np.pi)
        order = np.argsort(place, kind="stable")
        value, angle, steepest = steepest_window(place[order], self.deviation[order], width)
        return Slope(float(value), float(angle), float(steepest), width)

    def largest_radius(self, about: tuple[float, float] = (0.0, 0.0), *, upr: float | None = None) -> float:
        """Return the largest radius of the part about an axis, mm.

        For a filtered profile the largest between samples too, from its harmonics; else the largest sample,
        plus the possible rise between samples if `upr` is given. Asperities that were taken out count.

        Parameters
        ----------
        about : (float, float)
            Axis relative to the spindle axis, mm.
        upr : float, optional
            Highest undulation of the form, upr. None: no rise between samples.

        Raises
        ------
        ValueError
            When the samples are too far apart to bound the form between them; where the radius is not known.
        """
        self._need_radius("largest_radius")
        axis = axis_of("about", about)
        taken_out = float(np.hypot(*(self._removed_points - axis).T).max(initial=-inf)) - self._tip
        if upr is None and self._origin.filter:
            coef = even_harmonics(self.deviation)[: len(self._origin.sd)]
            return max(largest_between(coef, self.circle.value, self._tip, axis), taken_out)
        largest = max(float(np.hypot(*(self.points - axis).T).max()) - self._tip, taken_out)
        if upr is None:
            return largest
        eccentricity = float(np.hypot(*(self.circle.value[1:] - axis)))
        height = float(np.ptp(np.append(self.deviation, self._taken_out[1])))
        higher = (self.rise_between_samples(upr) - 1) * height / 2
        return largest + higher + eccentricity * (1 - cos(min(self._seen_gap / 2, np.pi)))

    def _need_radius(self, name: str) -> None:
        if not self._origin.radius_known:
            raise ValueError(
                f"{name} needs the radius (mm), which deviations from the tester's own circle do not tell:"
                " give Profile.from_deviation its radius; got None"
            )

    def rise_between_samples(self, upr: float) -> float:
        """Return the height of a form between samples over its largest sampled one, unit 1: sec(upr gap/2).

        For N points on an even turn it is sec(pi upr/N); the widest gap counts. It holds for heights about
        any level.

        Parameters
        ----------
        upr : float
            Highest undulation of the form, upr.

        Raises
        ------
        ValueError
            When the samples are too far apart: a wave of this degree is unbounded between them.
        """
        degree, gap = checks.nonnegative("upr", upr, "upr"), self._seen_gap
        if rise(degree, gap) == inf:
            raise checks.refuse(
                "upr", f"< {np.pi / gap:.6g} for a gap of {np.degrees(gap):.4g} degrees", degree, "upr"
            )
        return rise(degree, gap)
