"""Track of one quantity: Kalman filter, noise of its readings, cumulative sum, alarm."""

from collections import deque
from math import isnan, sqrt

import numpy as np
from scipy.special import ndtri, stdtr

from centering.monitoring._alarm import DriftAlarm, Innovation, likely_step
from centering.monitoring._sequential import Cusum
from sdpgrind.identify import RandomWalk

REFERENCE = 0.9  # chosen: finds steps of 3 sd within 5 parts most often, at run lengths of 1000 to 1e4
_DELAY = 10  # chosen: parts before an innovation counts as noise, so that a step does not hide itself
FEWEST = 20  # chosen: least innovations of a learned noise; with fewer, high limits find little
_ROUNDED = sqrt(12)  # derived: step of rounded readings over the standard deviation of the rounding
_RECENT = 60  # chosen: greatest number of parts back to the start of a step
_FARTHEST = 37.0  # derived: standard deviations beyond which probabilities are 0 in floating point


class Tracked:
    """Track of one quantity; its filter has noise of sd 1, so that an unknown noise only scales."""

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
        """Watch from here on with the noise learned so far."""
        self._filter.reset()
        self._sum.reset()
        self._delayed: deque[float] = deque()
        self._innovations: deque[Innovation] = deque(maxlen=_RECENT)
        self._readings: deque[tuple[int, float]] = deque(maxlen=_RECENT)
        self.alarm: DriftAlarm | None = None

    @property
    def noise_sd(self) -> float:
        """Given or learned standard deviation of a reading; inf: too few readings."""
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
        self._note_resolution(reading)
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
        """Limit of the sum, standard deviations: higher with a learned noise, infinite before it is known."""
        if self._given is not None:
            return self._limit
        return self._limit + self._widening / self._learned if self._learned >= FEWEST else np.inf

    def _note_resolution(self, reading: float) -> None:
        """Keep the smallest change between readings, an upper bound of their rounding."""
        if reading != self._last and not isnan(reading + self._last):
            self._step = min(self._step, abs(reading - self._last))
        self._last = self._last if isnan(reading) else reading

    def _watch(self, part: int) -> int:
        """Add the last innovation to the sum."""
        innovation, spread = float(self._filter.innovation[0]), float(self._filter.innovation_sd[0])
        if isnan(innovation):
            return 0
        scaled = Innovation(part, innovation / spread, spread)
        self._innovations.append(scaled)
        side = self._sum.update(self._normal_score(scaled.value))
        if side == 0:
            self._learn(scaled.value)
        return side

    def _normal_score(self, value: float) -> float:
        """Standard normal score of equal tail probability, of Student's distribution for a learned noise."""
        if self._given is not None:
            return value / self._given
        if not 0 < self.noise_sd < np.inf:
            return 0.0
        tail = float(ndtri(stdtr(self._learned, -abs(value) / self.noise_sd)))
        return float(np.copysign(min(-tail, _FARTHEST), value))

    def _learn(self, value: float) -> None:
        """Store the innovation; that of `_DELAY` parts ago now counts as noise."""
        self._delayed.append(value)
        if len(self._delayed) > _DELAY:
            self._square += self._delayed.popleft() ** 2
            self._learned += 1

    def _raise(self, part: int, side: int) -> DriftAlarm:
        """Return the alarm; the level restarts from the readings since the step."""
        found, noise = likely_step(self._innovations, side), self.noise_sd
        self._filter.reset()
        for number, reading in self._readings:
            if number >= found.since:
                self._filter.update(reading)
        self.alarm = DriftAlarm(self._name, self._unit, part, found.since, found.size, noise * found.size_sd)
        return self.alarm
