"""Checks of arguments of fits and estimators."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def radius_and_sd(prior: tuple[float, float], tip_radius: float) -> tuple[float, float]:
    """Radius with the tip, and its standard deviation, mm."""
    if not isinstance(prior, tuple | list) or len(prior) != 2:
        raise TypeError(
            f"radius_prior must be a pair: radius and its standard deviation (mm); got {checks.shown(prior)}"
        )
    return checks.positive("radius_prior[0]", prior[0], "mm") + tip_radius, checks.positive(
        "radius_prior[1]", prior[1], "mm"
    )


def pairs(angle: npt.ArrayLike, reading: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Float arrays of one length; the kernels check the values."""
    angles, readings = _floats("angle", angle, "rad"), _floats("reading", reading, "mm")
    if angles.ndim != 1 or angles.shape != readings.shape:
        shapes = f"{angles.shape} and {readings.shape}"
        raise ValueError(f"angle and reading must be one-dimensional of one length; got {shapes}")
    return angles, readings


def _floats(name: str, values: npt.ArrayLike, unit: str) -> Floats:
    """Float array, which may hold NaN."""
    try:
        return np.ascontiguousarray(values, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be numbers ({unit}); got {checks.shown(values)}") from None


def flag(name: str, value: object) -> bool:
    """A value that must be True or False."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False; got {checks.shown(value)}")
    return bool(value)
