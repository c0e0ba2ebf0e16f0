"""What measured data say of a part: where its circle lies, how it slides."""

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
    """Estimate from what was measured.

    ========== ======================================================== ==================================================
    `what`     data                                                     gives
    ========== ======================================================== ==================================================
    "circle"   spindle angle (rad) and reading (mm), or a scan or log   radius and centre (mm), see `identify_circle`
    "friction" pushes: traces, or what was read of each                 both coefficients (unit 1), see `identify_friction`
    ========== ======================================================== ==================================================

    Parameters
    ----------
    data : object
        As the table says.
    what : {"circle", "friction"}
        What is wanted.
    **options
        Those of `identify_circle` (tip_radius, loss, method, ...) or `identify_friction` (problem, ...).

    Returns
    -------
    Estimate
        With its covariance and a status.

    Raises
    ------
    ValueError, TypeError
        For another `what`, "friction" without a problem, or what the function of that name refuses.

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
