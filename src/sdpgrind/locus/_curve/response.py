"""Response of an inversion at controls and states; readings that Newton's method alone does not answer."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import nextafter
from typing import TypeAlias

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.inversion_kernels import Search
from sdpgrind.locus._problem import tape_kernels

_POWERS = range(-1, -324, -1)  # derived: of ten, to the least double
_STEPS = 1e4  # chosen: responses of the range, beyond which Newton's method hardly fails
_Places: TypeAlias = list[tuple[int, float]]
"""Numbers of controls, and by what they are scaled."""
_TRIES = 24  # chosen: draws of controls for a reading; of processes tried, one of 15 to 70 has one


@dataclass(frozen=True)
class Response:
    """Response by controls and hidden state; `sizes`: numbers and results of the tape."""

    search: Search
    sizes: tuple[int, int]

    def at(self, controls: Floats, state: float) -> tuple[float, float]:
        """Return the response and its slope by the state, in their units."""
        inputs, work, found = self._room
        inputs[:-1] = controls
        inputs[-1] = state
        tape_kernels.run(self.search.tape, inputs, work, found)
        return found.item(self.search.response), found.item(self.search.slope)

    @cached_property
    def _room(self) -> tuple[Floats, Floats, Floats]:
        """Inputs, numbers and results of the tape, written anew by each run: readings take thousands."""
        inputs = int(self.search.tape[:1].view(np.int64)[0])
        return np.empty(inputs), np.empty(self.sizes[0]), np.empty(self.sizes[1])

    def hard(self, controls: Floats, count: int, rng: np.random.Generator) -> list[list[float]]:
        """Return about `count` readings of each sort, in their units.

        Where a small control takes nearly all influence from the state, or leaves few numbers for the
        response, rounding makes it a flight of steps: Newton's first step passes an end whose response is
        beyond the reading, and a reading within a step is no state's response, so that the bracket closes.
        Where a control is still less, the slope may be infinite.
        """
        flights, steep = self._scales(controls)
        usual = [(0, 1.0)]
        sorts = [(self._beside_an_end, flights or usual), (self._within_a_step, flights), (self._any, steep)]
        return [sort(controls, places, rng) for sort, places in sorts if places for _ in range(count)]

    def _scales(self, controls: Floats) -> tuple[_Places, _Places]:
        """Return where responses are few, and where the slope is infinite."""
        flights: _Places = []
        steep: _Places = []
        for k, power in itertools.product(range(len(controls)), _POWERS):
            place = k, 10.0**power
            (low, slope), (high, _) = self._ends(_scaled(controls, *place))
            if not np.isfinite(slope):
                steep.append(place)
            elif 0.0 < abs(high - low) < _STEPS * np.spacing(abs(low)):
                flights.append(place)
        return flights, steep

    def _ends(self, controls: Floats) -> list[tuple[float, float]]:
        return [self.at(controls, state) for state in (self.search.low, self.search.high)]

    def _beside_an_end(self, controls: Floats, places: _Places, rng: np.random.Generator) -> list[float]:
        """Return a reading next to the response of an end, which the slope at the guess leads beyond it."""
        guess = self.search.guess
        for drawn in _drawn(controls, places, rng):
            end = (self.search.low, self.search.high)[rng.integers(2)]
            response, slope = self.at(drawn, guess)
            reading = nextafter(self.at(drawn, end)[0], response)
            if abs(response - reading) > abs(slope * (guess - end)):
                break
        return [reading, *drawn]

    def _within_a_step(self, controls: Floats, places: _Places, rng: np.random.Generator) -> list[float]:
        """Return a reading between the responses of two neighbours among the states.

        Where no number lies between the responses of a bracket, none does between those of its states.
        """
        for drawn in _drawn(controls, places, rng):
            (first, _), (last, _) = self._ends(drawn)
            low, high = self.search.low, self.search.high
            wanted = rng.uniform(min(first, last), max(first, last))
            while nextafter(first, last) != last and low < (state := 0.5 * (low + high)) < high:
                response = self.at(drawn, state)[0]
                if (response < wanted) == (first < last):
                    low, first = state, response
                else:
                    high, last = state, response
            reading = nextafter(first, last)
            if reading not in (first, last):
                break
        return [reading, *drawn]

    def _any(self, controls: Floats, places: _Places, rng: np.random.Generator) -> list[float]:
        """Return any reading, at controls of which one is scaled."""
        return [float(rng.uniform()), *next(_drawn(controls, places, rng))]


def _drawn(controls: Floats, places: _Places, rng: np.random.Generator) -> Iterator[Floats]:
    """Give controls of which one has some of the scales."""
    for _ in range(_TRIES):
        k, scale = places[rng.integers(len(places))]
        yield _scaled(controls, k, scale * rng.uniform(1.0, 10.0))


def _scaled(controls: Floats, k: int, scale: float) -> Floats:
    found = np.array(controls)
    found[k] *= scale
    return found
