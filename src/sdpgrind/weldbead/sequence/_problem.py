"""Planning problem of a sequence: process, limits and charges."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.record import Doubts, asked
from sdpgrind.base.quantities import Check, Described, custom, described, law, quantity, specs, valued
from sdpgrind.base.warned import warn
from sdpgrind.weldbead.sequence._burn import BURN_LIMITS, NAMES, BurnLimit
from sdpgrind.weldbead.sequence._coefficient_scatter import CoefficientScatter
from sdpgrind.weldbead.sequence._depths import Depths
from sdpgrind.weldbead.sequence._predictive import PredictiveDepths
from sdpgrind.weldbead.sequence._process import GrindingProcess, check_units
from sdpgrind.weldbead.sequence._scatter import Scatter, refuse_c1

FORCES = 0.01, 1e4  # N, chosen: no grinder presses a disc harder
NOISES = 0.0, 0.5  # mm, chosen: a scan with a greater standard deviation tells nothing of a bead
Lateness = sdp.OneSided | Callable[[Floats], npt.ArrayLike]


@described("weldbead.finish_charge")
class FinishCharge(Described):
    """Charge on the feed V of the last pass, as its finish: charge (V/reference_rate)^exponent, $.

    Parameters
    ----------
    charge : float
        Charge at the reference feed, >= 0, $.
    exponent : float
        Exponent, >= 0, unit 1: a faster last pass never costs less.
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

    charge: float = quantity("$", at_least=0)
    exponent: float = quantity("1", at_least=0, default=1.0)
    reference_rate: float = quantity("mm/s", above=0, usual=(0.05, 500.0), typical=10, default=1.0)

    def __call__(self, feed_rate: npt.ArrayLike) -> Floats:
        """Return the charge, $, at a feed, mm/s."""
        return np.asarray(
            self.charge * (np.asarray(feed_rate, dtype=float) / self.reference_rate) ** self.exponent
        )


def _of(kind: type) -> Check:
    """Check of a field that is an object of a class."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, kind):
            raise TypeError(f"{name} must be {kind.__name__}; got {value!r}")
        return value

    return check


def _lateness(name: str, value: Any) -> Any:
    if not callable(value):
        raise TypeError(f"{name} must be a one-sided charge, a function or None; got {value!r}")
    return value


@described("weldbead.problem")
class SequenceProblem(Described):
    """Grind a bead away in passes before a deadline at least expected charge; Brown (1988), chapter 5.

    Parameters
    ----------
    model : GrindingProcess
        Grinding process.
    bead_length : float
        Length of the bead, mm.
    reset_time : float
        Time between passes, >= 0, s.
    durations : sequence of float
        Admissible durations of a pass, reset included, s; each a multiple of the stage and longer than the
        reset.
    force_max : float
        Greatest normal force, N.
    burn_limit : BurnLimit or None
        Burn limit; None: the work never burns.
    scatter : Scatter
        Scatter of the depth of a pass.
    height_max : float
        Greatest height of the plan, mm.
    horizon : float
        Longest time to the deadline, a multiple of the stage, s.
    stage : float
        Time step of the plan, s.
    height_charge : sdp.Charge
        Charge ($) on the final height (mm); its over side is required, as every pass may overgrind.
    lateness_charge : sdp.OneSided or callable, optional
        Charge ($) on the time after the deadline (s); None: no pass may end late.
    finish_charge : FinishCharge, optional
        Charge ($) on the feed of the last pass.
    pass_charge : float
        Charge per pass, >= 0, $.
    min_cut : float
        Least mean depth of a pass, >= 0, mm.
    late_window : float, optional
        Planned time after the deadline, s, a multiple of the stage; required with a lateness charge that is
        not convex. Default: as long as a pass may pay.
    bead_scatter : CoefficientScatter, optional
        Scatter of K1, K2 and mu from bead to bead (relative sd, unit 1); the process has their means. With it
        `scatter` is that of the coefficients from pass to pass, and controllers learn the bead's.
    lead_length : float
        Way of a pass beside the bead, >= 0, mm: the feed is raised by it.
    waviness : float
        Standard deviation of the height along a bead before its first pass, >= 0, mm: `SequencePolicy.risk`
        counts what passes at their limit of force leave on the waves. The plan itself knows level beads.

    Raises
    ------
    ValueError, TypeError
        When a value is of the wrong kind or out of range, or when no pass is admissible.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> problem = SequenceProblem(
    ...     process, bead_length=50.0, reset_time=2.0, durations=range(6, 21, 2), force_max=50.0,
    ...     burn_limit=None, scatter=Scatter("C1", 0.15), height_max=2.0, horizon=60.0, stage=2.0,
    ...     height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    >>> low, high = problem.force_interval(6.0)
    >>> round(low, 4), high
    (7.8431, 50.0)
    """

    model: GrindingProcess = custom(_of(GrindingProcess))
    bead_length: float = quantity("mm", above=0, usual=(1.0, 10000.0), typical=150)
    reset_time: float = quantity("s", at_least=0)
    durations: Sequence[float] = custom(unit="s")
    force_max: float = quantity("N", above=0, usual=FORCES, typical=50)
    burn_limit: BurnLimit | None = law(BURN_LIMITS, " or ".join(NAMES), "interval", "margin")
    scatter: Scatter = custom(_of(Scatter))
    height_max: float = quantity("mm", above=0, usual=(0.01, 200.0), typical=2)
    horizon: float = quantity("s", at_least=0)
    stage: float = quantity("s", above=0)
    height_charge: sdp.Charge = custom(_of(sdp.Charge))
    lateness_charge: Lateness | None = custom(_lateness, default=None)
    finish_charge: FinishCharge | None = custom(_of(FinishCharge), default=None)
    pass_charge: float = quantity("$", at_least=0, default=0.0)
    min_cut: float = quantity("mm", at_least=0, usual=(0.0, 20.0), typical=0.1, default=0.0)
    late_window: float | None = quantity("s", at_least=0, default=None)
    bead_scatter: CoefficientScatter | None = custom(_of(CoefficientScatter), default=None)
    lead_length: float = quantity("mm", at_least=0, usual=(0.0, 10000.0), typical=10, default=0.0)
    waviness: float = quantity("mm", at_least=0, usual=(0.0, 20.0), typical=0.1, default=0.0)

    def _check(self) -> None:
        check_units(self.model)
        if self.scatter.total > 1:
            warn(
                f"scatter.relative_sd is {self.scatter.total:.4g}, a share of the mean (1):"
                " divide by 100 where percent is meant"
            )
        if self.bead_scatter is not None:
            self._check_bead_scatter()
        _multiple("horizon", self.horizon, self.stage)
        self._check_durations()
        self._check_charges()
        self._check_force()

    def _check_bead_scatter(self) -> None:
        refuse_c1("scatter.attribution", self.scatter)
        if self.scatter.law == "empirical":
            raise ValueError(
                "scatter.law must be another than 'empirical' with bead_scatter: the share of beads is in the"
                " sample; got 'empirical'"
            )

    def _check_durations(self) -> None:
        if isinstance(self.durations, str) or not len(self.durations):
            raise self._refused("durations", "at least one number")
        durations = tuple(
            _multiple(f"durations[{k}]", value, self.stage) for k, value in enumerate(self.durations)
        )
        for k, value in enumerate(durations):
            if value <= self.reset_time:
                raise checks.refuse(f"durations[{k}]", f"> reset_time, {self.reset_time:g} s", value, "s")
            if k and value <= durations[k - 1]:
                raise checks.refuse(
                    f"durations[{k}]", f"> durations[{k - 1}], {durations[k - 1]:g} s", value, "s"
                )
        if self.lateness_charge is None and durations[0] > self.horizon:
            rule = f"<= horizon, {self.horizon:g} s, without a lateness_charge: no pass would ever be begun"
            raise checks.refuse("durations[0]", rule, durations[0], "s")
        object.__setattr__(self, "durations", durations)

    def _check_charges(self) -> None:
        if self.height_charge.over is None:
            raise ValueError(
                "height_charge must have an over side ($/mm): every pass may overgrind; got over=None"
            )
        self.height_charge.check(self.height_max)
        late = self.lateness_charge
        if self.late_window is not None:
            if late is None:
                raise ValueError(
                    f"late_window must be None without a lateness_charge (s); got {self.late_window!r}"
                )
            _multiple("late_window", self.late_window, self.stage)
        elif late is not None and not (isinstance(late, sdp.OneSided) and late.convex):
            raise ValueError(
                f"late_window must be given with a lateness_charge that is not convex (s); got {late!r}"
            )
        if late is not None and not isinstance(late, sdp.OneSided):
            checks.charge("lateness_charge", late, float(self.late_window or 0.0))

    def _check_force(self) -> None:
        threshold = self._mean_model.threshold_force
        if self.force_max <= threshold:
            raise ValueError(
                f"force_max must be > the threshold force {threshold:.6g} N,"
                f" under which nothing is removed (N); got {self.force_max!r}"
            )
        if not any(low < high for low, high in map(self.force_interval, self.durations)):
            raise ValueError(
                "force_max, burn_limit and min_cut must leave a force for at least one of the durations (N);"
                f" got force_max {self.force_max!r}, {self.burn_limit!r}, min_cut {self.min_cut!r}"
            )

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine of a plan: name -> (value, unit), and the burn limit; no estimated value."""
        disk = valued(self.model, ("bead_width", "disk_radius"))
        limits = valued(self, ("reset_time", "force_max"))
        return valued(self, ("bead_length",)) | disk | limits | {"burn_limit": self.burn_limit}

    @cached_property
    def depths(self) -> Depths:
        """Scatter of the depth of the next pass (mm): of passes, and of beads where they differ."""
        if self.bead_scatter is None:
            return self.scatter
        both = self.scatter.log_covariance + self.bead_scatter.log_covariance
        return PredictiveDepths.of(both, self.scatter.law)

    @property
    def pass_scatter(self) -> CoefficientScatter | None:
        """Scatter of the coefficients from pass to pass (relative sd, unit 1); None: the depth scatters."""
        told = self.bead_scatter is not None or self.scatter.mean == "coefficient"
        return self.scatter.coefficients if told else None

    @cached_property
    def _mean_model(self) -> GrindingProcess:
        return self.depths.expected(self.model)

    @property
    def _way(self) -> float:
        """Way of a pass, mm: the bead and what lies beside it."""
        return self.bead_length + self.lead_length

    def feed_rate(self, duration: float) -> float:
        """Return the feed, mm/s, of a pass of `duration`, s: way over duration less reset; Brown (5.6)."""
        if duration <= self.reset_time:
            raise checks.refuse("duration", f"> reset_time, {self.reset_time:g} s", duration, "s")
        return self._way / (duration - self.reset_time)

    def duration(self, feed_rate: float) -> float:
        """Return the duration, s, of a pass at `feed_rate`, mm/s, reset included; Brown (5.6)."""
        return self._way / checks.positive("feed_rate", feed_rate, "mm/s") + self.reset_time

    def force_interval(self, duration: float) -> tuple[float, float]:
        """Return the least and greatest admissible normal force, N, of a pass of `duration`, s.

        The least force removes `min_cut` on average; at 0 it is the threshold force. The greatest is the
        least of `force_max`, the drive's peak force and the burn limit. No force is admissible where the
        first is not below the second.
        """
        feed = self.feed_rate(duration)
        low = float(self._mean_model.normal_force(self.min_cut, feed))
        high = min(self.force_max, self._mean_model.peak_force)
        if self.burn_limit is not None:
            burn_low, burn_high = self.burn_limit.interval(self._mean_model, feed)
            low, high = max(low, float(burn_low)), min(high, float(burn_high))
        return low, high

    def cut(self, duration: float, normal_force: npt.ArrayLike) -> sdp.Law:
        """Return the distribution of the depth, mm, of a pass of `duration`, s, at normal forces, N."""
        return self.depths.cut(self.model, normal_force, self.feed_rate(duration))

    def force_breaks(self, duration: float) -> tuple[float, ...]:
        """Normal forces, N, inside its interval where the depth of a pass of `duration`, s, changes form."""
        low, high = self.force_interval(duration)
        switch = float(self.depths.switch_force(self.model, self.feed_rate(duration)))
        return (switch,) if low < switch < high else ()

    def updated(self, estimate: Any) -> Self:
        """Return the problem with estimated coefficients, scatter or way beside the bead.

        Parameters
        ----------
        estimate : Estimate, ScatterEstimate, BeadScatterEstimate or Scatter
            From `weldbead.identify`: coefficients of the process by name (J/mm^3, W, 1), the `lead_length`
            (mm), scatter of the depth, or of the coefficients from pass to pass and from bead to bead.

        Raises
        ------
        ValueError
            When the estimate has failed, or names neither a coefficient of the process nor the lead length.
        """
        if isinstance(estimate, Scatter):
            return self.replace(scatter=estimate)
        scatter = getattr(estimate, "scatter", None)
        if isinstance(scatter, Scatter):
            beads = getattr(estimate, "bead_scatter", self.bead_scatter)
            return self.replace(scatter=scatter, bead_scatter=beads)
        if not hasattr(estimate, "ok"):
            raise TypeError(f"estimate must be what weldbead.identify gives, or a Scatter; got {estimate!r}")
        if not estimate.ok:
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        known = [*specs(GrindingProcess), "lead_length"]
        found = {checks.one_of("estimate.names", name, known): estimate[name] for name in estimate.names}
        own = {name: found.pop(name) for name in ("lead_length",) if name in found}
        return self.replace(model=self.model.replace(**found), **own)

    def doubts(self, data: Any) -> Doubts:
        """Return what passes say about this problem, what they do not, and what it costs not to know.

        Coefficients and scatter with their intervals against the values of the problem; contradictions
        between columns; the expected penalty of a whole bead ($), planned again on 401 nodes at both ends of
        each interval.

        Parameters
        ----------
        data : mapping of arrays, log, or table of a log
            As for `weldbead.identify`: any of grinding_power (W) and removal_rate (mm^3/s); normal_force and
            tangential_force (N); feed_rate (mm/s) and cut_depth (mm).

        Returns
        -------
        Doubts
            Rows, sentences and stakes; ``print`` shows the page.

        Raises
        ------
        ValueError, TypeError
            For missing or bad data.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> power = [150.0, 300.0, 450.0, 600.0]
        >>> rate = [5.1, 19.8, 35.2, 49.9]
        >>> problem = weldbead.preset("P1").replace(durations=(6, 12), height_max=1.0, horizon=24.0)
        >>> found = problem.doubts({"grinding_power": power, "removal_rate": rate})
        >>> found["specific_energy"].verdict, found["friction_ratio"].verdict
        ('agrees', 'not told')
        """
        return asked("sdpgrind.weldbead._doubts.doubts:doubts", self, data)


def _multiple(name: str, value: object, stage: float) -> float:
    number = checks.nonnegative(name, value, "s")
    if abs(number - round(number / stage) * stage) > 1e-9 * max(stage, number):
        raise checks.refuse(name, f"a multiple of the stage, {stage:g} s", number, "s")
    return number
