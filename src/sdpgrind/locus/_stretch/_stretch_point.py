"""A point of a stretch."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class StretchPoint:
    """A point of a stretch, or many of them.

    Attributes
    ----------
    controls : dict
        Name of each control to its value.
    hidden : float or array
        Hidden state for which the point is the best one.
    limit : float or array
        P_b there, which is the response there too.
    loop_slope : float or array
        e_s: by what the slack changes along the locus at this hidden state, per unit of the coordinate.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> point = locus.plan(locus.preset("koren-example")).stretch("v").at(3.0)
    >>> round(point.controls["u"], 6), round(point.hidden, 6), round(point.limit, 6)  # without units
    (2.0, 1.0, 7.0)
    """

    controls: dict[str, Any]
    hidden: Any
    limit: Any
    loop_slope: Any
