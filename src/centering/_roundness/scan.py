"""Samples as the steps of a profile take them."""

import dataclasses

from centering._roundness.runout import Runout
from sdpgrind.base.checks import Floats

TOO_BAD = 1e3
"""Condition beyond which a fit is refused."""


@dataclasses.dataclass(frozen=True)
class Scan:
    """Samples with what is known of them: the circle (radius, x, y; mm) to begin with, runout taken off, noise where known.

    In a bore the tip's radius is less than 0.
    """

    angle: Floats
    reading: Floats
    tip_radius: float
    circle: Floats
    runout: Runout | None
    noise_sd: float | None
