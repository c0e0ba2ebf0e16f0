"""Datum axes at the height of a section: a place, a cylinder's axis, the line through two sections."""

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from centering.circle._fit.estimate import CircleEstimate
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


class Straight(Protocol):
    """An axis, as of a `Cylinder`."""

    def at(self, height: float) -> tuple[float, float]: ...


class Round(Protocol):
    """A section, as a `Profile`."""

    @property
    def circle(self) -> CircleEstimate: ...


Datum = tuple[float, float] | Straight | tuple[Round, Round] | None
_FORMS = "(x, y) (mm), a Cylinder, or two profiles"


def axis_of(name: str, about: npt.ArrayLike) -> Floats:
    """Return an axis parallel to the spindle axis, relative to it, checked, mm."""
    axis = checks.finite_array(name, about, "mm")
    if axis.shape != (2,):
        raise ValueError(f"{name} must be (x, y) (mm); got {checks.shown(about)}")
    return axis


def axis_there(name: str, datum: Any, heights: Any) -> Floats:
    """Return the place of a datum axis at the height of a section, mm."""
    if hasattr(datum, "at"):
        if not np.isscalar(heights):
            raise ValueError(f"heights must be that of this section for a cylinder (mm); got {heights!r}")
        return np.array(datum.at(checks.number("heights", heights, "mm")))
    if isinstance(datum, tuple) and any(hasattr(each, "circle") for each in datum):
        return _between(name, datum, heights)
    if heights is not None:
        raise ValueError(f"heights must be left out for an axis parallel to the spindle; got {heights!r}")
    if np.shape(datum) != (2,):
        raise ValueError(f"{name} must be {_FORMS}; got {checks.shown(datum)}")
    return axis_of(name, datum)


def _between(name: str, datum: tuple[Any, ...], heights: Any) -> Floats:
    """Place of the line through the centres of two sections at the height of a third."""
    if len(datum) != 2 or not all(hasattr(each, "circle") for each in datum):
        raise TypeError(f"{name} must be {_FORMS}; got {checks.shown(datum)}")
    if np.shape(heights) != (3,):
        raise ValueError(
            f"heights must be of this section and of the two of {name}, as (10.0, 0.0, 20.0) (mm);"
            f" got {checks.shown(heights)}"
        )
    own, low, high = checks.finite_array("heights", heights, "mm").tolist()
    if low == high:
        raise ValueError(f"heights of the two sections of {name} must differ (mm); got {low:g} of both")
    first, second = (each.circle.value[1:] for each in datum)
    return np.asarray(first + (second - first) * (own - low) / (high - low))
