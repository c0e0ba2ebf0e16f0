"""The four reference circles of a profile (ISO 12181-1): exact, each with what proves it."""

from typing import Any

import numpy as np
import numpy.typing as npt

from centering._roundness import lsc_kernels, mcc_kernels, mic_kernels, mzc_kernels
from centering._roundness.roundness import KINDS, Roundness
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_ROUNDING = 16 * float(np.finfo(float).eps)
"""Of a distance, relative to the size of the profile."""


def reference_circle(
    points: npt.ArrayLike, kind: str = "LSC", *, tip_radius: float = 0.0, noise_sd: float | None = None, filter: str = ""
) -> Roundness:
    """Give a reference circle of a profile and its roundness about it.

    Parameters
    ----------
    points : array, (n, 2)
        Points of the profile, mm; where a round tip has felt it, those of the tip's centre, as its distance to a circle is exact.
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Least squares, minimum circumscribed, maximum inscribed or minimum zone circle.
    tip_radius : float
        Of the tip, mm; taken off the radius.
    noise_sd : float, optional
        Standard deviation of one reading, mm; then `value_sd` is given.
    filter : str
        Which filter the points have been through; passed on.

    Returns
    -------
    Roundness
        The circle, the roundness about it (mm), contacts and what is proved.

    Raises
    ------
    ValueError
        When there are too few points, or they cover less than half a turn.
    """
    xy = _points(points, 4 if checks.one_of("kind", kind, KINDS) == "MZC" else 3)
    middle = xy.mean(axis=0)
    x, y = np.ascontiguousarray((xy - middle).T)
    tolerance = _ROUNDING * float(np.hypot(x, y).max())
    center, radius, contacts, outer = _FIND[kind](x, y, tolerance)
    return Roundness(
        kind, np.add(center, middle), radius - tip_radius, contacts, outer, 0.0, xy, tip_radius=tip_radius, filter=filter
    )


def _points(points: npt.ArrayLike, least: int) -> Floats:
    xy = checks.finite_array("points", points, "mm")
    if xy.ndim != 2 or xy.shape[1] != 2:
        raise ValueError(f"points must be of shape (n, 2) (mm); got {xy.shape}")
    if len(xy) < least:
        raise ValueError(f"points must be at least {least}; got {len(xy)}")
    return xy


def _least_squares(x: Floats, y: Floats, tolerance: float) -> Any:
    cx, cy = lsc_kernels.algebraic_centre(x, y)
    if np.isinf(cx):
        raise ValueError("points must not lie on a line")
    cx, cy, radius = lsc_kernels.least_squares_circle(x, y, cx, cy)
    return (cx, cy), radius, (), ()


def _circumscribed(x: Floats, y: Floats, tolerance: float) -> Any:
    basis = np.zeros(3, dtype=np.int64)
    cx, cy, radius, size = mcc_kernels.smallest_circle(x, y, tolerance, basis)
    return (cx, cy), radius, basis[:size], (True,) * size


def _inscribed(x: Floats, y: Floats, tolerance: float) -> Any:
    start = _least_squares(x, y, tolerance)[0]
    basis = np.zeros(3, dtype=np.int64)
    fixed = mic_kernels.three_about(x, y, *start, basis)
    cx, cy, radius, done = mic_kernels.empty_circle(x, y, tolerance, basis)
    if not (fixed and done):
        raise ValueError("points must hold an inscribed circle from all sides; here nothing fixes it")
    return (cx, cy), radius, basis, (False,) * 3


def _zone(x: Floats, y: Floats, tolerance: float) -> Any:
    cx, cy = _least_squares(x, y, tolerance)[0]
    basis = _alternating(x - cx, y - cy)
    cx, cy, outside, inside, done = mzc_kernels.zone(x, y, tolerance, basis)
    if not done:
        raise ValueError("the exchange has not come to an end")
    return (cx, cy), 0.5 * (outside + inside), basis, (True, True, False, False)


def _alternating(x: Floats, y: Floats) -> Any:
    """Two outer and two inner points that alternate: the highest and lowest of four sectors."""
    radius = np.hypot(x, y)
    sectors = np.array_split(np.argsort(np.arctan2(y, x)), 4)
    high, low = [s[np.argmax(radius[s])] for s in sectors[::2]], [s[np.argmin(radius[s])] for s in sectors[1::2]]
    return np.array(high + low)


_FIND: dict[str, Any] = {"LSC": _least_squares, "MCC": _circumscribed, "MIC": _inscribed, "MZC": _zone}
