"""The controller that walks along the locus by one measurement: Koren's intelligent machining controller."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from math import exp
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, choice, custom, described, quantity
from sdpgrind.locus._control.batch import LoopRecord, simulate
from sdpgrind.locus._control.walking import Walking
from sdpgrind.locus._stretch import law_kernels as core
from sdpgrind.locus._stretch.single_valued import placed
from sdpgrind.locus._stretch.stretch import Stretch
from sdpgrind.locus.gains._design_gain import declared_range, design_gain, stretch_of
from sdpgrind.locus.gains._gain_design import GainDesign
from sdpgrind.locus.gains._gain_schedule import GainSchedule

METHODS, PLACES, HOLDS, STARTS = (
    ("feedback", "inversion"),
    ("command", "actual"),
    ("none", "settled"),
    ("feasible", "learned"),
)


def _hold(name: str, value: Any) -> str | float:
    """A word, or a time in s."""
    return (
        str(checks.one_of(name, value, HOLDS))
        if isinstance(value, str)
        else checks.nonnegative(name, value, "s")
    )


@described(eq=False)
class LocusController(Walking, Described):
    """Walk along the locus until what is measured meets its limit: Koren (1989), section 5 and (36).

    From sample to sample the coordinate s moves by ki e + kp (e - e') + kd (e - 2 e' + e''), with e = limit - margin - response,
    the way in which the slack falls; the other controls follow on the locus. The first change has only its first term. The place
    is clamped to the stretch, and the clamped place is what the law goes on from: nothing winds up. A reading that is missing
    (NaN) leaves the command as it is.

    Where the coordinate lags behind its command, the limit must not be taken at the command: while the coordinate rises the
    response lags, slack is overstated, and the law runs too far. So, where the actual coordinate is measured (under its own name)
    or its `lag` is known, the limit is taken there, readings wait after each change until it has settled, and a scheduled gain
    goes on from there; Koren's own form is ``at="command", hold="none"``.

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
        point (parts that `hwsim` runs are told by `LearnedStart`); a mapping gives the coordinate or the hidden state by name.
        A start of one's own may have no slack: `design_gain` tells.
    margin : float
        By how much the limit is backed off, in its unit, less than the greatest limit on the curve; see
        `GainDesign.drift_margin`, which reckons without `kp` and `kd`.
    kp, kd : float
        Proportional and derivative gain, in the unit of `gain`.
    hold : "none", "settled" or float
        When readings count: always; while the actual coordinate is within 5 % of its command, or after 20 samples of waiting; or
        so long after the start, s.
    lag : float
        Time constant of the coordinate behind its command, s; 0: none, or measured.
    at : {"command", "actual"}, optional
        Where the limit is taken. None: at the actual coordinate where it is known.
    period : float, optional
        Between two samples, s; None: a sample at each event of the plant.
    method : {"feedback", "inversion"}
        By feedback; or to the optimum of the hidden state that explains the reading: right in one step where the model is.
    filter : float
        Share (0, 1] of a new estimate of the hidden state that is believed; "inversion" only.
    floor : float, optional
        Least coordinate; else that of the stretch, which the range of the hidden state tells: a wider one reaches farther down.

    Raises
    ------
    ValueError
        When the gain is not stable for a hidden state of the range, the range holds a fold or a jump, or the coordinate is not
        single-valued.

    Warns
    -----
    UserWarning
        When the gain may step beyond the limit. From `step`: the limit has been exceeded in 20 readings in a row while the
        coordinate stands at an end of the stretch (or at the floor) and cannot give more: reality is worse than any hidden
        state of the range. Each such sample reports ``saturated``.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> controller = locus.LocusController(curve, along="v", gain=0.6, x=(0.76, 1.72))
    >>> round(controller.command["v"], 4)  # the start; no units in this example
    1.8795
    >>> round(controller.step(response=11.3)["v"], 4)
    2.1283
    """

    curve: Any = custom()
    _: KW_ONLY
    along: str | None = custom(default=None)
    gain: float | str | GainSchedule | None = custom(default=None)
    x: tuple[float, float] | None = custom(default=None)
    start: Any = custom(default="feasible")
    margin: float = custom(checks.nonnegative, default=0.0)
    kp: float = custom(checks.nonnegative, default=0.0)
    kd: float = custom(checks.nonnegative, default=0.0)
    hold: str | float = custom(_hold, default="settled")
    lag: float = quantity("s", at_least=0, default=0.0)
    at: str | None = choice(*PLACES, default=None)
    period: float | None = quantity("s", above=0, default=0.5)
    method: str = choice(*METHODS, default="feedback")
    filter: float = quantity("1", above=0, at_most=1, default=1.0)
    floor: float | None = custom(default=None)

    def _check(self) -> None:
        if self.period is None and (self.lag > 0 or not isinstance(self.hold, str)):
            raise ValueError("period must be a number (s) where lag or hold is a time; got None")
        stretch, unit = self.stretch, self.reports["slack"]
        if self.margin >= (greatest := float(np.max(stretch.limit))):
            raise checks.refuse(
                "margin", f"< {greatest:.6g}, the greatest limit on the curve", self.margin, unit
            )
        if self.floor is not None:
            checks.within("floor", self.floor, stretch.low, stretch.high, stretch.unit)
        if self.method == "feedback":
            self._check_gain()
        _ = self.start_place, self.law

    def _check_gain(self) -> None:
        if isinstance(self.gain, str):
            checks.one_of("gain", self.gain, ("schedule",))
        elif isinstance(self.gain, GainSchedule):
            self.design.check_schedule(self.gain)
        elif self.gain is not None:
            self.design.check(self.gain, kp=self.kp, kd=self.kd)
            self._check_lag(self.gain)

    def _check_lag(self, gain: float) -> None:
        if not self.lag or self.period is None or self.hold == "settled":
            return
        at = self.at or "actual"
        if self.design.radius(gain, kp=self.kp, kd=self.kd, lag=self.lag, period=self.period, at=at) >= 1:
            rule = f"smaller, or hold 'settled', to be stable with a lag of {self.lag:g} s"
            raise ValueError(f"gain must be {rule}; got {gain:g}")

    @cached_property
    def stretch(self) -> Stretch:
        """Where it walks, in the units of the problem."""
        return stretch_of(self.curve, self.along, self.x)

    @cached_property
    def design(self) -> GainDesign:
        """What gains do there, in units of the coordinate over those of the response."""
        return design_gain(self.stretch, x=self.x)

    @cached_property
    def law(self) -> core.WalkLaw:
        """What the compiled core knows, in the user's units."""
        stretch = self.stretch
        schedule = self.gain if isinstance(self.gain, GainSchedule) else None
        if (
            schedule is None
            and (self.gain is None or isinstance(self.gain, str))
            and self.method == "feedback"
        ):
            schedule = self.design.schedule()
        fixed = float(self.gain) if isinstance(self.gain, float | int) else 0.0
        return core.WalkLaw(
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
        """Coordinate of the start, in its unit."""
        stretch, start = self.stretch, self.start
        if isinstance(start, str):
            checks.one_of("start", start, STARTS)
            low, high = declared_range(stretch, self.x)
            ends = np.asarray(stretch.coordinate_of(np.array([low, high])))
            return float(np.clip(ends.min() if self._falls else ends.max(), *self._room))
        if isinstance(start, Mapping):
            start = self._named(start)
        return placed("start", start, *self._room, stretch.unit)

    @property
    def job(self) -> Mapping[str, object]:
        """What the machine must have set up, in the units given there: what the process says of itself, where it does."""
        model = getattr(getattr(self.curve, "problem", None), "model", None)
        return dict(getattr(model, "job", {}))

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
        raise ValueError(
            f"start must name {stretch.along} or {stretch.hidden_name}; got {', '.join(map(str, start))}"
        )

    def simulate(self, hidden: Any, *, noise: Any = 0.0) -> LoopRecord:
        """Return what it does on the model itself in many runs at once, with the numbers of `step`, bit for bit.

        There are no lags there, and nothing is waited for.

        Parameters
        ----------
        hidden : array, (..., steps)
            Hidden state at each reading, in its unit.
        noise : float or array, (..., steps)
            Added to each reading, in the unit of the response.
        """
        return simulate(self, hidden, noise)


class LearnedStart:
    """Begin each part at the last point of the part before: Koren (1989), section 6.

    A point from which nothing was learned, as no part was long enough, is not taken.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import locus
    >>> problem = locus.preset("grinding")
    >>> controller = locus.LocusController(locus.plan(problem), along="infeed_rate")
    >>> log = hwsim.run(hwsim.AdaptiveGrinder(problem), controller, parts=2, adapt=locus.LearnedStart())
    >>> first, second = log.outcome.time.values  # s
    >>> bool(second < first)
    True
    """

    def next(self, controller: LocusController, part_log: Any) -> LocusController:
        """Return the controller of the next part, with another start (in the unit of its coordinate).

        Parameters
        ----------
        controller : LocusController
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        checks.kind("controller", controller, LocusController)
        places = np.asarray(part_log.column("controller", "coordinate_planned"))
        last = places[np.isfinite(places)]
        return controller.replace(start=float(last[-1])) if last.size else controller
