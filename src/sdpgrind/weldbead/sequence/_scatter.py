"""Scatter of the depth of a pass from random coefficients of the process."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, choice, custom, described, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.weldbead.sequence._coefficient_scatter import CoefficientScatter
from sdpgrind.weldbead.sequence._depths import Depths
from sdpgrind.weldbead.sequence._predictive import PredictiveDepths
from sdpgrind.weldbead.sequence._process import GrindingProcess

ATTRIBUTIONS = ("C1", "K1", "K2", "mu")
LAWS = ("rayleigh", "lognormal", "normal", "empirical")
MEANS = ("cut", "coefficient")


@described("weldbead.scatter")
class Scatter(Depths, Described):
    """Random depth of a pass: random coefficient, its relative standard deviation, distribution of the depth.

    Standard deviation of the depth, with r that of the coefficient (relative), m the mean depth, Pi the power
    and b = beta mu R F the loss of speed; Brown (1988), (4.9):

    ==== ===================================================================================
    "C1" r Pi/(K1 w V): 1/K1 random, C2 not; Brown (4.9a)
    "K1" r m: the specific energy random, in both C1 and C2; fast passes are not more accurate
    "K2" r K2/(K1 w V), Brown (4.9b)
    "mu" 1e-3 mu R F sqrt((omega0 - 2 b)^2 r^2 + 2 b^2 r^4)/(K1 w V), exact for a normal mu;
         without droop (4.9c)
    ==== ===================================================================================

    Parameters
    ----------
    attribution : str or tuple of str
        "C1", "K1", "K2", "mu", or several of them, independent: their variances add.
    relative_sd : float or tuple of float
        Standard deviation over mean of the coefficient, >= 0, unit 1; one per attribution.
    law : {"rayleigh", "lognormal", "normal", "empirical"}
        Distribution of the depth: `sdp.Rayleigh`, `sdp.LogNormal`, `sdp.RectifiedNormal`, `sdp.Empirical`.
    sample : sequence of float, optional
        Sample of the empirical law, refused with the others, unit 1: only its shape counts.
    bandwidth : float
        Kernel of the empirical law, in standard deviations of the sample, unit 1: 0 or in [0.01, 10].
    mean : {"cut", "coefficient"}
        Whose mean the process has: "cut", the mean depth is that of its coefficients, as of laws fitted to
        depths; "coefficient", K1, K2 and mu are log-normal with these means, and the mean depth is larger, by
        r^2 where K1 scatters.

    Raises
    ------
    ValueError
        For an unknown attribution or law, a relative sd < 0, a total > 1/2 with the normal law (too much lies
        below 0), a missing or useless sample, or "C1" with the means of coefficients.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> mean, sd = Scatter("C1", 0.15).moments(process, normal_force=50.0, feed_rate=12.5)
    >>> float(mean), float(sd.round(6))
    (0.344, 0.0612)
    """

    attribution: str | tuple[str, ...] = custom()
    relative_sd: float | tuple[float, ...] = custom(unit="1")
    law: str = choice(*LAWS, default="rayleigh")
    sample: tuple[float, ...] | None = custom(unit="1", default=None)
    bandwidth: float = quantity("1", default=0.0)
    mean: str = choice(*MEANS, default="cut")

    def _check(self) -> None:
        if not isinstance(self.attribution, str | tuple | list):
            one = f"{ATTRIBUTIONS[0]!r}, or several of {', '.join(map(repr, ATTRIBUTIONS))}"
            raise TypeError(f"attribution must be {one}; got {checks.shown(self.attribution)}")
        names = checks.unique("attribution", self._sources)
        for name in names:
            checks.one_of("attribution", name, ATTRIBUTIONS)
        several = not isinstance(self.attribution, str)
        given = self.relative_sd if several else (self.relative_sd,)
        if not isinstance(given, tuple | list) or len(given) != len(names) or not names:
            raise ValueError(
                f"relative_sd must be one number (1) for each of {self.attribution!r};"
                f" got {self.relative_sd!r}"
            )
        values = tuple(checks.nonnegative("relative_sd", value) for value in given)
        object.__setattr__(self, "attribution", names if several else self.attribution)
        object.__setattr__(self, "relative_sd", values if several else values[0])
        if self.law == "normal" and self.total > 0.5:
            together = ", the root of the sum of squares" if several else ""
            raise self._refused("relative_sd", f"<= 0.5 with a normal law{together}", self.total)
        if self.mean == "coefficient":
            refuse_c1("attribution", self)
        self._check_sample()

    def _check_sample(self) -> None:
        if self.law != "empirical":
            if self.sample is not None or self.bandwidth:
                raise ValueError(
                    f"sample and bandwidth must be left out unless law is 'empirical'; got law {self.law!r}"
                )
            return
        if self.sample is None:
            raise ValueError("sample must be given with law 'empirical'; got None")
        sdp.Empirical(1.0, 1.0, self.sample, self.bandwidth)
        object.__setattr__(self, "sample", tuple(float(value) for value in self.sample))

    @property
    def _sources(self) -> tuple[str, ...]:
        return (self.attribution,) if isinstance(self.attribution, str) else tuple(self.attribution)

    def _relative(self, name: str) -> float:
        values = self.relative_sd if isinstance(self.relative_sd, tuple) else (self.relative_sd,)
        return dict(zip(self._sources, values, strict=True)).get(name, 0.0)

    @property
    def coefficients(self) -> CoefficientScatter:
        """Scatter of the coefficients from pass to pass (relative sd, unit 1); "C1" is none of them."""
        return CoefficientScatter(self._relative("K1"), self._relative("K2"), self._relative("mu"))

    @property
    def log_covariance(self) -> Floats:
        """Covariance of the logarithms of K1, K2 and mu, shape (3, 3), unit 1."""
        return self.coefficients.log_covariance

    @property
    def _predictive(self) -> PredictiveDepths:
        return PredictiveDepths.of(self.log_covariance, self.law)

    def expected(self, process: GrindingProcess) -> GrindingProcess:
        """Return the process of the mean cut: a random mu raises the mean of mu^2, the droop, by 1 + r^2.

        Its mean power, threshold force, peak force (N) and mean cut (mm) are averages over mu. Other
        attributions change nothing, unless coefficients keep their means (`mean`).
        """
        if self.mean == "coefficient":
            return self._predictive.expected(process)
        factor = 1 + self._relative("mu") ** 2
        return (
            process
            if factor == 1 or not process.speed_droop
            else process.replace(speed_droop=factor * process.speed_droop)
        )

    def power_moments(self, process: GrindingProcess, normal_force: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return mean and sd, W, of the power that removes, K1 w V depth, of a process at a force, N."""
        if self.mean == "coefficient":
            return self._predictive.power_moments(process, normal_force)
        force = np.asarray(normal_force, dtype=float)
        power = self.expected(process).grinding_power(force)
        mean = np.maximum(power - process.idle_power, 0.0)
        torque_power = process.friction_ratio * process.disk_radius * force / N_MM_S_PER_W
        loss = process.speed_droop * process.friction_ratio * process.disk_radius * force
        r = self._relative("mu")
        variance = (
            (self._relative("C1") * power) ** 2
            + (self._relative("K1") * mean) ** 2
            + (self._relative("K2") * process.idle_power) ** 2
            + torque_power**2 * ((process.free_speed - 2 * loss) ** 2 * r**2 + 2 * loss**2 * r**4)
        )
        return mean, np.where(mean > 0, np.sqrt(variance), 0.0)

    def _law(self, mean: Floats, sd: Floats) -> sdp.Law:
        if self.law != "empirical":
            return super()._law(mean, sd)
        return sdp.Empirical(mean, sd, () if self.sample is None else self.sample, self.bandwidth)

    @property
    def total(self) -> float:
        """Root of the sum of squares of the relative standard deviations, unit 1."""
        return sqrt(sum(self._relative(name) ** 2 for name in self._sources))


def refuse_c1(name: str, scatter: Scatter) -> None:
    """Refuse C1 where coefficients are told apart: it moves K1 and K2 together, as mu does."""
    if "C1" in scatter._sources:
        raise checks.refuse(
            name,
            'of "K1", "K2" and "mu" where coefficients keep their means or differ between beads: "C1" moves'
            " K1 and K2 together and cannot be told from mu",
            scatter.attribution,
        )
