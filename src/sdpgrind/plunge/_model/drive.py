"""Feed drive and power monitor of a plunge grinder."""

from math import ceil, exp

from sdpgrind.base.quantities import Described, described, quantity

LONGEST_DELAY = 1.0  # chosen: dead time beyond which milliseconds are meant, s

_ROUNDING = 1e-9  # derived: a quotient of two decimal numbers misses its integer by less


@described("plunge.drive")
class Drive(Described):
    """What stands between the command and the wheel, and between the power and its reading.

    Parameters
    ----------
    feed_lag : float
        Time constant of the feed drive, s: dp/dt = (target - p)/feed_lag.
    feed_delay : float
        Dead time of the command, s; whole samples.
    power_lag : float
        Time constant of the power monitor, s.
    command_quantum : float
        Step of the feed drive, mm; the remainder is kept. 0: none.
    idle_power : float
        Power without contact, as the monitor shows it, W. Taken as exact: one that is believed too high by a
        share of the power at the end of the cycle hides damage as a gain that is as much too low, and
        `Uncertainty.power_gain_sd` covers both.

    Raises
    ------
    ValueError
        If a value is negative, or probably in another unit.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> plunge.Drive(feed_lag=0.05, feed_delay=0.04)
    Drive(feed_lag=0.05 s, feed_delay=0.04 s)
    """

    feed_lag: float = quantity("s", at_least=0, usual=(0.0, 5.0), typical=0.05, default=0.0)
    feed_delay: float = quantity("s", at_least=0, usual=(0.0, LONGEST_DELAY), typical=0.05, default=0.0)
    power_lag: float = quantity("s", at_least=0, usual=(0.0, 10.0), typical=0.1, default=0.0)
    command_quantum: float = quantity("mm", at_least=0, usual=(0.0, 0.1), typical=0.001, default=0.0)
    idle_power: float = quantity("W", at_least=0, default=0.0)

    def delay_samples(self, sample_time: float) -> int:
        """Return the dead time in whole samples of `sample_time` (s), rounded up."""
        exact = self.feed_delay / sample_time
        return ceil(exact - _ROUNDING * max(exact, 1.0))

    def power_pole(self, sample_time: float) -> float:
        """Return the pole of the power monitor at `sample_time` (s), unit 1; 0: no lag."""
        return exp(-sample_time / self.power_lag) if self.power_lag else 0.0
