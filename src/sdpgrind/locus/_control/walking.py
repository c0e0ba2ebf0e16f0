"""What a controller on the locus does from sample to sample, and its state."""

import warnings
from collections.abc import Mapping
from functools import cached_property
from math import isfinite, isnan, nan
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.locus._stretch import law_kernels as core
from sdpgrind.locus._stretch.inverse import balanced, hidden_of
from sdpgrind.locus._stretch.stretch import Stretch

SETTLED = 0.05
"""Difference between actual and commanded coordinate, relative, at which a lag counts as settled."""
PATIENCE = 20
"""Samples that are waited at most: a coordinate that never gets there must not stop the control of power."""


class Walking(Stateful):
    """The part of a controller that lives; what it is told stands in its fields."""

    _changing = ("state", "_believed")
    start: Any
    margin: float
    hold: str | float
    lag: float
    at: str | None
    period: float | None
    method: str
    filter: float

    @property
    def stretch(self) -> Stretch:
        """Where it walks, in the units of its user."""
        raise AttributeError

    @property
    def law(self) -> core.WalkLaw:
        """What the compiled core knows, in the user's units."""
        raise AttributeError

    @property
    def start_place(self) -> float:
        """Coordinate of the start, in its unit."""
        raise AttributeError

    @cached_property
    def state(self) -> Floats:
        """State of the compiled core, in the user's units."""
        state = np.zeros(core.STATES)
        core.begin(state, self.start_place, 0.0 if self.lag else self.start_place)
        return state

    @cached_property
    def _believed(self) -> Floats:
        """Hidden state that readings told; NaN before."""
        return np.full(1, nan)

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of the measurement to its unit."""
        return {self.stretch.response: self.stretch.units.get(self.stretch.response, "")}

    @property
    def commands(self) -> Mapping[str, str]:
        """Names of the controls to their units."""
        return {name: self.stretch.units.get(name, "") for name in self.stretch.names}

    @property
    def reports(self) -> Mapping[str, str]:
        """Names of what it reports to their units."""
        stretch = self.stretch
        hidden, response = (stretch.units.get(name, "") for name in (stretch.hidden_name, stretch.response))
        return {"coordinate": stretch.unit, stretch.hidden_name: hidden, "slack": response, "saturated": ""}

    def reset(self) -> None:
        """Begin the next run; a learned start is kept."""
        place = float(self.state[core.PLACE]) if self.start == "learned" else self.start_place
        core.begin(self.state, place, 0.0 if self.lag else place)
        self._believed[:] = nan

    @property
    def command(self) -> dict[str, float]:
        """The controls at the place where it is, in the user's units."""
        return self._commanded(float(self.state[core.PLACE]))

    def _commanded(self, place: float) -> dict[str, float]:
        return dict(
            zip(self.stretch.names, self.stretch.rows(place)[: len(self.stretch.names)].tolist(), strict=True)
        )

    def step(self, **measurement: float) -> dict[str, float]:
        """Return all controls for the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            The response by its name, in its unit (NaN, or without bounds: no reading); the coordinate by its name, where it is
            measured. Others are not used.

        Raises
        ------
        ValueError
            When the response is not among them.
        TypeError
            When it is no number.
        """
        name = self.stretch.response
        if name not in measurement:
            raise ValueError(f"measurement must have {name!r}; got {', '.join(measurement) or 'nothing'}")
        reading = usable(name, measurement[name])
        core.follow(self.state, self.law)
        actual = self._actual(usable(self.stretch.along, measurement.get(self.stretch.along, nan)))
        if self._counts(actual):
            base = float(self.state[core.PLACE]) if actual is None or self.at == "command" else actual
            self._move(reading, base)
            self._watch()
        return self.command

    def _watch(self) -> None:
        """Count readings beyond the limit at an end of the stretch, where nothing is left to give, and say so once a run."""
        self.state[core.HELD] = self.state[core.HELD] + 1.0 if self._saturated and self._slack < 0 else 0.0
        if self.state[core.HELD] == PATIENCE:
            warnings.warn(self._exhausted(), stacklevel=3)

    def _exhausted(self) -> str:
        """What is wrong where the end of the stretch does not keep the limit, and what to do."""
        stretch, place, unit = self.stretch, float(self.state[core.PLACE]), self.reports["slack"]
        inside = stretch.low < place < stretch.high
        way = (
            "its floor is lower"
            if inside
            else f"the curve is planned for a wider range of {stretch.hidden_name}"
        )
        return (
            f"the limit has been exceeded in {PATIENCE} readings in a row, now by {-self._slack:.3g} {unit}".rstrip()
            + f", while {stretch.along} stands at the end of its stretch, {place:.6g} {stretch.unit}".rstrip()
            + f": it can give more where {way}"
        )

    @property
    def _slack(self) -> float:
        """Limit less response of the last reading that counted, in their unit; NaN where there is none."""
        return float(self.state[core.LAST]) + self.margin if self.state[core.UPDATES] else nan

    @property
    def _saturated(self) -> bool:
        """Whether the last reading asked for a place beyond the end at which it stands."""
        place, error = float(self.state[core.PLACE]), float(self.state[core.LAST])
        onward = self.law.direction * error if self.state[core.UPDATES] else 0.0
        return (place <= self.law.low and onward < 0) or (place >= self.law.high and onward > 0)

    def _actual(self, measured: float) -> float | None:
        """The actual coordinate, measured or estimated; None: it is where it is commanded, for all that is known."""
        if self.stretch.along in self.stretch.names and not isnan(measured):
            return float(measured)
        return float(self.state[core.ACTUAL]) if self.lag else None

    def _counts(self, actual: float | None) -> bool:
        """Whether this reading does."""
        if isinstance(self.hold, str):
            place, waited = float(self.state[core.PLACE]), float(self.state[core.WAITED])
            settled = (
                self.hold == "none"
                or actual is None
                or abs(actual - place) <= SETTLED * abs(place)
                or waited >= PATIENCE
            )
            self.state[core.WAITED] = 0.0 if settled else waited + 1.0
            return settled
        assert self.period is not None
        return float(self.state[core.SAMPLES] - 1) * self.period > self.hold + 1e-9 * self.period

    def _move(self, reading: float, base: float) -> None:
        place = float(self.state[core.PLACE])
        row = self.stretch.rows(place)
        n = len(self.stretch.names)
        if self.method == "inversion":
            self._invert(reading, self._controls(row[:n], base), row[n])
        elif base == place:
            core.advance(self.state, self.law, row[n + 1] - self.margin - reading, place)
        else:
            limit = self.stretch.values(self._controls(row[:n], base)[None], row[n : n + 1])[1]
            onward = base if self.law.scheduled else place  # fixed gains add up commands, as (36) does
            core.advance(self.state, self.law, float(limit[0]) - self.margin - reading, onward)

    def _controls(self, controls: Floats, base: float) -> Floats:
        """What is commanded, with the coordinate where it is."""
        actual = controls.copy()
        if self.stretch.along in self.stretch.names:
            actual[self.stretch.names.index(self.stretch.along)] = base
        return actual

    def _invert(self, reading: float, controls: Floats, hidden: float) -> None:
        self.state[core.UPDATES] = float(not isnan(reading))
        if isnan(reading):
            return
        limit = self.stretch.values(controls[None], np.array([hidden]))[1]
        self.state[core.LAST] = float(limit[0]) - self.margin - reading
        state = hidden_of(self.stretch.values, controls[None], np.array([reading]), self.stretch.x)
        believed = self._believed
        believed[:] = state if isnan(believed[0]) else believed + self.filter * (state - believed)
        self.state[core.PLACE] = np.clip(
            balanced(self.stretch, believed, self.margin), self.law.low, self.law.high
        )[0]

    def report(self) -> dict[str, float]:
        """Return its coordinate, the hidden state for which that is the optimum, the slack that it saw last; user's units.

        ``saturated`` is 1 where that reading asked for a place beyond the end of the stretch, at which it stands, else 0.
        """
        place = float(self.state[core.PLACE])
        hidden = float(self.stretch.rows(place)[len(self.stretch.names)])
        return dict(zip(self.reports, (place, hidden, self._slack, float(self._saturated)), strict=True))


def usable(name: str, value: Any) -> float:
    """A reading as a number; NaN where it is none that a controller can go by."""
    if isinstance(value, str) or np.ndim(value) != 0 or value is None:
        raise TypeError(f"{name} must be a number (NaN: no reading); got {value!r}")
    return float(value) if isfinite(value) else nan
