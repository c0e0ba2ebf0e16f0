"""Detection of angles in degrees that were taken for rad."""

from math import pi

import numpy as np

from centering.circle._fit.limacon import limacon_columns
from sdpgrind.base import units
from sdpgrind.base.checks import Floats

COARSE = 0.75
"""Mean step, rad, from which several turns are refused unless given; chosen: that of the streaming
estimator."""
DOUBTFUL = 0.08
"""Mean step, rad, from which readings of several turns are tried as degrees; chosen: a finer step is
plausible."""
BETTER = 0.25
"""Residual squares as degrees over those as rad, up to which the angles are degrees; chosen: a clear
difference."""
SMALL = 1e-9
"""Residual relative to the largest reading that is rounding; chosen."""


def evidence_of_degrees(angle: Floats, reading: Floats) -> str:
    """Return the evidence for degrees in words; "" if there is none."""
    span = float(angle.max() - angle.min())
    step = span / (angle.size - 1)
    if span <= 4 * pi or step <= DOUBTFUL:
        return ""
    if step > COARSE:
        return f"a mean step of {step:.4g} over {span / (2 * pi):.3g} turns"
    as_rad, as_degrees = _left(angle, reading), _left(units.deg(1.0) * angle, reading)
    least = angle.size * (SMALL * float(np.abs(reading).max())) ** 2
    if as_rad > least and as_degrees < BETTER * as_rad:
        return f"{span / (2 * pi):.3g} turns, of which the readings go on as over {span:.4g} deg,"
    return ""


def _left(angle: Floats, reading: Floats) -> float:
    """Sum of squared residuals of a limacon."""
    columns = limacon_columns(angle)
    return float(np.sum((reading - columns @ np.linalg.lstsq(columns, reading, rcond=None)[0]) ** 2))
