"""Allowance of least cost between air cutting and crashes."""

from math import exp, log, pi, sqrt

from scipy.special import ndtr

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity

CUSTOM = 3.0  # chosen: customary allowance in standard deviations
_RARE = 999.5e-6  # derived: probabilities from here on round to 1000 ppm and are shown in per cent


@described("centering.allowance")
class Allowance(Described):
    """Allowance of least cost, from `best_allowance`, and the cost of any other.

    Per part z standard deviations of air cost ``z sd/approach_rate``; a crash costs `crash_time` with
    probability ``1 - Phi(z)``. The optimum ``sd/approach_rate = crash_time phi(z)`` is a minimum for z >= 0;
    at z < 0 most parts would crash.

    Attributes
    ----------
    sd : float
        Standard deviation of the largest radius, mm.
    approach_rate : float
        Feed in air, mm/s.
    crash_time : float
        Cost of a crash in machine time, s.

    Examples
    --------
    >>> best = best_allowance(0.02, approach_rate=0.026, crash_time=300.0)
    >>> round(best.sigmas, 4), round(best.length, 5), round(best.cost(), 3)
    (3.1772, 0.06354, 2.667)
    >>> round(best.cost(3.0) - best.cost(), 4)
    0.0456
    """

    sd: float = quantity("mm", above=0)
    approach_rate: float = quantity("mm/s", above=0, usual=(1e-4, 1000.0), typical=0.03)
    crash_time: float = quantity("s", above=0)

    @property
    def sigmas(self) -> float:
        """Allowance in standard deviations, unit 1: ``sqrt(2 ln(C v/(s sqrt(2 pi))))``, at least 0."""
        density = self.sd / (self.approach_rate * self.crash_time)
        return sqrt(-2 * log(density * sqrt(2 * pi))) if density * sqrt(2 * pi) < 1 else 0.0

    @property
    def length(self) -> float:
        """Allowance as a length, mm."""
        return self.sigmas * self.sd

    @property
    def contact_probability(self) -> float:
        """Probability that a part is larger than the allowance."""
        return float(ndtr(-self.sigmas))

    def cost(self, sigmas: float | None = None) -> float:
        """Return the expected cost of air and crashes per part, s.

        Parameters
        ----------
        sigmas : float, optional
            Allowance in standard deviations, unit 1. Default: that of least cost.
        """
        z = self.sigmas if sigmas is None else checks.number("sigmas", sigmas, "1")
        return float(z * self.sd / self.approach_rate + self.crash_time * ndtr(-z))

    def marginal_cost(self, sigmas: float | None = None) -> float:
        """Return the derivative of `cost` by `sigmas`, s per standard deviation; see `cost`."""
        z = self.sigmas if sigmas is None else checks.number("sigmas", sigmas, "1")
        return self.sd / self.approach_rate - self.crash_time * exp(-z * z / 2) / sqrt(2 * pi)

    def __repr__(self) -> str:
        more = self.cost(CUSTOM) - self.cost()
        return (
            f"Allowance({self.sigmas:.4g} sd = {self.length:.4g} mm: {self.cost():.4g} s a part,"
            f" contact in {probability_text(self.contact_probability)}; {CUSTOM:g} sd cost {more:.3g} s more)"
        )


def best_allowance(sd: float, *, approach_rate: float, crash_time: float) -> Allowance:
    """Return the allowance of least cost: start of controlled feed over the mean of the parts.

    Parameters
    ----------
    sd : float
        Standard deviation of the largest radius, mm: over the parts, or of the measurement of one.
    approach_rate : float
        Feed in air, mm/s.
    crash_time : float
        Cost of a crash in machine time, s: dressing, a new wheel, scrap.

    Returns
    -------
    Allowance
        Allowance, mm, and costs, s.

    Raises
    ------
    ValueError
        If a value is not > 0.

    Examples
    --------
    >>> from math import hypot
    >>> best_allowance(hypot(0.02, 0.004), approach_rate=0.026, crash_time=300.0)
    Allowance(3.171 sd = 0.06468 mm: 2.715 s a part, contact in 760 ppm; 3 sd cost 0.043 s more)
    """
    return Allowance(sd, approach_rate, crash_time)


def probability_text(probability: float) -> str:
    """Three digits of a probability: in ppm below 1000 ppm, else in per cent."""
    return f"{1e6 * probability:.3g} ppm" if probability < _RARE else f"{100 * probability:.3g} %"
