"""What a population of parts brings to the grinder: stock and out-of-roundness, as means and standard deviations."""

from math import hypot

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity

COMBINE = ("linear", "rss")
MICROMETRES = "; units.um(...) for micrometres"
"""What a small length that is too large was given in."""


@described("centering.stock")
class Stock(Described):
    """Stock and out-of-roundness of a population of parts, both of the radius.

    The largest radius of a part about the grinder's axis is taken to be normal: its mean is that of the finished part, plus
    `mean`, plus `roundness`; stock and out-of-roundness scatter independently.

    Parameters
    ----------
    mean : float
        Mean stock on the radius, mm.
    sd : float
        Its standard deviation over the parts, mm.
    roundness : float
        Mean out-of-roundness, mm: how far the highest place stands out over the mean radius. The total indicated runout may be
        given instead: it is never less.
    roundness_sd : float
        Its standard deviation over the parts, mm.
    sigmas : float
        How many standard deviations are allowed for, unit 1; by custom 3 or 4.

    Raises
    ------
    ValueError
        When a value is negative, or smells of micrometres.

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
        """By how much the largest radius of the average part stands over the finished one, mm."""
        return self.mean + self.roundness

    @property
    def height_sd(self) -> float:
        """Standard deviation of that height over the parts, mm."""
        return hypot(self.sd, self.roundness_sd)

    def allowance(self, combine: str = "linear") -> float:
        """Return what is allowed for the scatter of the population, mm.

        Parameters
        ----------
        combine : {"linear", "rss"}
            "linear", as Mears: the sum of both, each times `sigmas`, which is more than `sigmas` of the height; "rss": the root
            of the sum of their squares, which is just that.

        Raises
        ------
        ValueError
            When `combine` is neither.
        """
        linear = checks.one_of("combine", combine, COMBINE) == "linear"
        return self.sigmas * (self.sd + self.roundness_sd if linear else self.height_sd)
