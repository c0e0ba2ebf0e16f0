"""Identification of a part from measured data: its circle, its friction."""

from collections.abc import Callable
from typing import Any, Literal, overload

from centering.circle._fit.estimate import CircleEstimate
from centering.circle._fit.identify import identify_circle
from centering.friction._estimator import identify_friction
from sdpgrind.base import checks
from sdpgrind.identify import Estimate

_WAYS: dict[str, Callable[..., Estimate]] = {"circle": identify_circle, "friction": identify_friction}


@overload
def identify(data: Any, what: Literal["circle"] = "circle", **options: Any) -> CircleEstimate: ...
@overload
def identify(data: Any, what: Literal["friction"], **options: Any) -> Estimate: ...
def identify(data: Any, what: str = "circle", **options: Any) -> Estimate:
    """Estimate from measured data.

    ========== ===================================================== ==================================
    `what`     data                                                  result
    ========== ===================================================== ==================================
    "circle"   spindle angle (rad) and reading (mm), a scan or a log radius, centre (`identify_circle`)
    "friction" pushes: traces, or readings of each                   unit 1 (`identify_friction`)
    ========== ===================================================== ==================================

    Parameters
    ----------
    data : object
        Measured data, see above.
    what : {"circle", "friction"}
        Quantity to estimate.
    **options
        Options of `identify_circle` (tip_radius, loss, method, ...) or `identify_friction` (problem, ...).

    Returns
    -------
    Estimate
        Estimate with covariance and status.

    Raises
    ------
    ValueError, TypeError
        For another `what`, "friction" without a problem, or data that the named function refuses.

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.radians(np.arange(0, 360))
    >>> circle = identify((angle, 61.9 + 0.5 * np.cos(angle)), "circle", method="limacon")
    >>> round(circle.radius, 3), round(circle.offset, 3)  # mm
    (61.9, 0.5)
    """
    way = _WAYS[checks.one_of("what", what, tuple(_WAYS))]
    if way is identify_friction and "problem" not in options:
        raise TypeError(
            'problem must be given for what="friction": the CenteringProblem of the pushes; got none'
        )
    return way(data, **options)
