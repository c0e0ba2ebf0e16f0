"""Population of parts: means and standard deviations of stock and out-of-roundness."""

from math import hypot

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity

COMBINE = ("linear", "rss")
MICROMETRES = "; units.um(...) for micrometres"  # hint for a length too large in mm


@described("centering.stock")
class Stock(Described):
    """Stock and out-of-roundness of a population of parts, both on the radius.

    The largest radius of a part about the grinder's axis is normal, with the mean of finished radius, `mean`
    and `roundness`; stock and out-of-roundness are independent.

    Parameters
    ----------
    mean : float
        Mean stock on the radius, mm.
    sd : float
        Standard deviation of the stock over the parts, mm.
    roundness : float
        Mean height of the highest place over the mean radius, mm. The total indicated runout, never less, may
        be given instead.
    roundness_sd : float
        Standard deviation of `roundness` over the parts, mm.
    sigmas : float
        Allowance in standard deviations, unit 1; customary are 3 and 4.

    Raises
    ------
    ValueError
        If a value is negative, or probably in micrometres.

    Examples
    --------
    >>> stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004)
    >>> round(stock.allowance("linear"), 6), round(stock.allowance("rss"), 6)
    (0.072, 0.061188)
    """

    mean: float = quantity("mm", at_least=0, below=10.0, hint=MICROMETRES)
    sd: float = quantity("mm", at_least=0, below=3.0, hint=MICROMETRES)
    roundness: float = quantity("mm", at_least=0, below=3.0, hint=MICROMETRES)
    roundness_sd: float = quantity("mm", at_least=0, below=3.0, hint=MICROMETRES)
    sigmas: float = quantity("1", at_least=0, default=3.0)

    @property
    def height(self) -> float:
        """Mean height of the largest radius over the finished one, mm."""
        return self.mean + self.roundness

    @property
    def height_sd(self) -> float:
        """Standard deviation of `height` over the parts, mm."""
        return hypot(self.sd, self.roundness_sd)

    def allowance(self, combine: str = "linear") -> float:
        """Return the allowance for the scatter of the population, mm.

        Parameters
        ----------
        combine : {"linear", "rss"}
            "linear", as Mears: `sigmas` times the sum of both, which is more than `sigmas` of the height;
            "rss": `sigmas` times the root of the sum of squares, which is exactly that.

        Raises
        ------
        ValueError
            If `combine` is neither.
        """
        linear = checks.one_of("combine", combine, COMBINE) == "linear"
        return self.sigmas * (self.sd + self.roundness_sd if linear else self.height_sd)
