"""A ring with lobes on the table, and its contact with a round tip."""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from centering._plant import probe_kernels as kernels
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity

_PLACES = 256  # in an undulation; derived: its peak is exact to (pi/256)^2/2 = 8e-5 of the amplitude
_FEWEST = 1024  # places in a turn; chosen: as above, with few lobes
_STEEP = 0.5  # largest slope over radius; chosen: 27 degrees between surface and circle
_NEAR = 0.05  # spread over radius; chosen: tips that nearly bridge are treated as bridging
_SIDE = 1.45  # angle off the probe line, rad; chosen: beyond it the tip may touch another lobe first
_SEARCHED = 64  # places in an undulation searched for hollows; chosen: fewer may miss one


def within_a_turn(name: str, angle: object) -> float:
    """An angle within a turn either way, rad."""
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
    """A ring on a turning table: its true form and position.

    Its surface is at ``radius + sum of amplitude*cos(upr*beta - phase)`` from its centre; the polar angle
    beta is fixed to the part and positive as the spindle's angle. The centre is at
    ``offset*(cos(offset_angle), sin(offset_angle))`` of the table: the reading of a ring without lobes is
    largest at the spindle angle `offset_angle`.

    Parameters
    ----------
    radius : float
        Mean radius, mm, > 0.
    offset : float
        Distance of its centre from the spindle's axis, mm; less than the radius minus all amplitudes.
    offset_angle : float
        Direction of the centre, rad.
    lobes : mapping, optional
        Undulations per revolution (whole, >= 2) -> (amplitude in mm, phase in rad). The sum of upr times
        amplitude is at most half the radius: a probe cannot follow steeper ones.

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
        """Peak to valley of the surface about its centre, mm; exact to 1e-4 relative.

        The centre is that of the least-squares circle up to second order in lobes over radius.
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
        """Return the reading of a faultless probe: surface on its line, mm from the spindle's axis.

        It is the centre of the tip minus its radius. The tip's centre is on the parallel curve of the
        surface, solved to rounding; where a valley is narrower than the tip, the outermost branch counts: the
        tip rests on both flanks.

        Parameters
        ----------
        angle : array
            Spindle angles, rad.
        tip_radius : float
            Radius of the tip, mm. 0: a point.

        Raises
        ------
        ValueError
            When a value is not finite or the radius negative.

        Examples
        --------
        >>> Ring(61.94, 3.6).reading(math.pi / 2, tip_radius=3.75).round(6)  # mm; 61.835295 with a point
        np.float64(61.841281)
        """
        return self._contacts(angle, tip_radius)[0]

    def part_angle(self, angle: npt.ArrayLike, tip_radius: float = 0.0) -> Floats:
        """Return the polar angle of the contact about the part's centre, rad, continuous over turns.

        Parameters
        ----------
        angle : array
            Spindle angles, rad.
        tip_radius : float
            Radius of the tip, mm. 0: a point.

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
    """Refuse a ring so far from the spindle's axis that the axis may be outside."""
    nearest = ring.radius - sum(amplitude for amplitude, _ in ring.lobes.values())
    if offset >= nearest:
        rule = f"< radius less amplitudes of lobes, {nearest:g}: else there is no part at the axis"
        raise checks.refuse(name, rule, offset, "mm")


def moved_by(ring: Ring, x: float, y: float) -> Ring:
    """The ring displaced on the table by x and y, mm."""
    x, y = ring.center_x + x, ring.center_y + y
    _about_the_axis("offset that the part is moved to", math.hypot(x, y), ring)
    return ring.replace(offset=math.hypot(x, y), offset_angle=math.atan2(y, x))


def lobes_of(ring: Ring) -> Floats:
    """Undulations per revolution, amplitude (mm) and phase (rad) of each lobe, for compiled code."""
    rows = [(upr, amplitude, phase) for upr, (amplitude, phase) in ring.lobes.items()]
    return np.array(rows, dtype=float).reshape(-1, 3)


def shape_of(ring: Ring, tip_radius: float) -> Floats:
    """A ring under a tip for compiled code, with a flag whether the tip may touch twice or from the side."""
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
