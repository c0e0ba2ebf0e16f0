"""One quantity over the parts: its Kalman filter, the scatter of its readings, the sum that watches it, its alarm."""

from collections import deque
from math import isnan, sqrt

import numpy as np
from scipy.special import ndtri, stdtr

from centering.monitoring._alarm import DriftAlarm, Shock, likely_step
from centering.monitoring._sequential import Cusum
from sdpgrind.identify import RandomWalk

REFERENCE = 0.9
"""Standard deviations: finds a step of 3 sd within 5 parts most often of all, at run lengths of some 1000 to 1e4."""
_HELD = 10  # parts that are watched before their scatter counts as noise, so that a step does not hide itself
FEWEST = 20
"""Innovations that a standard deviation rests on at least: with fewer, limits are so high that little is found."""
_ROUNDED = sqrt(
    12
)  # readings that are rounded to steps are off by one over that of a step, as a standard deviation
_RECENT = 60  # parts back to which the beginning of a step is looked for
_FARTHEST = 37.0  # standard deviations; beyond, probabilities are 0 in floating point


class Tracked:
    """One quantity: its filter (for noise of sd 1, so that a noise still unknown only scales), its sum, its alarm."""

    def __init__(
        self, name: str, unit: str, noise_sd: float | None, *, walk: float, limit: float, widening: float
    ) -> None:
        self._name, self._unit, self._given = name, unit, noise_sd
        self._filter = RandomWalk((name,), walk_variance=walk**2, noise_variance=1.0)
        self._sum, self._limit, self._widening = Cusum(REFERENCE, limit), limit, widening
        self._square, self._learned = 0.0, 0
        self._last, self._step = np.nan, np.inf
        self.rows: list[tuple[float, float, float, float]] = []
        self.restart()

    def restart(self) -> None:
        """Watch from here on; what was learned of the noise is kept."""
        self._filter.reset()
        self._sum.reset()
        self._held: deque[float] = deque()
        self._shocks: deque[Shock] = deque(maxlen=_RECENT)
        self._readings: deque[tuple[int, float]] = deque(maxlen=_RECENT)
        self.alarm: DriftAlarm | None = None

    @property
    def noise_sd(self) -> float:
        """As given, or as learned so far."""
        if self._given is not None:
            return self._given
        if self._learned < FEWEST:
            return np.inf
        steps = self._step / _ROUNDED if self._step < np.inf else 0.0
        return max(sqrt(self._square / self._learned), steps)

    @property
    def level(self) -> tuple[float, float]:
        """Level and its standard deviation."""
        found = self._filter.estimate
        return float(found.value[0]), (self.noise_sd * float(found.sd[0]) if found.ok else np.inf)

    def update(self, part: int, reading: float) -> DriftAlarm | None:
        self._filter.update(reading)
        self._readings.append((part, reading))
        self._see_steps(reading)
        self._sum.limit = self.limit
        watched = self.alarm is None
        side = self._watch(part) if watched else 0
        found = self._filter.estimate
        level = float(found.value[0]) if found.ok else np.nan
        greater = self._sum.up if self._sum.up >= self._sum.down else -self._sum.down
        self.rows.append((reading, level, greater if watched else np.nan, self._sum.limit))
        return self._raise(part, side) if side else None

    @property
    def limit(self) -> float:
        """Of the sum, standard deviations: higher where the noise is learned; infinite as long as it is not."""
        if self._given is not None:
            return self._limit
        return self._limit + self._widening / self._learned if self._learned >= FEWEST else np.inf

    def _see_steps(self, reading: float) -> None:
        """Keep the smallest change from one reading to the next: they may be rounded to steps of that size."""
        if reading != self._last and not isnan(reading + self._last):
            self._step = min(self._step, abs(reading - self._last))
        self._last = self._last if isnan(reading) else reading

    def _watch(self, part: int) -> int:
        """Take the last innovation into the sum, where there is one."""
        innovation, spread = float(self._filter.innovation[0]), float(self._filter.innovation_sd[0])
        if isnan(innovation):
            return 0
        shock = Shock(part, innovation / spread, spread)
        self._shocks.append(shock)
        side = self._sum.update(self._standard(shock.value))
        if side == 0:
            self._learn(shock.value)
        return side

    def _standard(self, value: float) -> float:
        """Value of a standard normal number as far out: of what is known, or by Student's law of what was learned."""
        if self._given is not None:
            return value / self._given
        if not 0 < self.noise_sd < np.inf:
            return 0.0
        tail = float(ndtri(stdtr(self._learned, -abs(value) / self.noise_sd)))
        return float(np.copysign(min(-tail, _FARTHEST), value))

    def _learn(self, value: float) -> None:
        """Put the innovation by; the one of ten parts ago counts as noise now."""
        self._held.append(value)
        if len(self._held) > _HELD:
            self._square += self._held.popleft() ** 2
            self._learned += 1

    def _raise(self, part: int, side: int) -> DriftAlarm:
        """The alarm, and the level from the readings since the step."""
        found, noise = likely_step(self._shocks, side), self.noise_sd
        self._filter.reset()
        for number, reading in self._readings:
            if number >= found.since:
                self._filter.update(reading)
        self.alarm = DriftAlarm(self._name, self._unit, part, found.since, found.size, noise * found.size_sd)
        return self.alarm
