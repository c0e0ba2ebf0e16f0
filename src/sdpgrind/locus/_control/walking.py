"""Step, state and report of a controller on the locus."""

import warnings
from collections.abc import Mapping
from functools import cached_property
from math import isnan, nan
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.locus._control.readings import PATIENCE, counted, settled, usable
from sdpgrind.locus._path import law_kernels as core
from sdpgrind.locus._path.inverse import balanced, hidden_of
from sdpgrind.locus._path.stretch import Stretch


class Walking(Stateful):
    """State and step of a controller; its parameters are fields of the subclass."""

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
        """The stretch of the locus, in the user's units."""
        raise AttributeError

    @property
    def law(self) -> core.WalkLaw:
        """Parameters of the compiled kernels, in the user's units."""
        raise AttributeError

    @property
    def start_place(self) -> float:
        """Initial coordinate, in its unit."""
        raise AttributeError

    @cached_property
    def state(self) -> Floats:
        """State of the compiled kernels, in the user's units."""
        state = np.zeros(core.STATES)
        core.begin(state, self.start_place, 0.0 if self.lag else self.start_place)
        return state

    @cached_property
    def _believed(self) -> Floats:
        """Estimated hidden state (1,); NaN before the first reading."""
        return np.full(1, nan)

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of the measured response to its unit."""
        return {self.stretch.response: self.stretch.units.get(self.stretch.response, "")}

    @property
    def commands(self) -> Mapping[str, str]:
        """Name of each control to its unit."""
        return {name: self.stretch.units.get(name, "") for name in self.stretch.names}

    @property
    def reports(self) -> Mapping[str, str]:
        """Name of each reported value to its unit."""
        stretch = self.stretch
        hidden, response = (stretch.units.get(name, "") for name in (stretch.hidden_name, stretch.response))
        return {"coordinate": stretch.unit, stretch.hidden_name: hidden, "slack": response, "saturated": ""}

    def reset(self) -> None:
        """Return to the start; a learned start is kept."""
        place = float(self.state[core.PLACE]) if self.start == "learned" else self.start_place
        core.begin(self.state, place, 0.0 if self.lag else place)
        self._believed[:] = nan

    @property
    def command(self) -> dict[str, float]:
        """Current controls, in the user's units."""
        return self._commanded(float(self.state[core.PLACE]))

    def _commanded(self, place: float) -> dict[str, float]:
        return dict(
            zip(self.stretch.names, self.stretch.rows(place)[: len(self.stretch.names)].tolist(), strict=True)
        )

    def step(self, **measurement: float) -> dict[str, float]:
        """Return the controls of the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            The response by name, in its unit (NaN or infinity: no reading); the coordinate, where measured.

        Raises
        ------
        ValueError
            When the response is missing.
        TypeError
            When a value is not a number.
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
        """Count readings beyond the limit at an end of the stretch; warn once after `PATIENCE` of them."""
        self.state[core.HELD] = self.state[core.HELD] + 1.0 if self._saturated and self._slack < 0 else 0.0
        if self.state[core.HELD] == PATIENCE:
            warnings.warn(self._exhausted(), stacklevel=3)

    def _exhausted(self) -> str:
        """Return the text of the warning of `_watch`."""
        stretch, place, unit = self.stretch, float(self.state[core.PLACE]), self.reports["slack"]
        inside = stretch.low < place < stretch.high
        way = (
            "its floor is lower"
            if inside
            else f"the curve is planned for a wider range of {stretch.hidden_name}"
        )
        return (
            f"the limit has been exceeded in {PATIENCE} readings in a row,"
            + f" now by {-self._slack:.3g} {unit}".rstrip()
            + f", while {stretch.along} stands at the end of its stretch, {place:.6g} {stretch.unit}".rstrip()
            + f": it can give more where {way}"
        )

    @property
    def _slack(self) -> float:
        """Limit - response of the last used reading, in their unit; NaN before the first."""
        return float(self.state[core.LAST]) + self.margin if self.state[core.UPDATES] else nan

    @property
    def _saturated(self) -> bool:
        """Whether the last used reading demanded a coordinate beyond the end of the stretch."""
        place, error = float(self.state[core.PLACE]), float(self.state[core.LAST])
        onward = self.law.direction * error if self.state[core.UPDATES] else 0.0
        return (place <= self.law.low and onward < 0) or (place >= self.law.high and onward > 0)

    def _actual(self, measured: float) -> float | None:
        """Return the actual coordinate, measured or estimated; None: it equals its command."""
        if self.stretch.along in self.stretch.names and not isnan(measured):
            return float(measured)
        return float(self.state[core.ACTUAL]) if self.lag else None

    def _counts(self, actual: float | None) -> bool:
        """Return whether the law uses this reading; see `hold`."""
        waited = float(self.state[core.WAITED])
        near = actual is None or settled(actual, float(self.state[core.PLACE]))
        counts = counted(self.hold, self.period, float(self.state[core.SAMPLES]), waited, near)
        self.state[core.WAITED] = 0.0 if counts else waited + 1.0
        return counts

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
        """Return the controls with the coordinate replaced by its actual value."""
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
        """Return the coordinate, its hidden state on the locus and the last slack, in the user's units.

        ``saturated`` is 1 when that reading demanded a coordinate beyond the end of the stretch, else 0.
        """
        place = float(self.state[core.PLACE])
        hidden = float(self.stretch.rows(place)[len(self.stretch.names)])
        return dict(zip(self.reports, (place, hidden, self._slack, float(self._saturated)), strict=True))
