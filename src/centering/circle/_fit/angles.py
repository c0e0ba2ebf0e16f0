"""Angles in degrees that were taken for rad."""

from math import pi

import numpy as np

from centering.circle._fit.limacon import limacon_columns
from sdpgrind.base import units
from sdpgrind.base.checks import Floats

COARSE = 0.75
"""Mean step, rad, from which on several turns are not believed without being told; as the streaming estimator has it."""
DOUBTFUL = 0.08
"""Mean step, rad, from which on readings of several turns are tried as of degrees."""
BETTER = 0.25
"""Squares left as of degrees over those left as of rad, up to which they are of degrees."""
SMALL = 1e-9


def smell_of_degrees(angle: Floats, reading: Floats) -> str:
    """What speaks for degrees; empty if nothing does."""
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
    """Squares that a limacon leaves."""
    columns = limacon_columns(angle)
    return float(np.sum((reading - columns @ np.linalg.lstsq(columns, reading, rcond=None)[0]) ** 2))
