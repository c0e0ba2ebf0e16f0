"""Worst case of a controller under a drifting hidden state, for all sequences of steps up to a rate.

Without overshoot the loop s -> s + k e(s, x) is monotone in s, and a looser state moves it further. The worst
sequence for a state therefore reaches it as late as possible, from a loop settled at the loose end. With
overshoot the furthest successor of all smaller coordinates takes the place of the loop; it is monotone too.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.locus._path.inverse import balanced
from sdpgrind.locus._path.stretch import Stretch

PHASES = 48  # chosen: starts of the ramp within a step; the ends of each part bound its inside
LONGEST = 1000  # chosen: steps of a simulated ramp; slower ones are bounded state by state
LATTICE, STATES = 65, 257  # chosen: places and states of a lattice; fewer loosen the bound
ROOM = 1.002  # chosen: factor on the margin for values between lattice places
# measured: rounds of a margin that grows by what is left of the violation; 24 where it ends at four fifths of
# the greatest limit, 55 where at more than twice that
ROUNDS = 200
NEAR = 1e-9  # chosen: violation left, as share of the margin; ROOM is far more


@dataclass(frozen=True)
class Drift:
    """Loop s -> s + direction k(s) (e - margin); the hidden state drifts from `loose` to `tight`."""

    stretch: Stretch
    loose: float
    tight: float
    rate: float
    gain: Callable[[Floats], Floats]
    floor: float

    @property
    def direction(self) -> float:
        """Direction of falling slack: 1 or -1."""
        return 1.0 if self.stretch.loop_slope[0] < 0 else -1.0

    def moved(self, s: Floats, x: Floats, margin: float) -> Floats:
        """Return the next coordinates."""
        change = self.direction * self.gain(s) * (self.stretch.slack(s, x) - margin)
        return np.asarray(np.clip(s + change, *self.ends))

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest coordinate of the controller."""
        low, high = self.stretch.low, self.stretch.high
        return (self.floor, high) if self.direction > 0 else (low, self.floor)

    def furthest(self, s: Floats, x: Floats, margin: float) -> Floats:
        """Return the furthest next coordinates from anywhere up to `s`."""
        shares = np.linspace(0.0, 1.0, LATTICE)[:, None]
        places = self.floor + shares * (s - self.floor)
        reached = self.direction * self.moved(places, np.broadcast_to(x, places.shape), margin)
        return np.asarray(self.direction * reached.max(axis=0))

    def worst(self, margin: float) -> float:
        """Return a bound on response - limit, with the limit reduced by `margin`."""
        steps = abs(self.tight - self.loose) / self.rate
        return self._by_ramp(margin) if steps <= LONGEST else self._by_state(margin)

    def _start(self, margin: float) -> float:
        """Return the settled coordinate at the loose end."""
        settled = balanced(self.stretch, np.array([self.loose]), margin)
        return float(np.clip(settled, *self.ends)[0])

    def _keeps_order(self, reach: Floats, x: Floats, margin: float) -> bool:
        shares = np.linspace(0.0, 1.0, LATTICE)[:, None]
        places = self.floor + shares * (reach - self.floor)
        moved = self.direction * self.moved(places, np.broadcast_to(x, places.shape), margin)
        return bool(np.all(np.diff(moved, axis=0) >= -1e-12 * (self.stretch.high - self.stretch.low)))

    def _by_ramp(self, margin: float) -> float:
        """Simulate the latest ramp from every phase of its first step."""
        worst, reach, states = self._played(margin, self.moved)
        picked = np.unique(np.linspace(0, len(reach) - 1, 2 * LATTICE).astype(int))
        if self._keeps_order(reach[picked], states[picked], margin):
            return worst
        return self._played(margin, self.furthest)[0]

    def _played(
        self, margin: float, move: Callable[[Floats, Floats, float], Floats]
    ) -> tuple[float, Floats, Floats]:
        way = np.sign(self.tight - self.loose)
        length = abs(self.tight - self.loose)
        phases = self.rate * np.linspace(0.0, 1.0, PHASES + 1)
        s = np.full(PHASES + 1, self._start(margin))
        state = np.full(PHASES + 1, self.loose)
        if move == self.furthest:
            s = np.asarray(self._settled(s[0], margin))
        reach, states = [s], [state]
        for n in range(int(np.ceil(length / self.rate)) + 1):
            s = move(s, state, margin)
            state = self.loose + way * np.minimum(phases + n * self.rate, length)
            reach.append(s)
            states.append(state)
        places, drifted = np.array(reach), np.array(states)
        worst = float(np.max(-self.stretch.slack(places[1:, :-1], drifted[1:, 1:])))
        return worst, places.ravel(), drifted.ravel()

    def _settled(self, first: float, margin: float) -> Floats:
        """Return the furthest settled coordinate at the loose end, with overshoot; the end if it creeps."""
        s, state = np.array([first]), np.array([self.loose])
        for _ in range(LONGEST):
            after = self.furthest(s, state, margin)
            if np.all(np.abs(after - s) <= 1e-12 * (self.stretch.high - self.stretch.low)):
                break
            s = after
        else:
            s = np.full(1, self.ends[self.direction > 0])  # nothing is further
        return np.broadcast_to(s, (PHASES + 1,))

    def _by_state(self, margin: float) -> float:
        """Return the least violation of an invariant set, whatever the state does."""
        states = np.linspace(self.loose, self.tight, STATES)
        bound = self._invariant(states, margin, self.moved)
        if np.isfinite(bound) and self._keeps_order(self._reach(states, bound), states, margin):
            return bound
        return self._invariant(states, margin, self.furthest)

    def _reach(self, states: Floats, bound: float) -> Floats:
        """Return the coordinates up to which the violation is at most `bound`."""
        return np.clip(balanced(self.stretch, states, -bound), *self.ends)

    def _invariant(
        self, states: Floats, margin: float, move: Callable[[Floats, Floats, float], Floats]
    ) -> float:
        low, high = sorted((self.loose, self.tight))
        after = np.clip(states + np.sign(self.tight - self.loose) * self.rate, low, high)

        def excess(bound: float) -> float:
            return (
                float(np.max(-self.stretch.slack(move(self._reach(states, bound), states, margin), after)))
                - bound
            )

        low = -margin
        high = low + float(np.max(-self.stretch.slack(self._reach(states, low), after))) - low
        high += 1e-12 * (1 + abs(high))
        for _ in range(60):
            if excess(high) <= 0:
                break
            low, high = high, high + 2 * (high - low)
        else:
            return np.inf
        if excess(low) > 0:
            high = brentq(excess, low, high, xtol=1e-4 * (high - low), rtol=1e-6)
        return float(high)
