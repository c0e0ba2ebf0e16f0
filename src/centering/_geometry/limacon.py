"""The limacon r = R + d cos psi, Mears (4.4): what its fit to a circle gives, exactly, and how to undo that."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def limacon_reading(angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float) -> Floats:
    """Return the reading of a limacon, mm, Mears (4.4): R + d cos(angle - offset_angle).

    Against the exact curve it lacks d^2 sin^2 psi/(2 R): the mean is too great by d^2/(4 R), and an undulation of 2 per
    revolution and that amplitude is missing, so that form must not be read from what a limacon leaves.

    Parameters
    ----------
    angle : array_like
        Spindle angle, rad.
    radius, offset : float
        Mean radius and amplitude, mm.
    offset_angle : float
        Where the reading is largest, rad.

    Returns
    -------
    array, of the shape of `angle`
        mm.

    Raises
    ------
    ValueError, TypeError
        For a radius that is not > 0, a negative offset, or what is not finite.

    Examples
    --------
    >>> limacon_reading([0.0, np.pi / 2], 61.94, 3.6, 0.0).round(9).tolist()
    [65.54, 61.94]
    """
    turned = checks.finite_array("angle", angle, "rad") - checks.number("offset_angle", offset_angle, "rad")
    mean, amplitude = checks.positive("radius", radius, "mm"), checks.nonnegative("offset", offset, "mm")
    return np.asarray(mean + amplitude * np.cos(turned))
