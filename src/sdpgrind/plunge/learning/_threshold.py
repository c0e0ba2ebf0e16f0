"""Burn threshold learned from inspected parts: a density of its error, and the margin of the next part.

eta = -d ln B is what no reading of a cycle shows. A part with a reserve e against burning is burned where
eta, with its scatter from part to part, exceeds e. The next margin is the quantile of the prediction: that of
the density alone forgets the scatter, and burns forty times as many parts.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr, ndtri

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge.learning._replay import replayed

STEP, REACH = 1e-3, 0.5  # chosen: grid of eta, of ln B; a finer one moves no margin by 1e-5
_LEAST_SCATTER = 1e-9  # chosen: a threshold that does not scatter is a step narrower than the grid
_SURPRISE = 1e-4  # chosen: share of the density left within 5 sd of the prior that tells another cause
LEAST_SEVERITY, _MOST_SEVERITY, _MOST_SD = 0.1, 10.0, 0.5  # chosen: beyond them a percentage is meant
_ASSUMED_SD = 0.03  # chosen: of a severity whose error is not stated; that of the simulated inspections
_EVEN = 0.25  # chosen: k, of a confidence of 0.6; below it skewness counts for more in a margin than k sd
_PRIOR_REACH = 5.0  # derived: standard deviations beyond which a normal has 6e-7


class BurnTest(NamedTuple):
    """A sacrificial part that is then etched.

    Attributes
    ----------
    controller : CycleController
        Grinds the part with its reserve at the median of the threshold.
    reserve : float
        Reserve against burning, ln of temperature.
    saving : float
        Expected time that each later part is shorter, s.
    parts : float
        Parts after which the sacrificed one, of the present time of a part, is paid.
    """

    controller: CycleController
    reserve: float
    saving: float
    parts: float


class BurnThreshold:
    """What inspected parts tell of the burn threshold B.

    Parameters
    ----------
    problem : CycleProblem
        Problem with `burning_sd` and `threshold_scatter` declared. Identify the machine first: the threshold
        rests on its model.
    confidence : float
        Chance that the next part is not burned, unit 1.

    Raises
    ------
    ValueError
        If `burning_sd` is not declared, or an argument is out of range.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation").replace(burning_sd=0.045)
    >>> threshold = plunge.BurnThreshold(problem)
    >>> threshold.update(reserve=0.14, severity=0.88, severity_sd=0.03)
    >>> round(threshold.margin, 4)  # ln of temperature; before 0.1399
    0.0877
    """

    def __init__(self, problem: CycleProblem, *, confidence: float = 0.999) -> None:
        self.problem = checks.kind("problem", problem, CycleProblem, " (see plunge.preset)")
        self.confidence = checks.confidence("confidence", confidence)
        if not problem.uncertainty.burning_sd:
            raise ValueError(
                "burning_sd must be > 0, such as 0.045: a threshold taken as exactly known learns nothing;"
                f" got {problem.uncertainty.burning_sd}"
            )
        points = round(max(REACH, _PRIOR_REACH * problem.uncertainty.burning_sd) / STEP)
        self.eta: Floats = STEP * np.arange(-points, points + 1.0)
        """Grid of eta = -d ln B, pure numbers."""
        self.density: Floats = _normalized(-0.5 * (self.eta / problem.uncertainty.burning_sd) ** 2)
        """Chance of each point of the grid."""
        self._message, self._assumed = "", False

    def update(
        self,
        log: Any = None,
        *,
        part: int | None = 0,
        reserve: float | None = None,
        burned: bool | None = None,
        miss: float = 0.0,
        false_alarm: float = 0.0,
        severity: float | None = None,
        severity_sd: float | None = None,
    ) -> None:
        """Learn from one inspected part.

        Parameters
        ----------
        log : Log or mapping, optional
            Readings of the part: time (s), command rate (mm/s), size (mm), power (W).
        part : int, optional
            Part of the log. None: its first, whatever its number.
        reserve : float, optional
            Reserve of the part (ln of temperature) in place of a log.
        burned : bool, optional
            Whether etching finds the part burned.
        miss, false_alarm : float
            Chances that etching misses a burn, and sees one on a good part. Default: it never errs.
        severity : float, optional
            Hottest temperature of the finished surface over that of damage, such as by Barkhausen noise.
        severity_sd : float
            Its relative standard deviation. Default: 0.03, with a warning.

        Raises
        ------
        ValueError
            If nothing was inspected, an argument is out of range, or the part has no reserve.
        """
        reserve = self._reserve(log, part, reserve)
        scatter = self.problem.uncertainty.threshold_scatter
        if (burned is None) == (severity is None):
            raise ValueError("burned or severity must be given, and not both")
        if severity is not None:
            off = np.log(_severity(severity)) - (self.eta - reserve)
            spread = np.hypot(self._severity_sd(severity_sd), scatter)
            self._learn(-0.5 * (off / max(float(spread), 1e-6)) ** 2)
            return
        if not isinstance(burned, bool | np.bool_):
            raise checks.refuse("burned", "True or False, as etching finds it", burned)
        seen, alarm = (
            checks.within("miss", miss, 0.0, 1.0),
            checks.within("false_alarm", false_alarm, 0.0, 1.0),
        )
        if seen + alarm >= 1.0:
            raise checks.refuse(
                "miss", f"< 1 - false_alarm = {1.0 - alarm:g}: else etching says nothing", miss
            )
        off = (self.eta - reserve) / max(scatter, _LEAST_SCATTER)
        found = (1.0 - seen, alarm) if burned else (seen, 1.0 - alarm)  # of burned parts, and of good ones
        with np.errstate(divide="ignore"):
            self._learn(np.logaddexp(np.log(found[0]) + log_ndtr(off), np.log(found[1]) + log_ndtr(-off)))

    def _severity_sd(self, value: float | None) -> float:
        """Standard deviation of a severity; the first one that is not stated warns."""
        if value is None:
            if not self._assumed:
                warn(
                    f"severity_sd is not stated: {_ASSUMED_SD:g} is assumed; where it is less than the true"
                    " one, parts burn"
                )
            self._assumed = True
            return _ASSUMED_SD
        if not 0.0 <= checks.number("severity_sd", value) <= _MOST_SD:
            raise checks.refuse("severity_sd", f"in [0, {_MOST_SD:g}], relative; 0.03 for 3 %", value)
        return value

    def _reserve(self, log: Any, part: int | None, reserve: float | None) -> float:
        if (log is None) == (reserve is None):
            raise ValueError("log or reserve must be given, and not both")
        found = (
            replayed(log, self.problem, part).reserve
            if reserve is None
            else checks.number("reserve", reserve)
        )
        if not np.isfinite(found):
            raise ValueError(
                f"part {part or 0} must have touched the work: without a reserve it teaches nothing"
            )
        return found

    def _learn(self, logarithm: Floats) -> None:
        with np.errstate(divide="ignore"):
            self.density = _normalized(np.log(self.density) + logarithm)
        near = np.abs(self.eta) <= _PRIOR_REACH * float(self.problem.uncertainty.burning_sd or 0.0)
        strange = float(self.density[near].sum()) < _SURPRISE
        self._message = "burned: find the cause" if strange else self._message

    def _exceeding(self, reserve: float) -> Floats:
        """Chance at each eta that a part with a reserve is burned, with the scatter from part to part."""
        scatter = self.problem.uncertainty.threshold_scatter
        return np.asarray(ndtr((self.eta - reserve) / max(scatter, _LEAST_SCATTER)))

    def __repr__(self) -> str:
        known = f"mean {self.mean:.4g}, sd {self.sd:.4g} of -d ln B"
        return f"BurnThreshold({known}; margin {self.margin:.4g} for a confidence of {self.confidence:.10g})"

    @property
    def mean(self) -> float:
        """Mean of eta, unit 1: the threshold is lower by this share than believed."""
        return float(self.density @ self.eta)

    @property
    def sd(self) -> float:
        """Standard deviation of eta, unit 1."""
        return float(np.sqrt(self.density @ (self.eta - self.mean) ** 2))

    @property
    def margin(self) -> float:
        """Reserve (ln of temperature, unit 1) whose part burns with a chance of 1 - confidence."""
        return self._margin(self.density)

    def _margin(self, density: Floats) -> float:
        allowed = 1.0 - self.confidence

        def lacking(reserve: float) -> float:
            return float(density @ self._exceeding(reserve)) - allowed

        return float(brentq(lacking, 2.0 * self.eta[0], 2.0 * self.eta[-1], xtol=1e-12))

    @property
    def estimate(self) -> idf.Estimate:
        """B, J/(mm^2 s^(1/2)), and `burning_sd` for `problem.updated`, whose chance is that of the margin."""
        believed, mean = self.problem.model.burning.B, self.mean
        values = np.array([believed * np.exp(-mean), self._burning_sd(self.density)])
        status = idf.Status.IMPOSSIBLE if self._message else idf.Status.OK
        return idf.Estimate(
            ("B", "burning_sd"), values, np.diag([(values[0] * self.sd) ** 2, 0.0]), status,
            self._message or f"margin {self.margin:.4f} of ln temperature", ("J/(mm^2 s^(1/2))", "1"),
        )  # fmt: skip

    def _burning_sd(self, density: Floats) -> float:
        """Normal doubt about the mean with the margin of a density; near an even chance its own sd."""
        mean, k = float(density @ self.eta), float(ndtri(self.confidence))
        if k < _EVEN:
            own = density @ (self.eta - mean) ** 2
            return float(np.sqrt(own + self.problem.uncertainty.threshold_scatter**2))
        return max(self._margin(density) - mean, 0.0) / k

    def next_test(self) -> BurnTest:
        """Return a sacrificial part at the median of the threshold, and what etching it would save.

        Returns
        -------
        BurnTest
            Controller, reserve (ln of temperature), saving (s) and parts until it is paid.
        """
        below = np.cumsum(self.density) - 0.5 * self.density
        reserve = float(np.interp(0.5, below, self.eta))
        beyond = self._exceeding(reserve)
        burns = float(self.density @ beyond)
        times = [self._time(_weighted(self.density, each)) for each in (beyond, 1.0 - beyond)]
        now = self._time(self.density)
        saving = now - (burns * times[0] + (1.0 - burns) * times[1])
        problem = self._at(reserve, 0.0)
        parts = now / saving if saving > 0.0 else np.inf
        return BurnTest(CycleController(problem, confidence=0.5), reserve, saving, parts)

    def _at(self, eta: float, sd: float) -> CycleProblem:
        """Problem with the threshold at an eta, and a doubt of it."""
        burning = self.problem.model.burning
        return self.problem.replace(
            burning=burning.replace(B=burning.B * float(np.exp(-eta))), burning_sd=sd, sharpness_sd=0.0
        )

    def _time(self, density: Floats) -> float:
        """Time (s) of a cycle planned with a density."""
        from sdpgrind.plunge._plan.doubted import Safety, limits_of
        from sdpgrind.plunge._plan.exact import fastest

        problem = self._at(float(density @ self.eta), self._burning_sd(density))
        return fastest(limits_of(problem, Safety(confidence=self.confidence)))[0]


def _severity(value: float) -> float:
    severity = checks.positive("severity", value)
    if not LEAST_SEVERITY <= severity <= _MOST_SEVERITY:
        rule = f"in [{LEAST_SEVERITY:g}, {_MOST_SEVERITY:g}], of the damage temperature; 0.95 for 95 %"
        raise checks.refuse("severity", rule, value)
    return severity


def _normalized(logarithm: Floats) -> Floats:
    density = np.exp(logarithm - logarithm.max())
    return np.asarray(density / density.sum())


def _weighted(density: Floats, likelihood: Floats) -> Floats:
    product = density * likelihood
    return np.asarray(product / product.sum())
