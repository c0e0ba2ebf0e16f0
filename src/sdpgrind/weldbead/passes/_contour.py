"""Contour of a bead, and the contour that leaves a given volume above it; Brown (1988), (6.1) and (6.2)."""

import bisect
import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored


@stored("weldbead.contour")
@dataclasses.dataclass(frozen=True)
class Contour(Frozen):
    """Height along a bead, straight between its points.

    Parameters
    ----------
    x : sequence of float
        Positions along the bead, increasing, mm.
    z : sequence of float
        Heights there, mm, above a level common to all contours of a job.

    Raises
    ------
    ValueError
        When there are fewer than two points, lengths differ, x does not increase, or a value is not finite.

    Examples
    --------
    >>> bead = Contour([0, 10, 20], [1.0, 1.2, 1.0])
    >>> bead.mean, float(bead.at(5.0))
    (1.1, 1.1)
    """

    x: tuple[float, ...]
    z: tuple[float, ...]

    def __init__(self, x: npt.ArrayLike, z: npt.ArrayLike) -> None:
        places, heights = checks.finite_array("x", x, "mm"), checks.finite_array("z", z, "mm")
        if places.ndim != 1 or places.shape != heights.shape:
            raise ValueError(
                f"x and z must be of one length (mm); got shapes {places.shape} and {heights.shape}"
            )
        if places.size < 2:
            raise checks.refuse("x", "at least 2 points", places.size, "mm")
        steps = np.diff(places)
        if np.any(steps <= 0):
            k = int(np.argmax(steps <= 0))
            raise ValueError(f"x must increase (mm); got {places[k]:g} followed by {places[k + 1]:g}")
        object.__setattr__(self, "x", tuple(places.tolist()))
        object.__setattr__(self, "z", tuple(heights.tolist()))

    @property
    def length(self) -> float:
        """Length along the bead, mm."""
        return self.x[-1] - self.x[0]

    @property
    def mean(self) -> float:
        """Mean height, mm."""
        return float(np.trapezoid(self.z, self.x) / self.length)

    def at(self, x: npt.ArrayLike) -> Floats:
        """Return the height, mm, at positions `x`, mm; level beyond the ends."""
        return np.asarray(np.interp(np.asarray(x, dtype=float), self.x, self.z))

    def shifted(self, by: float) -> "Contour":
        """Return the contour raised `by` mm."""
        return Contour(self.x, np.add(self.z, by))

    def plot(self) -> Any:
        """Draw height over position; return the figure."""
        figure, ax = pictures.subplots(1, 1, (8, 2.6))
        ax.plot(self.x, self.z, color=pictures.ACTUAL)
        ax.set(xlabel="position along the bead [mm]", ylabel="height [mm]")
        return figure

    def __repr__(self) -> str:
        return f"Contour({len(self.x)} points, {self.length:g} mm long, mean height {self.mean:.4g} mm)"


def merged(*contours: Contour, low: float, high: float) -> Floats:
    """Return all break points, mm, of several contours inside [low, high], both ends included."""
    x = np.unique(np.concatenate([c.x for c in contours]))
    return np.concatenate([[low], x[(x > low) & (x < high)], [high]])


def volume_between(upper: Contour, lower: Contour, width: float | Contour) -> float:
    """Return the volume above `lower` and below `upper`, mm^3, exact for contours straight between points.

    Parameters
    ----------
    upper, lower : Contour
        Contours; `lower` must reach over all of `upper`.
    width : float or Contour
        Bead width, mm; a contour where it varies along x.

    Examples
    --------
    >>> volume_between(Contour([0, 10], [1, 1]), Contour([0, 10], [0, 2]), 4.0)
    10.0
    """
    if lower.x[0] > upper.x[0] or lower.x[-1] < upper.x[-1]:
        raise ValueError(
            f"lower must reach over upper, {upper.x[0]:g} to {upper.x[-1]:g} mm;"
            f" got {lower.x[0]:g} to {lower.x[-1]:g}"
        )
    x, gap, across = _gap(upper, lower, width)
    return float(_removed(np.zeros(1), x, gap, across)[0])


def _gap(upper: Contour, lower: Contour, width: float | Contour) -> tuple[Floats, Floats, Floats]:
    """Return break points, upper less lower there, and the width, mm."""
    across = width if isinstance(width, Contour) else Contour([upper.x[0], upper.x[-1]], [width, width])
    if min(across.z) <= 0:
        raise checks.refuse("width", "> 0", float(min(across.z)), "mm")
    if across.x[0] > upper.x[0] or across.x[-1] < upper.x[-1]:
        raise ValueError(
            f"width must reach over the bead, {upper.x[0]:g} to {upper.x[-1]:g} mm;"
            f" got {across.x[0]:g} to {across.x[-1]:g}"
        )
    x = merged(upper, lower, across, low=upper.x[0], high=upper.x[-1])
    return x, upper.at(x) - lower.at(x), across.at(x)


def _removed(shift: Floats, x: Floats, gap: Floats, across: Floats) -> Floats:
    """Return the volume, mm^3, above a lower contour raised by each `shift`, mm.

    It is the integral of width * max(0, gap - shift), segment by segment.
    """
    a, b = gap[:-1] - shift[:, None], gap[1:] - shift[:, None]
    left, right, h = across[:-1], across[1:], np.diff(x)
    with np.errstate(invalid="ignore", divide="ignore"):
        # part of the segment at which the sign changes
        cross = np.clip(np.where(a == b, 0.0, a / (a - b)), 0.0, 1.0)
    begin, end = np.where(a > 0, 0.0, cross), np.where(b > 0, 1.0, cross)
    begin = np.where((a <= 0) & (b <= 0), end, begin)
    # The product of two straight lines, from start to end of the segment: Simpson's rule is exact.
    middle = 0.5 * (begin + end)
    product = [np.maximum(0.0, a + t * (b - a)) * (left + t * (right - left)) for t in (begin, middle, end)]
    return np.asarray(np.sum(h * (end - begin) / 6 * (product[0] + 4 * product[1] + product[2]), axis=1))


def contour_shift(bead: Contour, shape: Contour, volume: float, width: float | Contour) -> float:
    """Return the shift, mm, by which `shape` leaves `volume` of the bead above it; Brown (1988), (6.2b).

    The volume is a falling, convex function of the shift: Newton's steps from below never overshoot. Between
    two corners of the bead it is quadratic.

    Parameters
    ----------
    bead : Contour
        Bead as scanned.
    shape : Contour
        Target shape; must reach over all of the bead.
    volume : float
        Volume to remove, mm^3; 0: the shape touches the bead from above.
    width : float or Contour
        Bead width, mm.

    Raises
    ------
    ValueError
        When the volume is negative or the shape does not cover the bead.

    Examples
    --------
    A triangle of half width 10 and height 2 mm: the shift is h - sqrt(V h/(w b)).

    >>> triangle = Contour([0, 10, 20], [0, 2, 0])
    >>> round(contour_shift(triangle, Contour([0, 20], [0, 0]), 10.0, 4.0), 12)
    1.292893218813
    """
    volume = checks.nonnegative("volume", volume, "mm^3")
    if shape.x[0] > bead.x[0] or shape.x[-1] < bead.x[-1]:
        raise ValueError(
            f"the target shape must cover the bead, {bead.x[0]:g} to {bead.x[-1]:g} mm;"
            f" got {shape.x[0]:g} to {shape.x[-1]:g}"
        )
    x, gap, across = _gap(bead, shape, width)
    levels = np.unique(gap)[::-1]
    if volume == 0.0:
        return float(levels[0])
    all_of_it = float(_removed(levels[-1:], x, gap, across)[0])
    if volume >= all_of_it:  # all of the bead is cut: the volume is linear from there on
        return float(levels[-1] - (volume - all_of_it) / np.trapezoid(across, x))
    # The first level below which enough is removed.
    k = bisect.bisect_left(
        range(levels.size), volume, key=lambda i: float(_removed(levels[i : i + 1], x, gap, across)[0])
    )
    return _between(float(levels[k]), float(levels[k - 1]), volume, (x, gap, across))


def _between(low: float, high: float, volume: float, where: tuple[Floats, Floats, Floats]) -> float:
    """Newton's method from below, where the volume is still too large."""
    shift = low
    for _ in range(60):
        excess = float(_removed(np.array([shift]), *where)[0]) - volume
        step = excess / _active(shift, *where)
        if not step > 1e-16 * max(1.0, abs(shift)):
            break
        shift = min(shift + step, high)
    return shift


def _active(shift: float, x: Floats, gap: Floats, across: Floats) -> float:
    """Area, mm^2, where the bead lies above the raised shape: the slope of the falling volume."""
    a, b = gap[:-1] - shift, gap[1:] - shift
    with np.errstate(invalid="ignore", divide="ignore"):
        cross = np.clip(np.where(a == b, 0.0, a / (a - b)), 0.0, 1.0)
    begin, end = np.where(a > 0, 0.0, cross), np.where(b > 0, 1.0, cross)
    begin = np.where((a <= 0) & (b <= 0), end, begin)
    ends = [across[:-1] + t * np.diff(across) for t in (begin, end)]
    return float(np.sum(np.diff(x) * (end - begin) * 0.5 * (ends[0] + ends[1])))
