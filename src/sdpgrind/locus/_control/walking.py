"""Step, state and report of a controller on the locus."""

import warnings
from collections.abc import Mapping
from functools import cached_property
from math import isnan, nan
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.locus._control.readings import usable
from sdpgrind.locus._path import law_kernels as core
from sdpgrind.locus._path import walk_kernels as kernels
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
        return self.fresh_state()

    def fresh_state(self) -> Floats:
        """Return the state at the start, in the user's units."""
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
        measured = usable(self.stretch.along, measurement.get(self.stretch.along, nan))
        row = np.empty(len(self.stretch.names) + 3)
        if self.walk.tape.size and self.method == "feedback":
            told = kernels.walk_step(self.state, self.law, self.walk, reading, measured, row)
        else:
            told = self._walked(reading, measured, row)
        if told == kernels.EXHAUSTED:
            warnings.warn(self._exhausted(), stacklevel=2)
        return dict(zip(self.stretch.names, row[: len(self.stretch.names)].tolist(), strict=True))

    def _walked(self, reading: float, measured: float, row: Floats) -> int:
        """Take a sample as `walk_step` by functions in Python: those of a stretch, or of the inversion."""
        state, law, walk, told = self.state, self.law, self.walk, kernels.WAITING
        core.follow(state, law)
        actual = kernels.place_of(state, walk, measured)
        if kernels.counts(state, walk, actual):
            place = float(state[core.PLACE])
            base = place if walk.at_command else actual
            kernels.row_at(walk, place, row)
            if self.method == "inversion":
                self._invert(reading, self._controls(row, base), row[-3])
                told = kernels.watch(state, law, self.margin)
            else:
                limit = row[-2] if base == place else self._limit(row, base)
                told = kernels.move(state, law, walk, reading, base, limit)
        kernels.row_at(walk, state[core.PLACE], row)
        return told

    def _limit(self, row: Floats, base: float) -> float:
        """Return the limit with the coordinate at its actual value."""
        return float(self.stretch.values(self._controls(row, base)[None], row[-3:-2])[1][0])

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
            f"the limit has been exceeded in {kernels.PATIENCE} readings in a row,"
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
        return bool(kernels.saturated(self.state, self.law))

    def _controls(self, row: Floats, base: float) -> Floats:
        """Return the controls with the coordinate replaced by its actual value."""
        actual = row[: len(self.stretch.names)].copy()
        if self.stretch.along in self.stretch.names:
            actual[self.stretch.names.index(self.stretch.along)] = base
        return actual

    @cached_property
    def walk(self) -> kernels.Walk:
        """What a sample needs beside `law`, in the user's units."""
        stretch, timed = self.stretch, not isinstance(self.hold, str)
        tape, limit = getattr(stretch.values, "limit_tape", (np.zeros(0), 0))
        return kernels.Walk(
            table=stretch.table.packed,
            tape=tape,
            limit=limit,
            column=stretch.names.index(stretch.along) if stretch.along in stretch.names else -1,
            least=stretch.low,
            greatest=stretch.high,
            margin=float(self.margin),
            hold=kernels.AFTER if timed else kernels.NEAR if self.hold == "settled" else kernels.ALL,
            time=float(self.hold) if timed else 0.0,
            period=self.period or 0.0,
            lagging=self.lag > 0.0,
            at_command=self.at == "command",
        )

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
