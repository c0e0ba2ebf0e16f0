"""The controller that walks along the locus by one measurement: Koren's intelligent machining controller."""

from collections.abc import Mapping
from copy import copy
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from math import exp, isnan, nan
from typing import Any, Self

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.locus import _law_kernels as core
from sdpgrind.locus._balance import balanced, hidden_of
from sdpgrind.locus._batch import LoopRecord, simulate
from sdpgrind.locus._design import GainDesign
from sdpgrind.locus._gains import declared_range, design_gain, stretch_of
from sdpgrind.locus._schedule import GainSchedule
from sdpgrind.locus._stretch import Stretch

METHODS, PLACES, HOLDS, STARTS = ("feedback", "inversion"), ("command", "actual"), ("none", "settled"), ("feasible", "learned")
SETTLED = 0.05
"""Difference between actual and commanded coordinate, relative, at which a lag counts as settled."""


@dataclass(frozen=True, eq=False)
class LocusController(Frozen):
    """Walk along the locus until what is measured meets its limit: Koren (1989), section 5 and (36).

    From sample to sample the coordinate s moves by ki e + kp (e - e') + kd (e - 2 e' + e''), with e = limit - margin - response,
    the way in which the slack falls; the other controls follow on the locus. The first change has only its first term. The place
    is clamped to the stretch, and the clamped place is what the law goes on from: nothing winds up. A reading that is missing
    (NaN) leaves the command as it is.

    Where the coordinate lags behind its command, the limit must not be taken at the command: while the coordinate rises the
    response lags, slack is overstated, and the law runs too far. So, where the actual coordinate is measured (under its own name)
    or its `lag` is known, the law goes on from the actual coordinate, and waits after each change until it has settled; Koren's
    own form is ``at="command", hold="none"``.

    Parameters
    ----------
    curve : Locus or Stretch
        The traced locus.
    along : str
        The coordinate: a control, or the hidden state, that is single-valued on the locus.
    gain : float, "schedule" or GainSchedule, optional
        Integral gain ki, in units of the coordinate over those of the response; or one that follows the loop slope. None: the
        schedule that is designed, see `design_gain`.
    x : (float, float), optional
        Range of the hidden state for which it shall hold, in its unit; else that of the stretch.
    start : "feasible", "learned", float or mapping
        Coordinate of the start; "feasible": the optimum of the tightest hidden state; "learned": that, and after `reset` the last
        point; a mapping gives the coordinate or the hidden state by name.
    margin : float
        By how much the limit is backed off, in its unit; see `GainDesign.drift_margin`.
    kp, kd : float
        Proportional and derivative gain, in the unit of `gain`.
    hold : "none", "settled" or float
        When readings count: always; while the actual coordinate is within 5 % of its command; or so long after the start, s.
    lag : float
        Time constant of the coordinate behind its command, s; 0: none, or measured.
    at : {"command", "actual"}, optional
        Where the limit is taken, and the law goes on from. None: the actual coordinate where it is known.
    period : float, optional
        Between two samples, s; None: a sample at each event of the plant.
    method : {"feedback", "inversion"}
        By feedback; or to the optimum of the hidden state that explains the reading: right in one step where the model is.
    filter : float
        Share (0, 1] of a new estimate of the hidden state that is believed; "inversion" only.
    floor : float, optional
        Least coordinate; else that of the stretch.

    Raises
    ------
    ValueError
        When the gain is not stable for a hidden state of the range, the range holds a fold or a jump, or the coordinate is not
        single-valued.

    Warns
    -----
    UserWarning
        When the gain may step beyond the limit.
    """

    curve: Any
    _: KW_ONLY
    along: str | None = None
    gain: float | str | GainSchedule | None = None
    x: tuple[float, float] | None = None
    start: Any = "feasible"
    margin: float = 0.0
    kp: float = 0.0
    kd: float = 0.0
    hold: str | float = "settled"
    lag: float = 0.0
    at: str | None = None
    period: float | None = 0.5
    method: str = "feedback"
    filter: float = 1.0
    floor: float | None = None

    def __post_init__(self) -> None:
        checks.one_of("method", self.method, METHODS)
        for name in ("margin", "kp", "kd"):
            checks.nonnegative(name, getattr(self, name))
        checks.nonnegative("lag", self.lag, "s")
        checks.share("filter", self.filter)
        if self.at is not None:
            checks.one_of("at", self.at, PLACES)
        if self.period is not None:
            checks.positive("period", self.period, "s")
        self._check_hold()
        stretch = self.stretch
        if self.floor is not None:
            checks.within("floor", self.floor, stretch.low, stretch.high, stretch.unit)
        if self.method == "feedback":
            self._check_gain()
        _ = self.start_place

    def _check_hold(self) -> None:
        if isinstance(self.hold, str):
            checks.one_of("hold", self.hold, HOLDS)
        else:
            checks.nonnegative("hold", self.hold, "s")
        if self.period is None and (self.lag > 0 or not isinstance(self.hold, str)):
            raise ValueError("period must be a number (s) where lag or hold is a time; got None")

    def _check_gain(self) -> None:
        if isinstance(self.gain, str):
            checks.one_of("gain", self.gain, ("schedule",))
        elif self.gain is not None and not isinstance(self.gain, GainSchedule):
            self.design.check(self.gain, kp=self.kp, kd=self.kd)

    @cached_property
    def stretch(self) -> Stretch:
        """Where it walks."""
        return stretch_of(self.curve, self.along, self.x)

    @cached_property
    def design(self) -> GainDesign:
        """What gains do there, in units of the coordinate over those of the response."""
        return design_gain(self.stretch, x=self.x)

    @cached_property
    def law(self) -> core.Law:
        """What the compiled core knows, in the user's units."""
        stretch = self.stretch
        schedule = self.gain if isinstance(self.gain, GainSchedule) else None
        if schedule is None and (self.gain is None or isinstance(self.gain, str)) and self.method == "feedback":
            schedule = self.design.schedule()
        fixed = float(self.gain) if isinstance(self.gain, float | int) else 0.0
        return core.Law(
            low=stretch.low if self.floor is None else float(self.floor),
            high=stretch.high,
            direction=1.0 if stretch.loop_slope[0] < 0 else -1.0,
            integral=fixed if schedule is None else float(schedule.theta),
            proportional=float(self.kp),
            derivative=float(self.kd),
            scheduled=schedule is not None,
            decay=exp(-self.period / self.lag) if self.lag and self.period else 0.0,
            slopes=(stretch if schedule is None else schedule.stretch).slopes.packed,
        )

    @cached_property
    def start_place(self) -> float:
        """Coordinate of the start."""
        stretch, start = self.stretch, self.start
        if isinstance(start, str):
            checks.one_of("start", start, STARTS)
            low, high = declared_range(stretch, self.x)
            ends = np.asarray(stretch.coordinate_of(np.array([low, high])))
            return float(np.clip(ends.min() if self._falls else ends.max(), *self._room))
        if isinstance(start, Mapping):
            start = self._named(start)
        return checks.within("start", start, *self._room, stretch.unit)

    @property
    def _falls(self) -> bool:
        """Whether the slack falls as the coordinate rises."""
        return bool(self.stretch.loop_slope[0] < 0)

    @property
    def _room(self) -> tuple[float, float]:
        return (self.stretch.low if self.floor is None else float(self.floor)), self.stretch.high

    def _named(self, start: Mapping[str, Any]) -> Any:
        stretch = self.stretch
        if stretch.along in start:
            return start[stretch.along]
        if stretch.hidden_name in start:
            return stretch.coordinate_of(start[stretch.hidden_name])
        raise ValueError(f"start must name {stretch.along} or {stretch.hidden_name}; got {', '.join(map(str, start))}")

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

    def __deepcopy__(self, memo: object) -> Self:
        """A controller in the same state; what never changes is shared."""
        twin = copy(self)
        for name in ("state", "_believed"):
            if name in self.__dict__:
                twin.__dict__[name] = self.__dict__[name].copy()
        return twin

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
        return {"coordinate": stretch.unit, stretch.hidden_name: hidden, "slack": response}

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
        return dict(zip(self.stretch.names, self.stretch.rows(place)[: len(self.stretch.names)].tolist(), strict=True))

    def step(self, **measurement: float) -> dict[str, float]:
        """Return all controls for the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            The response by its name, in its unit (NaN: no reading); the coordinate by its name, where it is measured. Others are
            not used.

        Raises
        ------
        ValueError
            When the response is not among them.
        """
        name = self.stretch.response
        if name not in measurement:
            raise ValueError(f"measurement must have {name!r}; got {', '.join(measurement) or 'nothing'}")
        core.follow(self.state, self.law)
        actual = self._actual(measurement.get(self.stretch.along, nan))
        if self._counts(actual):
            base = float(self.state[core.PLACE]) if actual is None or self.at == "command" else actual
            self._move(float(measurement[name]), base)
        return self.command

    def _actual(self, measured: float) -> float | None:
        """The actual coordinate, measured or estimated; None: it is where it is commanded, for all that is known."""
        if self.stretch.along in self.stretch.names and not isnan(measured):
            return float(measured)
        return float(self.state[core.ACTUAL]) if self.lag else None

    def _counts(self, actual: float | None) -> bool:
        """Whether this reading does."""
        if isinstance(self.hold, str):
            place = float(self.state[core.PLACE])
            return self.hold == "none" or actual is None or abs(actual - place) <= SETTLED * abs(place)
        assert self.period is not None
        return float(self.state[core.SAMPLES] - 1) * self.period > self.hold + 1e-9 * self.period

    def _move(self, reading: float, base: float) -> None:
        place = float(self.state[core.PLACE])
        row = self.stretch.rows(place)
        n = len(self.stretch.names)
        if self.method == "inversion":
            self._invert(reading, self._controls(row[:n], base))
        elif base == place:
            core.advance(self.state, self.law, row[n + 1] - self.margin - reading, place)
        else:
            limit = self.stretch.values(self._controls(row[:n], base)[None], row[n : n + 1])[1]
            core.advance(self.state, self.law, float(limit[0]) - self.margin - reading, base)

    def _controls(self, controls: Floats, base: float) -> Floats:
        """What is commanded, with the coordinate where it is."""
        actual = controls.copy()
        if self.stretch.along in self.stretch.names:
            actual[self.stretch.names.index(self.stretch.along)] = base
        return actual

    def _invert(self, reading: float, controls: Floats) -> None:
        if isnan(reading):
            return
        state = hidden_of(self.stretch.values, controls[None], np.array([reading]), self.stretch.x)
        believed = self._believed
        believed[:] = state if isnan(believed[0]) else believed + self.filter * (state - believed)
        self.state[core.LAST] = 0.0
        self.state[core.PLACE] = np.clip(balanced(self.stretch, believed, self.margin), *self._room)[0]

    def report(self) -> dict[str, float]:
        """Return its coordinate, the hidden state for which that is the optimum, and the slack that it saw last; user's units."""
        place = float(self.state[core.PLACE])
        hidden = float(self.stretch.rows(place)[len(self.stretch.names)])
        slack = float(self.state[core.LAST]) + self.margin if self.state[core.UPDATES] else nan
        return dict(zip(self.reports, (place, hidden, slack), strict=True))

    def simulate(self, hidden: Any, *, noise: Any = 0.0) -> LoopRecord:
        """Return what it does on the model itself, without lag, in many runs at once; the same numbers as `step`, bit for bit.

        Parameters
        ----------
        hidden : array, (..., steps)
            Hidden state at each reading, in its unit.
        noise : float or array, (..., steps)
            Added to each reading, in the unit of the response.
        """
        return simulate(self, hidden, noise)
