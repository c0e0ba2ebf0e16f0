"""The steepest place of a profile: the greatest rise within a window."""

from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.results import Result


@described("centering.slope")
class Slope(Described, Result):
    """Local slope dfTc of a profile, the result of `Profile.slope`.

    Makers differ in what they call so: ``value`` counts all points of a window, ``steepest`` its two ends.

    Parameters
    ----------
    value : float
        Greatest difference between highest and lowest deviation within a window, mm.
    angle : float
        Part angle at which this window begins, rad.
    steepest : float
        Greatest difference between both ends of a window, mm.
    window : float
        Width of the window, rad.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile
    >>> from sdpgrind import units
    >>> angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    >>> found = Profile(angle, 30.0 + 0.001 * np.cos(3 * angle)).slope(units.deg(60))
    >>> round(found.value, 6), round(found.steepest, 6)
    (0.002, 0.002)
    """

    value: float = quantity("mm", at_least=0)
    angle: float = quantity("rad")
    steepest: float = quantity("mm", at_least=0)
    window: float = quantity("rad", above=0)
