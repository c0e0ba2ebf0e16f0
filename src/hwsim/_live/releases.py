"""Releases of the fastest controller on an absolute grid, in whole nanoseconds."""

from fractions import Fraction
from typing import NamedTuple

from hwsim._processor.tasks import NANOSECONDS


class Releases(NamedTuple):
    """Instants ``start + k period`` of a monotonic clock; a release inside the run of a step is missed.

    A late step is never followed by a burst: what it missed is gone. A release that falls on the end of a
    step is on time.
    """

    start: int  # ns, monotonic
    tick: Fraction  # s
    period: int  # ticks

    def instant(self, ticks: int) -> int:
        """Monotonic time (ns) of a number of ticks."""
        return self.start + ticks * NANOSECONDS * self.tick.numerator // self.tick.denominator

    def ticks(self, instant: int) -> int:
        """Ticks that have passed at an instant (ns), rounded up."""
        scale = NANOSECONDS * self.tick.numerator
        return -((self.start - instant) * self.tick.denominator // scale)

    def following(self, due: int, now: int) -> int:
        """Ticks of the release to wait for: the one `due`, or the first on the grid from `now` (ns)."""
        if now <= self.instant(due):
            return due
        return -(-self.ticks(now) // self.period) * self.period
