"""The controller that moves along the locus by one measured response, of Koren (1989)."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from math import exp
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, choice, custom, described, quantity
from sdpgrind.locus._control.batch import LoopRecord, simulate
from sdpgrind.locus._control.readings import STARTS, check_period, checked_hold
from sdpgrind.locus._control.walking import Walking
from sdpgrind.locus._path import law_kernels as core
from sdpgrind.locus._path.single_valued import placed
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus.gains._analysis import GainDesign
from sdpgrind.locus.gains._design import declared_range, design_gain, stretch_of
from sdpgrind.locus.gains._gain_schedule import GainSchedule

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

METHODS, PLACES = ("feedback", "inversion"), ("command", "actual")


@described(eq=False)
class LocusController(Walking, Described):
    """Move along the locus until the measured response meets its limit: Koren (1989), section 5 and (36).

    Per sample the coordinate s moves by ki e + kp (e - e') + kd (e - 2 e' + e''), e = limit - margin -
    response, in the direction of falling slack; the other controls follow on the locus. The first change has
    the integral term only. The coordinate is clamped to the stretch and the law continues from the clamped
    value, so it cannot wind up. A missing reading (NaN) keeps the command.

    A lagging coordinate makes the response lag: a limit taken at the command overstates the slack of a rising
    coordinate, and the loop overshoots. With a measured coordinate (under its own name) or a known `lag`, the
    limit is taken at the actual one, readings wait until it has settled, and a scheduled gain continues from
    it. Koren's own form is ``at="command", hold="none"``.

    Parameters
    ----------
    curve : Locus or Stretch
        The traced locus.
    along : str
        Coordinate: a control or the hidden state, single-valued on the locus.
    gain : float, "schedule" or GainSchedule, optional
        Integral gain ki, unit of the coordinate over that of the response; or a gain inverse to the loop
        slope. None: the recommended schedule, see `design_gain`.
    x : (float, float), optional
        Range of the hidden state to be stable in, in its unit. Default: that of the stretch.
    start : "feasible", "learned", float or mapping
        Initial coordinate. "feasible": optimum of the tightest hidden state. "learned": the same, and after
        `reset` the last coordinate (for parts run by `hwsim`, see `LearnedStart`). Mapping: coordinate or
        hidden state by name. Whether a number leaves slack for the whole range: see `design_gain`.
    margin : float
        Distance kept from the limit, in its unit, below the greatest limit on the curve; see
        `GainDesign.drift_margin`, which leaves out `kp` and `kd`.
    kp, kd : float
        Proportional and derivative gain, in the unit of `gain`.
    hold : "none", "settled" or float
        Readings used by the law. "none": all. "settled": those with the actual coordinate within 5 % of its
        command, or after 20 samples of waiting. Number: those later than this time after the start, s.
    lag : float
        Time constant of the coordinate behind its command, s. 0: no lag, or a measured coordinate.
    at : {"command", "actual"}, optional
        Coordinate of the limit. None: the actual one, where known.
    period : float, optional
        Sampling period, s. None: one sample per event of the plant.
    method : {"feedback", "inversion"}
        Feedback, or a step to the optimum of the hidden state that explains the reading.
    filter : float
        Weight (0, 1] of a new estimate of the hidden state; "inversion" only.
    floor : float, optional
        Least coordinate. Default: that of the stretch, which depends on the range of the hidden state.

    Raises
    ------
    ValueError
        When the gain is unstable in the range, the range has a fold or a jump, or `along` turns in it.

    Warns
    -----
    UserWarning
        When the gain may violate the limit. From `step`: after 20 readings in a row beyond the limit with the
        coordinate at an end of the stretch (or at the floor): the process is worse than at any hidden state
        of the range. Each such sample reports ``saturated``.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> controller = locus.LocusController(curve, along="v", gain=0.6, x=(0.76, 1.72))
    >>> round(controller.command["v"], 4)  # start; the example has no units
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
    hold: str | float = custom(checked_hold, default="settled")
    lag: float = quantity("s", at_least=0, default=0.0)
    at: str | None = choice(*PLACES, default=None)
    period: float | None = quantity("s", above=0, default=0.5)
    method: str = choice(*METHODS, default="feedback")
    filter: float = quantity("1", above=0, at_most=1, default=1.0)
    floor: float | None = custom(default=None)

    def _check(self) -> None:
        check_period(self.period, self.hold, self.lag > 0)
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
        """The stretch of the locus, in the units of the problem."""
        return stretch_of(self.curve, self.along, self.x)

    @cached_property
    def design(self) -> GainDesign:
        """Stability and violation limits of gains, in units of the coordinate over those of the response."""
        return design_gain(self.stretch, x=self.x)

    @cached_property
    def law(self) -> core.WalkLaw:
        """Parameters of the compiled kernels, in the user's units."""
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
        """Initial coordinate, in its unit."""
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
        """Data of the job that plan and machine must share, in their units; empty for a process without."""
        model = getattr(getattr(self.curve, "problem", None), "model", None)
        return dict(getattr(model, "job", {}))

    @property
    def _falls(self) -> bool:
        """Whether the slack falls with rising coordinate."""
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

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it, in the user's units."""
        from sdpgrind.locus._control.recipe import recipe_of

        return recipe_of(self)

    def simulate(self, hidden: Any, *, noise: Any = 0.0) -> LoopRecord:
        """Return many simultaneous runs on the model, without lag or waiting; bit-equal to `step`.

        Parameters
        ----------
        hidden : array, (..., steps)
            Hidden state at each reading, in its unit.
        noise : float or array, (..., steps)
            Error added to each reading, in the unit of the response.
        """
        return simulate(self, hidden, noise)
