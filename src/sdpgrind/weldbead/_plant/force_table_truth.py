"""Hidden truth of the force table: drawn coefficients of the process, and the motor of the disc."""

import numpy as np

from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.units import hz
from sdpgrind.weldbead.passes import TiltedDisc
from sdpgrind.weldbead.sequence._coefficient_scatter import CoefficientScatter

_GUARD_SPEED = 0.7236067977499789  # over free speed; derived: (1 + sqrt(0.2))/2 gives 80 % of the peak power


def drawn_disc(scatter: CoefficientScatter, disc: TiltedDisc, rng: np.random.Generator) -> TiltedDisc:
    """A disc with drawn coefficients of its process."""
    return disc.replace(model=scatter.drawn(disc.model, rng))


@described()
class Motor(Described):
    """Motor of the disc, where it differs from the process.

    Parameters
    ----------
    free_speed : float
        Speed without load, rad/s.
    speed_droop : float
        Loss of speed with torque, rad/(s N mm).
    spin_time : float
        Time constant of the spin, s. 0: none.
    guard : float
        Spin over free speed below which the platform does not rise, unit 1. 0: no guard.
    stall : float
        Spin over free speed below which the motor has stalled and the pass is broken off, unit 1.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> round(Motor.air().free_speed / 6.283185307179586, 6)  # Hz
    50.0
    """

    free_speed: float = quantity("rad/s", above=0, usual=(10.0, 5000.0), typical=300)
    speed_droop: float = quantity("rad/(s N mm)", at_least=0, default=0.0)
    spin_time: float = quantity("s", at_least=0, default=0.05)
    guard: float = quantity("1", at_least=0, at_most=1, default=0.0)
    stall: float = quantity("1", at_least=0, at_most=1, default=0.3)

    @classmethod
    def air(cls) -> "Motor":
        """Return an air motor: 50 Hz free, 20 Hz at 90 N (assumed; rad/s, N mm), guard at 80 % of peak power.

        Examples
        --------
        >>> motor = Motor.air()
        >>> round(motor.free_speed**2 / (4000 * motor.speed_droop), 1)  # greatest power, W
        300.5
        """
        return cls(hz(50.0), 0.0821, guard=_GUARD_SPEED)
