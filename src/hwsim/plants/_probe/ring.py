"""What the probe feels: a ring with lobes, somewhere on the table, and where a round tip touches it."""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.kernels import probe as kernels
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity

_PLACES = 256  # within an undulation: what is highest there is known to (pi/256)^2/2 = 8e-5 of it
_FEWEST = 1024
_STEEP = 0.5  # of the radius in a radian: 27 degrees between surface and circle
_NEAR = 0.05  # of the radius: tips that nearly bridge are looked at as if they did
_SIDE = 1.45  # rad off the line: further out the tip may touch another lobe from the side first
_SEARCHED = 64  # places within an undulation where the surface is hollow, or not


def within_a_turn(name: str, angle: object) -> float:
    """An angle of at most a turn either way, rad."""
    checked = checks.number(name, angle, "rad")
    if abs(checked) > 2 * math.pi:
        raise checks.refuse(name, "within a turn; units.deg(90) for degrees", checked, "rad")
    return checked


def _checked(name: str, lobes: Any) -> dict[int, tuple[float, float]]:
    """The lobes as plain numbers, in order."""
    if not isinstance(lobes, Mapping):
        rule = "a mapping of undulations per revolution -> (amplitude in mm, phase in rad)"
        raise TypeError(f"{name} must be {rule}; got {checks.shown(lobes)}")
    return {
        checks.count(f"upr of {name}", upr, 2): _lobe(f"{name}[{upr}]", lobes[upr]) for upr in sorted(lobes)
    }


def _lobe(name: str, value: object) -> tuple[float, float]:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise TypeError(f"{name} must be a pair (amplitude in mm, phase in rad); got {checks.shown(value)}")
    amplitude, phase = value
    return checks.nonnegative(f"amplitude of {name}", amplitude, "mm"), checks.number(
        f"phase of {name}", phase, "rad"
    )


@described()
class Ring(Described):
    """A ring on a turning table: what it truly is and where.

    Its surface is at ``radius + sum of amplitude*cos(upr*beta - phase)`` from its centre; the polar angle beta is fixed to the
    part, and counted as the spindle's angle is. The centre is at ``offset*(cos(offset_angle), sin(offset_angle))`` of the table,
    so that the reading of a ring without lobes is largest at the spindle angle `offset_angle`.

    Parameters
    ----------
    radius : float
        Mean radius, mm, > 0.
    offset : float
        Distance of its centre from the spindle's axis, mm; with the lobes' amplitudes below the radius.
    offset_angle : float
        Direction of the centre, rad.
    lobes : mapping, optional
        Undulations per revolution (whole, >= 2) -> (amplitude in mm, phase in rad). The sum of upr times amplitude must be at
        most half the radius: steeper than that no probe can follow.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> ring = Ring(61.94, 3.6, 0.5, lobes={3: (0.000206, 0.0), 43: (0.000235, 1.0)})
    >>> ring.reading([0.5, 0.5 + 3.141592653589793]).round(3)  # mm
    array([65.54, 58.34])
    >>> round(1e3 * ring.roundness, 3)  # µm
    0.881
    """

    radius: float = quantity("mm", above=0, usual=(0.5, 5000.0), typical=60)
    offset: float = quantity("mm", at_least=0, default=0.0)
    offset_angle: float = custom(within_a_turn, "rad", default=0.0)
    lobes: Mapping[int, tuple[float, float]] = custom(_checked, default_factory=dict, hash=False)

    def _check(self) -> None:
        _about_the_axis("offset", self.offset, self)
        steep = sum(upr * amplitude for upr, (amplitude, _) in self.lobes.items())
        if steep > _STEEP * self.radius:
            raise checks.refuse(
                "lobes", f"of upr times amplitude <= {_STEEP * self.radius:g} together", steep, "mm"
            )

    @property
    def center_x(self) -> float:
        """Centre on the table along x, mm."""
        return float(self.offset * math.cos(self.offset_angle))

    @property
    def center_y(self) -> float:
        """Centre on the table along y, mm."""
        return float(self.offset * math.sin(self.offset_angle))

    @cached_property
    def roundness(self) -> float:
        """Peak to valley of the surface about its centre, mm; known to 1 part in 10000.

        The centre is that of the least-squares circle but for second orders of the lobes over the radius.
        """
        if not self.lobes:
            return 0.0
        number = max(_FEWEST, _PLACES * max(self.lobes))
        surface = self.surface(np.arange(number) * (2 * math.pi / number))
        return float(np.ptp(surface))

    def surface(self, part_angle: npt.ArrayLike) -> Floats:
        """Return the distance of the surface from the centre of the part, mm.

        Parameters
        ----------
        part_angle : array
            Polar angles about that centre, rad.

        Examples
        --------
        >>> Ring(50.0, lobes={2: (0.25, 0.0)}).surface([0.0, 1.5707963267948966])  # mm
        array([50.25, 49.75])
        """
        angle = checks.finite_array("part_angle", part_angle, "rad")
        return self.radius + sum(
            (amplitude * np.cos(upr * angle - phase) for upr, (amplitude, phase) in self.lobes.items()),
            np.zeros_like(angle),
        )

    def reading(self, angle: npt.ArrayLike, tip_radius: float = 0.0) -> Floats:
        """Return where a faultless probe finds the surface on its line, mm from the spindle's axis.

        That is the centre of the tip less its radius. The tip's centre runs along the parallel curve of the surface, and is
        solved for to rounding. Where the curve crosses itself, as a valley is narrower than the tip, the outermost branch
        counts: there the tip lies on both flanks.

        Parameters
        ----------
        angle : array
            Spindle angles, rad.
        tip_radius : float
            Of the tip, mm; 0: a point.

        Raises
        ------
        ValueError
            When a value is not finite or the radius negative.

        Examples
        --------
        >>> Ring(61.94, 3.6).reading(1.5707963267948966, tip_radius=3.75).round(6)  # mm; 61.835295 with a point
        np.float64(61.841281)
        """
        return self._contacts(angle, tip_radius)[0]

    def part_angle(self, angle: npt.ArrayLike, tip_radius: float = 0.0) -> Floats:
        """Return where on the part the probe touches: the polar angle about the part's centre, rad; it goes on over turns.

        Parameters
        ----------
        angle : array
            Spindle angles, rad.
        tip_radius : float
            Of the tip, mm; 0: a point.

        Examples
        --------
        >>> Ring(60.0, 6.0).part_angle([0.0, 1.5707963267948966]).round(6)  # rad
        array([0.      , 1.670964])
        """
        return self._contacts(angle, tip_radius)[1]

    def _contacts(self, angle: npt.ArrayLike, tip_radius: float) -> tuple[Floats, Floats]:
        angles = checks.finite_array("angle", angle, "rad")
        reading, part_angle = np.empty(angles.size), np.empty(angles.size)
        shape = shape_of(self, checks.nonnegative("tip_radius", tip_radius, "mm"))
        kernels.contacts(
            shape, lobes_of(self), self.center_x, self.center_y, angles.ravel(), reading, part_angle
        )
        return reading.reshape(angles.shape), part_angle.reshape(angles.shape)


def _about_the_axis(name: str, offset: float, ring: Ring) -> None:
    """Refuse a ring whose centre is so far from the spindle's axis that the axis may be outside."""
    nearest = ring.radius - sum(amplitude for amplitude, _ in ring.lobes.values())
    if offset >= nearest:
        rule = f"< radius less amplitudes of lobes, {nearest:g}: else there is no part at the axis"
        raise checks.refuse(name, rule, offset, "mm")


def moved_by(ring: Ring, x: float, y: float) -> Ring:
    """The ring after it has been moved on the table, by mm."""
    x, y = ring.center_x + x, ring.center_y + y
    _about_the_axis("offset that the part is moved to", math.hypot(x, y), ring)
    return ring.replace(offset=math.hypot(x, y), offset_angle=math.atan2(y, x))


def lobes_of(ring: Ring) -> Floats:
    """Undulations per revolution, amplitude (mm) and phase (rad) of each lobe, for compiled code."""
    rows = [(upr, amplitude, phase) for upr, (amplitude, phase) in ring.lobes.items()]
    return np.array(rows, dtype=float).reshape(-1, 3)


def shape_of(ring: Ring, tip_radius: float) -> Floats:
    """A ring under a tip, for compiled code: can the tip touch at two places, or from the side?"""
    lobes = lobes_of(ring)
    highest = max(ring.lobes, default=0)
    shape = np.zeros(kernels.SHAPE)
    shape[kernels.RADIUS], shape[kernels.TIP] = ring.radius, tip_radius
    shape[kernels.REACH], shape[kernels.UPR_MAX] = lobes[:, 1].sum(), highest
    spread = kernels.least_spread(shape, lobes, _SEARCHED * (highest + 1))
    steepest = (lobes[:, 0] * lobes[:, 1]).sum() / (ring.radius - shape[kernels.REACH])
    side = math.asin(ring.offset / (ring.radius + tip_radius)) + 2 * math.atan(steepest)
    shape[kernels.SCAN] = float(spread < _NEAR * ring.radius or side >= _SIDE)
    return shape
