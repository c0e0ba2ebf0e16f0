"""Integer ticks of which every rate of a run is an exact multiple, in rational arithmetic."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import gcd, lcm

import numpy as np

from sdpgrind.base import checks

SMALLEST_TICK = Fraction(1, 1_000_000)  # s; chosen: a finer rate needs hardware
_SIMPLEST = 1_000_000  # largest denominator of a rate; chosen: a microsecond
_ROUNDING = 1e-15  # relative; chosen: above the rounding of a float (1/60), below any chance agreement


@lru_cache(maxsize=256)
def simplest(value: float) -> Fraction:
    """Return the simplest fraction nearest to the float `value` (1/60); its binary value if there is none."""
    fraction = Fraction(value).limit_denominator(_SIMPLEST)
    return fraction if abs(float(fraction) - value) <= _ROUNDING * abs(value) else Fraction(value)


def exact(name: str, seconds: float) -> Fraction:
    """Return the simple fraction (s) of a rate; ValueError where there is none."""
    fraction = simplest(checks.positive(name, seconds, "s"))
    if fraction.denominator > _SIMPLEST:
        raise checks.refuse(
            name, "a whole number of microseconds or a simple fraction such as 1/60", seconds, "s"
        )
    return fraction


def common_tick(rates: Mapping[str, float]) -> Fraction:
    """Return the largest tick (s) of which every rate (name -> s) is a whole multiple."""
    fractions = [exact(name, seconds) for name, seconds in rates.items()]
    tick = Fraction(gcd(*(f.numerator for f in fractions)), lcm(*(f.denominator for f in fractions)))
    if tick < SMALLEST_TICK:
        named = ", ".join(f"{name} = {seconds:.9g} s" for name, seconds in rates.items())
        raise ValueError(f"rates must have a common tick of at least {float(SMALLEST_TICK):g} s; got {named}")
    return tick


@dataclass(frozen=True)
class Clock:
    """Converts ticks to seconds and periods to ticks."""

    tick: Fraction

    def ticks(self, name: str, seconds: float) -> int:
        """Number of ticks in `seconds`; ValueError for a remainder."""
        number = exact(name, seconds) / self.tick
        if number.denominator != 1:
            raise checks.refuse(name, f"a whole number of ticks of {self.tick} s", seconds, "s")
        return number.numerator

    def nearest(self, seconds: float) -> int:
        """Number of ticks nearest to `seconds`."""
        return round(Fraction(seconds) / self.tick)

    def seconds(self, ticks: int) -> float:
        """Correctly rounded seconds of `ticks`."""
        return ticks * self.tick.numerator / self.tick.denominator

    def all_seconds(self, ticks: Sequence[int] | checks.Floats) -> checks.Floats:
        """Correctly rounded seconds of many `ticks`."""
        # both operands are integers below 2^53: one rounding
        return np.array(ticks, dtype=np.int64) * self.tick.numerator / self.tick.denominator
