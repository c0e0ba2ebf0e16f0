"""The planning problem: a process with its limits, and what is charged for."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.base.warned import warn
from sdpgrind.weldbead.sequence._burn import ForceBurnLimit, MalkinBurnLimit, PowerBurnLimit
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter

BURN_LIMITS = (ForceBurnLimit, PowerBurnLimit, MalkinBurnLimit)
Lateness = sdp.OneSided | Callable[[Floats], npt.ArrayLike]


@stored("weldbead.finish_charge")
@dataclasses.dataclass(frozen=True)
class FinishCharge(Frozen):
    """Charge ($) on the feed V of the last pass, the finish it leaves: charge (V/reference_rate)^exponent.

    Parameters
    ----------
    charge : float
        Charge at the reference feed, >= 0, $.
    exponent : float
        >= 0, unit 1: a faster last pass never costs less.
    reference_rate : float
        Reference feed, > 0, mm/s.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> float(FinishCharge(0.4, reference_rate=12.5)(6.25))
    0.2
    """

    charge: float
    exponent: float = 1.0
    reference_rate: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "charge", checks.nonnegative("charge", self.charge, "$"))
        object.__setattr__(self, "exponent", checks.nonnegative("exponent", self.exponent, "1"))
        object.__setattr__(self, "reference_rate", checks.positive("reference_rate", self.reference_rate, "mm/s"))

    def __call__(self, feed_rate: npt.ArrayLike) -> Floats:
        """Return the charge ($) at a feed (mm/s)."""
        return np.asarray(self.charge * (np.asarray(feed_rate, dtype=float) / self.reference_rate) ** self.exponent)


@stored("weldbead.problem")
@dataclasses.dataclass(frozen=True)
class SequenceProblem(Frozen):
    """Grind a bead away in passes before a deadline, at least expected charge: Brown (1988), chapter 5.

    Parameters
    ----------
    model : GrindingProcess
        The process.
    bead_length : float
        Length of the bead, mm.
    reset_time : float
        Time to get ready for the next pass, >= 0, s.
    durations : sequence of float
        Durations of a pass to choose from, reset included, s; each a multiple of the stage and longer than the reset.
    force_max : float
        Greatest normal force, N.
    burn_limit : ForceBurnLimit, PowerBurnLimit or MalkinBurnLimit, optional
        What keeps the work from burning.
    scatter : Scatter
        How the depth of a pass scatters.
    height_max : float
        Greatest height planned for, mm.
    horizon : float
        Longest time to the deadline planned for, a multiple of the stage, s.
    stage : float
        Step of time of the plan, s.
    height_charge : sdp.Charge
        Charge ($) on the height (mm) at the end; its over side is needed, as every pass may overgrind.
    lateness_charge : sdp.OneSided or callable, optional
        Charge ($) on the time after the deadline (s); None: the deadline holds.
    finish_charge : FinishCharge, optional
        Charge ($) on the feed of the last pass.
    pass_charge : float
        Charge for each pass, >= 0, $.
    min_cut : float
        Least mean depth of a pass, >= 0, mm.
    late_window : float, optional
        How long after the deadline is planned for, s, a multiple of the stage; by default as long as a pass may pay.
        A lateness charge that is not convex needs it.

    Raises
    ------
    ValueError, TypeError
        When a value is of the wrong kind or out of range, or when no pass is admissible.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> problem = SequenceProblem(
    ...     process, bead_length=50.0, reset_time=2.0, durations=range(6, 21, 2), force_max=50.0, burn_limit=None,
    ...     scatter=Scatter("C1", 0.15), height_max=2.0, horizon=60.0, stage=2.0,
    ...     height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    >>> low, high = problem.force_interval(6.0)
    >>> round(low, 4), high
    (7.8431, 50.0)
    """

    model: GrindingProcess
    bead_length: float
    reset_time: float
    durations: Sequence[float]
    force_max: float
    burn_limit: ForceBurnLimit | PowerBurnLimit | MalkinBurnLimit | None
    scatter: Scatter
    height_max: float
    horizon: float
    stage: float
    height_charge: sdp.Charge
    lateness_charge: Lateness | None = None
    finish_charge: FinishCharge | None = None
    pass_charge: float = 0.0
    min_cut: float = 0.0
    late_window: float | None = None

    def __post_init__(self) -> None:
        self._check_kinds()
        if self.scatter.total > 1:
            warn(
                f"scatter.relative_sd is {self.scatter.total:.4g}, a share of the mean (1): divide by 100 where percent is meant"
            )
        for name, unit in {"bead_length": "mm", "force_max": "N", "height_max": "mm", "stage": "s"}.items():
            object.__setattr__(self, name, checks.positive(name, getattr(self, name), unit))
        for name, unit in {"reset_time": "s", "pass_charge": "$", "min_cut": "mm"}.items():
            object.__setattr__(self, name, checks.nonnegative(name, getattr(self, name), unit))
        object.__setattr__(self, "horizon", _multiple("horizon", self.horizon, self.stage))
        self._check_durations()
        self._check_charges()
        self._check_force()

    def _check_kinds(self) -> None:
        _kind("model", self.model, (GrindingProcess,))
        _kind("scatter", self.scatter, (Scatter,))
        _kind("height_charge", self.height_charge, (sdp.Charge,))
        if self.burn_limit is not None:
            _kind("burn_limit", self.burn_limit, BURN_LIMITS)
        if self.finish_charge is not None:
            _kind("finish_charge", self.finish_charge, (FinishCharge,))
        if self.lateness_charge is not None and not callable(self.lateness_charge):
            raise TypeError(f"lateness_charge must be a one-sided charge, a function or None; got {self.lateness_charge!r}")

    def _check_durations(self) -> None:
        if isinstance(self.durations, str) or not len(self.durations):
            raise checks.refuse("durations", "at least one number", self.durations, "s")
        durations = tuple(_multiple(f"durations[{k}]", value, self.stage) for k, value in enumerate(self.durations))
        for k, value in enumerate(durations):
            if value <= self.reset_time:
                raise checks.refuse(f"durations[{k}]", f"> reset_time, {self.reset_time:g} s", value, "s")
            if k and value <= durations[k - 1]:
                raise checks.refuse(f"durations[{k}]", f"> durations[{k - 1}], {durations[k - 1]:g} s", value, "s")
        if self.lateness_charge is None and durations[0] > self.horizon:
            rule = f"<= horizon, {self.horizon:g} s, without a lateness_charge: no pass would ever be begun"
            raise checks.refuse("durations[0]", rule, durations[0], "s")
        object.__setattr__(self, "durations", durations)

    def _check_charges(self) -> None:
        if self.height_charge.over is None:
            raise ValueError("height_charge must have an over side ($/mm): every pass may overgrind; got over=None")
        self.height_charge.check(self.height_max)
        late = self.lateness_charge
        if self.late_window is not None:
            if late is None:
                raise ValueError(f"late_window must be None without a lateness_charge (s); got {self.late_window!r}")
            object.__setattr__(self, "late_window", _multiple("late_window", self.late_window, self.stage))
        elif late is not None and not (isinstance(late, sdp.OneSided) and late.convex):
            raise ValueError(f"late_window must be given with a lateness_charge that is not convex (s); got {late!r}")
        if late is not None and not isinstance(late, sdp.OneSided):
            checks.charge("lateness_charge", late, float(self.late_window or 0.0))

    def _check_force(self) -> None:
        threshold = self._mean_model.threshold_force
        if self.force_max <= threshold:
            raise ValueError(
                f"force_max must be > the threshold force {threshold:.6g} N, under which nothing is removed (N);"
                f" got {self.force_max!r}"
            )
        if not any(low < high for low, high in map(self.force_interval, self.durations)):
            raise ValueError(
                "force_max, burn_limit and min_cut must leave a force for at least one of the durations (N); got"
                f" force_max {self.force_max!r}, {self.burn_limit!r}, min_cut {self.min_cut!r}"
            )

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine that a plan is for: name -> (value, unit), and the burn limit; nothing that is estimated."""
        return {
            "bead_length": (self.bead_length, "mm"),
            "bead_width": (float(self.model.bead_width), "mm"),
            "disk_radius": (float(self.model.disk_radius), "mm"),
            "reset_time": (self.reset_time, "s"),
            "force_max": (self.force_max, "N"),
            "burn_limit": self.burn_limit,
        }

    @property
    def _mean_model(self) -> GrindingProcess:
        return self.scatter.expected(self.model)

    def feed_rate(self, duration: float) -> float:
        """Return the feed (mm/s) of a pass of `duration` (s): length over what the reset leaves, Brown (5.6)."""
        if duration <= self.reset_time:
            raise checks.refuse("duration", f"> reset_time, {self.reset_time:g} s", duration, "s")
        return self.bead_length / (duration - self.reset_time)

    def duration(self, feed_rate: float) -> float:
        """Return the duration (s) of a pass at `feed_rate` (mm/s), reset included: Brown (5.6)."""
        return self.bead_length / checks.positive("feed_rate", feed_rate, "mm/s") + self.reset_time

    def force_interval(self, duration: float) -> tuple[float, float]:
        """Return the least and greatest admissible normal force (N) of a pass of `duration` (s).

        The least removes `min_cut` on average (nothing at 0: the threshold force); the greatest is that of the machine,
        of the drive's peak power or of the burn limit. No force is admissible where the first is not below the second.
        """
        feed = self.feed_rate(duration)
        low = float(self._mean_model.normal_force(self.min_cut, feed))
        high = min(self.force_max, self._mean_model.peak_force)
        if self.burn_limit is not None:
            burn_low, burn_high = self.burn_limit.interval(self._mean_model, feed)
            low, high = max(low, float(burn_low)), min(high, float(burn_high))
        return low, high

    def cut(self, duration: float, normal_force: npt.ArrayLike) -> sdp.Law:
        """Return the law of the depth (mm) of a pass of `duration` (s) at normal forces (N)."""
        return self.scatter.cut(self.model, normal_force, self.feed_rate(duration))

    def force_breaks(self, duration: float) -> tuple[float, ...]:
        """Return the normal forces (N) at which the law of a pass of `duration` (s) changes its form, inside its interval."""
        low, high = self.force_interval(duration)
        switch = float(self.scatter.switch_force(self.model, self.feed_rate(duration)))
        return (switch,) if low < switch < high else ()

    def updated(self, estimate: Any) -> Self:
        """Return the problem with what was measured: the loop from log back to model.

        Parameters
        ----------
        estimate : Estimate, ScatterEstimate or Scatter
            What `weldbead.identify` gives: coefficients of the process by their names (J/mm^3, W, 1), or how the depth
            scatters.

        Raises
        ------
        ValueError
            When the estimate has failed, or names something else than a coefficient of the process.
        """
        if isinstance(estimate, Scatter):
            return self.replace(scatter=estimate)
        scatter = getattr(estimate, "scatter", None)
        if isinstance(scatter, Scatter):
            return self.replace(scatter=scatter)
        if not hasattr(estimate, "ok"):
            raise TypeError(f"estimate must be what weldbead.identify gives, or a Scatter; got {estimate!r}")
        if not estimate.ok:
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        known = [field.name for field in dataclasses.fields(self.model)]
        for name in estimate.names:
            checks.one_of("estimate.names", name, known)
        return self.replace(model=self.model.replace(**{name: estimate[name] for name in estimate.names}))


def _multiple(name: str, value: object, stage: float) -> float:
    number = checks.nonnegative(name, value, "s")
    if abs(number - round(number / stage) * stage) > 1e-9 * max(stage, number):
        raise checks.refuse(name, f"a multiple of the stage, {stage:g} s", number, "s")
    return number


def _kind(name: str, value: object, kinds: tuple[type, ...]) -> None:
    if not isinstance(value, kinds):
        raise TypeError(f"{name} must be {' or '.join(kind.__name__ for kind in kinds)}; got {value!r}")
