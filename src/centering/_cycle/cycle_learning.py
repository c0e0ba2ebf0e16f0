"""What a push teaches: how far the part went along the push, and how far beside it."""

from dataclasses import dataclass
from math import cos, hypot, sin

from sdpgrind.base.frozen import Frozen


@dataclass(frozen=True)
class Travel(Frozen):
    """How a part went, from the centres before and after a push.

    Parameters
    ----------
    along, across : float
        Along the direction of the push on the table, and to its left, mm.

    Examples
    --------
    >>> from math import pi
    >>> travel = Travel.between((3.0, 4.0), (0.0, 0.0), towards=0.0)
    >>> travel.along, travel.across, travel.distance  # mm
    (-3.0, -4.0, 5.0)
    """

    along: float
    across: float

    @classmethod
    def between(cls, before: tuple[float, float], after: tuple[float, float], *, towards: float) -> "Travel":
        """Return the travel between two centres (mm) in a push whose direction on the table is `towards` (rad)."""
        x, y = after[0] - before[0], after[1] - before[1]
        return cls(x * cos(towards) + y * sin(towards), y * cos(towards) - x * sin(towards))

    @property
    def distance(self) -> float:
        """Length of the travel, mm."""
        return hypot(self.along, self.across)


class LearnedBias:
    """A constant that shows itself in noise: mean and variance, updated by each sight (a scalar Kalman filter).

    Parameters
    ----------
    sd : float
        Standard deviation before anything was seen, > 0.

    Examples
    --------
    >>> bias = LearnedBias(0.01)
    >>> bias.see(0.02, 0.01)
    >>> bias.value, round(bias.sd, 6)
    (0.01, 0.007071)
    """

    def __init__(self, sd: float) -> None:
        self._start = sd
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self.value, self._variance = 0.0, self._start**2

    @property
    def sd(self) -> float:
        """Standard deviation of the constant."""
        return float(self._variance**0.5)

    def see(self, value: float, sd: float) -> None:
        """Take in one sight.

        Parameters
        ----------
        value, sd : float
            What was seen, and the standard deviation of its noise.
        """
        gain = self._variance / (self._variance + sd * sd)
        self.value += gain * (value - self.value)
        self._variance *= 1.0 - gain
