"""Sensors and actuators between a controller and the physics of a plant: noise, quantization.

They are immutable descriptions; state and random numbers are arguments.
"""

import math

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, count, custom, described, quantity

__all__ = ["Gauge", "Scanner"]


def __dir__() -> list[str]:
    """Public names only, as of packages."""
    return sorted(__all__)


@described()
class Gauge(Described):
    """A reading with white noise, rounded to steps.

    Parameters
    ----------
    noise_sd : float
        Standard deviation of the noise, unit of the reading.
    relative_sd : float
        Standard deviation of the noise proportional to the value, relative.
    quantum : float
        Step of the reading, in its unit. 0: none.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> Gauge(quantum=0.25).read(1.3, 0.0)  # mm
    1.25
    """

    noise_sd: float = custom(checks.nonnegative, default=0.0)  # custom: the unit is that of the reading
    relative_sd: float = quantity("1", at_least=0, default=0)
    quantum: float = custom(checks.nonnegative, default=0.0)

    def read(self, value: float, normal: float) -> float:
        """Return the reading (unit of the value).

        Parameters
        ----------
        value : float
            True value.
        normal : float
            Standard normal random number, dimensionless.

        Examples
        --------
        >>> Gauge(noise_sd=0.1).read(1.0, -1.0)  # N
        0.9
        """
        shown = value + (self.noise_sd + self.relative_sd * abs(value)) * normal
        return self.quantum * math.floor(shown / self.quantum + 0.5) if self.quantum else shown


@described()
class Scanner(Described):
    """Scans a profile on an even grid along several tracks and returns their mean.

    Parameters
    ----------
    spacing : float
        Distance between two readings, mm.
    tracks : int
        Number of averaged tracks.
    noise_sd : float
        Standard deviation of one reading, mm.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> x, z = Scanner(noise_sd=0.0).scan(np.array([0.0, 1.0]), np.array([0.0, 2.0]), rng)
    >>> z  # mm
    array([0. , 0.5, 1. , 1.5, 2. ])
    """

    spacing: float = quantity("mm", above=0, usual=(0.001, 100.0), typical=0.25, default=0.25)
    tracks: int = count(default=3)
    noise_sd: float = quantity("mm", at_least=0, default=0.01)

    def grid(self, first: float, last: float) -> Floats:
        """Return the positions of the readings, both ends included.

        Parameters
        ----------
        first, last : float
            Ends, mm.

        Examples
        --------
        >>> Scanner(spacing=0.5).grid(0.0, 1.2)  # the spacing is fitted to the length
        array([0. , 0.6, 1.2])
        """
        return np.linspace(first, last, max(2, 1 + round((last - first) / self.spacing)))

    def scan(self, x: Floats, z: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Return the positions of the readings and the mean of the tracks there.

        Parameters
        ----------
        x, z : array
            The profile, mm.
        rng : numpy.random.Generator
            Random source of the noise.

        Examples
        --------
        >>> import numpy as np
        >>> rng = np.random.default_rng(0)
        >>> x, z = Scanner(noise_sd=0.03).scan(np.array([0.0, 100.0]), np.zeros(2), rng)
        >>> x.size, bool(0.014 < z.std() < 0.020)  # 0.03/3^(1/2) mm
        (401, True)
        """
        at = self.grid(float(x[0]), float(x[-1]))
        noise = rng.standard_normal((self.tracks, at.size)).mean(axis=0)
        return at, np.interp(at, x, z) + self.noise_sd * noise
