"""Coefficients of one bead, pass by pass, from what a problem says of beads and passes."""

from math import exp, isfinite, isnan, nan

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.weldbead.sequence import _belief_update as filter_
from sdpgrind.weldbead.sequence._belief_update import LogBelief, Reading
from sdpgrind.weldbead.sequence._coefficient_scatter import ASSUMED, COEFFICIENTS, CoefficientScatter
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter

_UNITS = ("J/mm^3", "W", "1")
# chosen: strange passes one after the other that end learning; 2e-12 by chance, of two readings each
_IN_A_ROW = 3
_RATIO_MAX = 2.0  # of tangential to normal force; chosen: no abrasive has more
# chosen: removal rate over the greatest that the power explains; mm^3/min in place of mm^3/s would be 60
_ABSURD = 5.0
FRESH, LEARNED, NO_READING, NOTHING_REMOVED, BROKEN = (
    "no pass yet", "learned", "no reading", "nothing removed", "not this bead's law",
)  # fmt: skip


class BeadEstimator:
    """Specific energy, idle power and friction ratio of the bead under way: belief after each pass.

    A Kalman filter on the logarithms of the three coefficients, with their full covariance. It begins with
    the problem's process and `bead_scatter`; a pass tells of them what its own `scatter` and the gauges
    leave: near the threshold force much of K2 and little of K1.

    Innovations beyond four of their standard deviations count less; after three such passes in a row the
    belief is that of a fresh bead again and stays so, with status "not this bead's law".

    Parameters
    ----------
    problem : SequenceProblem
        Problem with `bead_scatter`.
    depth_noise : float
        Standard deviation of the depth from two scans, mm.
    power_noise : float
        Standard deviation of the power gauge, W.
    force_noise : float
        Standard deviation of the force gauges, N.

    Raises
    ------
    ValueError
        When the problem has no `bead_scatter`, or a noise is negative.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> problem = weldbead.preset("P4").replace(
    ...     scatter=weldbead.Scatter(("K1", "K2", "mu"), (0.15, 0.15, 0.15), law="lognormal"),
    ...     bead_scatter=weldbead.CoefficientScatter(0.15, 0.15, 0.15))
    >>> belief = weldbead.BeadEstimator(problem)
    >>> belief.update(normal_force=50.0, tangential_force=18.0, grinding_power=800.0, removal_rate=60.0)
    >>> round(belief.estimate["friction_ratio"], 4), belief.status
    (0.3305, 'learned')
    """

    def __init__(
        self,
        problem: SequenceProblem,
        *,
        depth_noise: float = 0.0,
        power_noise: float = 0.0,
        force_noise: float = 0.0,
    ) -> None:
        checks.kind("problem", problem, SequenceProblem, " (see weldbead.preset)")
        if problem.bead_scatter is None:
            raise ValueError("problem must have a bead_scatter: without one all beads are alike; got None")
        self._problem = problem
        self._noise = (
            checks.nonnegative("depth_noise", depth_noise, "mm"),
            checks.nonnegative("power_noise", power_noise, "W"),
            checks.nonnegative("force_noise", force_noise, "N"),
        )
        self._scatter: filter_.Vector = tuple(np.diag(problem.scatter.log_covariance).tolist())
        self._prior = _prior(problem)
        self.reset()

    def reset(self) -> None:
        """Forget the bead."""
        self._belief, self._passes, self._strange, self._in_a_row = self._prior, 0, 0, 0
        self._status = FRESH

    def update(
        self,
        *,
        normal_force: float = nan,
        tangential_force: float = nan,
        grinding_power: float = nan,
        removal_rate: float = nan,
        cut_depth: float = nan,
    ) -> None:
        """Take in the readings of a pass; NaN: no reading.

        Parameters
        ----------
        normal_force, tangential_force : float
            Forces, N.
        grinding_power : float
            Power at the contact, W.
        removal_rate : float
            Removal rate, mm^3/s.
        cut_depth : float
            Depth from two scans, mm; it matters with a `depth_noise`.

        Raises
        ------
        ValueError
            When a reading is impossible: its unit may be another. The belief is kept.
        """
        if self._status == BROKEN:
            return
        worst = 0.0
        ratio = _ratio(normal_force, tangential_force)
        told = not isnan(ratio)
        energy = self._energy_told(grinding_power, removal_rate)
        if told:
            gauges = _square(self._noise[2] / normal_force) + _square(self._noise[2] / tangential_force)
            worst = self._take(filter_.friction(self._belief, self._scatter, ratio, gauges))
        if energy:
            worst = max(worst, self._take(self._energy(grinding_power, removal_rate, cut_depth)))
        self._conclude(told or energy, energy or not removal_rate <= 0, worst)

    def _energy_told(self, power: float, removal: float) -> bool:
        """Whether a pass tells of the energies; refuse readings that no metal gives."""
        if not (isfinite(power) and isfinite(removal)) or removal <= 0 or power <= 0:
            return False
        most = _ABSURD * power / self._problem.model.specific_energy
        if removal > most:
            rule = f"<= {most:.4g} at {power:.4g} W, five times what the specific energy allows; mm^3/min?"
            raise checks.refuse("removal_rate", rule, removal, "mm^3/s")
        return True

    def _energy(self, power: float, removal: float, depth: float) -> Reading:
        """Reading of power, W, and removal rate, mm^3/s, with the noise of the gauges; depth in mm."""
        of_depth = _square(self._noise[0] / depth) if depth > 0 else 0.0
        of_power = self._noise[1] / power
        return filter_.energy(self._belief, self._scatter, power, removal, of_depth, of_power)

    def _take(self, reading: Reading) -> float:
        """Take in a reading; return its innovation in standard deviations."""
        self._belief, strange = filter_.taken(self._belief, reading)
        return strange

    def _conclude(self, told: bool, removed: bool, worst: float) -> None:
        """Count the pass; give up after too many strange ones."""
        if not told:
            self._status = NO_READING if removed else NOTHING_REMOVED
            return
        self._passes += 1
        strange = worst > filter_.STRANGE
        self._strange += strange
        self._in_a_row = self._in_a_row + 1 if strange else 0
        self._status = LEARNED if removed else NOTHING_REMOVED
        if self._in_a_row >= _IN_A_ROW:
            self._belief, self._status = self._prior, BROKEN

    def learn(self, **readings: float) -> None:
        """Take in a pass (N, W, mm^3/s, mm) as `update` does; impossible readings count as missing."""
        try:
            self.update(**readings)
        except ValueError:
            self._status = NO_READING

    def report(self) -> dict[str, float]:
        """Return the believed means (J/mm^3, W, 1), and whether it learns, for a controller's report."""
        return dict(zip(COEFFICIENTS, self._means(), strict=True)) | {"learns": float(self._status != BROKEN)}

    @property
    def passes(self) -> int:
        """Number of passes (of N, W, mm^3/s) that have told something of the bead."""
        return self._passes

    @property
    def model(self) -> GrindingProcess:
        """Process with the believed means: J/mm^3, W, 1."""
        return self._problem.model.replace(**dict(zip(COEFFICIENTS, self._means(), strict=True)))

    @property
    def problem(self) -> SequenceProblem:
        """Problem whose beads are learned: J/mm^3, W."""
        return self._problem

    @property
    def identity(self) -> tuple[object, ...]:
        """Noise of the gauges (mm, W, N), and the belief where passes have told of it."""
        told = () if not self._passes else (self._belief, self._status == BROKEN)
        return (*self._noise, *told)

    @property
    def status(self) -> str:
        """Words: what the last pass (of N, W, mm^3/s) told, "learned", "no reading", "nothing removed"..."""
        return self._status

    @property
    def log_mean(self) -> tuple[float, float, float]:
        """Mean of the logarithms of K1 (J/mm^3), K2 (W) and mu."""
        return self._belief.mean

    @property
    def log_covariance(self) -> tuple[tuple[float, float, float], ...]:
        """Covariance of the logarithms of K1, K2 and mu, shape (3, 3), unit 1."""
        return self._belief.covariance

    @property
    def estimate(self) -> idf.Estimate:
        """Estimate of specific_energy (J/mm^3), idle_power (W) and friction_ratio (1): their means."""
        value, covariance = np.array(self._means()), np.array(self._belief.covariance)
        strange = f", {self._strange} of them strange" if self._strange else ""
        return idf.Estimate(
            COEFFICIENTS,
            value,
            np.outer(value, value) * np.expm1(covariance),
            message=f"{self._status}; {self._passes} passes{strange}",
            units=_UNITS,
        )

    def _means(self) -> list[float]:
        """Means of K1, K2 and mu."""
        mean, covariance = self._belief
        return [exp(mean[k] + 0.5 * covariance[k][k]) for k in range(3)]

    @property
    def believed(self) -> SequenceProblem:
        """Problem of the next pass: process and `bead_scatter` (relative sd, unit 1) as believed now."""
        scatter = CoefficientScatter.of_logs(np.array(self._belief.covariance))
        return self._problem.replace(model=self.model, bead_scatter=scatter)


def with_beads(problem: SequenceProblem) -> SequenceProblem:
    """Return a problem whose beads differ: as it says, or as beads and passes usually do."""
    if problem.bead_scatter is not None:
        return problem
    passes = Scatter(("K1", "K2", "mu"), (ASSUMED,) * 3, law="lognormal")
    return problem.replace(scatter=passes, bead_scatter=CoefficientScatter(ASSUMED, ASSUMED, ASSUMED))


def _prior(problem: SequenceProblem) -> LogBelief:
    """Belief before the first pass: the process has the means of the coefficients."""
    assert problem.bead_scatter is not None
    covariance = problem.bead_scatter.log_covariance
    means = np.array([getattr(problem.model, name) for name in COEFFICIENTS])
    with np.errstate(divide="ignore"):  # no idle power
        return LogBelief.of(np.log(means) - 0.5 * np.diag(covariance), covariance)


def _ratio(normal: float, tangential: float) -> float:
    """Ratio of two measured forces; NaN where one is missing."""
    if not (isfinite(normal) and isfinite(tangential)):
        return nan
    if normal <= 0:
        raise checks.refuse("normal_force", "> 0", normal, "N")
    ratio = tangential / normal
    if not 0 < ratio <= _RATIO_MAX:
        raise checks.refuse("tangential_force", f"in (0, {_RATIO_MAX:g}] of normal_force", tangential, "N")
    return ratio


def _square(x: float) -> float:
    """Square that is infinite where it is too large, as ``**`` is not."""
    return x * x
