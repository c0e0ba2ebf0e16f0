"""End of rapid feed: by the population of parts, and by the measurement of one."""

from dataclasses import KW_ONLY
from typing import Any, NamedTuple, Self

import xarray as xr
from scipy.special import ndtr

from centering.setup._allowance import CUSTOM, best_allowance
from centering.setup._stock import COMBINE, MICROMETRES, Stock
from sdpgrind.base import checks, pictures
from sdpgrind.base.plans import Plan
from sdpgrind.base.quantities import Described, choice, described, flag, part, quantity, units_of
from sdpgrind.base.stored import decode, encode


class BothRules(NamedTuple):
    """A value by each rule.

    Attributes
    ----------
    part : float
        By the measurement of this part; a probability, from a profile an upper bound.
    population : float
        By the scatter of all parts.
    """

    part: float
    population: float


@described("centering.changeover")
class Changeover(Plan, Described):
    """Changeover of the wheel from rapid to controlled feed for one part, from `plan_changeover`.

    With s = 1, and s = -1 for a bore (internal grinding, where the smallest radius is the most material):

    * rule of the population: ``X_pop = finish_radius + s (mean + roundness + k (sd + roundness_sd) + gap)``;
    * rule of the part: ``X_part = largest_radius + s (z radius_sd + gap)``.

    Attributes
    ----------
    stock : Stock
        Population of parts, mm.
    finish_radius : float
        Radius of the finished part, mm.
    gap : float
        Reserve for heat, wheel wear and servo, mm.
    approach_rate : float
        Controlled feed in air, mm/s; with gap elimination (a sensor that detects contact) its rate until
        contact.
    largest_radius : float
        Largest radius of this part about the grinder's axis, mm; of a bore the smallest.
    radius_sd : float
        Standard deviation u of that radius, mm. From a profile, noise can only make another place the
        highest: probabilities that follow from u are then upper bounds.
    combine : {"linear", "rss"}
        Sum of the population's two scatters, see `Stock.allowance`.
    internal : bool
        True: a bore.
    sigmas : float, optional
        Allowance z in multiples of `radius_sd`, unit 1. Default: 3.
    crash_time : float, optional
        Cost of a crash, s: z is then that of least cost, see `best_allowance`; where u gives an upper bound,
        larger than that of least cost.

    Raises
    ------
    ValueError
        If a radius or a rate is not > 0, the gap or an uncertainty is negative or probably in micrometres, or
        both z and `crash_time` are given.

    Examples
    --------
    >>> stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004)
    >>> part = {"largest_radius": 35.16, "radius_sd": 0.0005}
    >>> change = Changeover(stock, finish_radius=35.0, gap=0.010, approach_rate=0.026, **part)
    >>> round(change.population_position, 6), round(change.position, 6), round(change.time_saved, 4)
    (35.242, 35.1715, 2.7115)
    >>> change
    Changeover(rapid feed to 35.1715 mm, 70.5 µm beyond the population's 35.2420 mm: 2.71 s of air saved)
    """

    kind = "centering.changeover"
    stock: Stock = part(Stock)
    _: KW_ONLY
    finish_radius: float = quantity("mm", above=0, usual=(0.5, 5000.0), typical=35)
    gap: float = quantity("mm", at_least=0, below=3.0, hint=MICROMETRES)
    approach_rate: float = quantity("mm/s", above=0, usual=(1e-4, 1000.0), typical=0.03)
    largest_radius: float = quantity("mm", above=0, usual=(0.5, 5000.0), typical=35)
    radius_sd: float = quantity("mm", at_least=0, below=3.0, hint=MICROMETRES)
    combine: str = choice(*COMBINE, default="linear")
    internal: bool = flag(default=False)
    sigmas: float | None = quantity("1", at_least=0, default=None)
    crash_time: float | None = quantity("s", above=0, default=None)

    def _check(self) -> None:
        if self.sigmas is not None and self.crash_time is not None:
            raise self._refused("sigmas", "left out where crash_time is given, which chooses them")

    @property
    def part_sigmas(self) -> float:
        """Allowance z in multiples of this part's `radius_sd`, unit 1."""
        if self.crash_time is None:
            return CUSTOM if self.sigmas is None else self.sigmas
        if self.radius_sd == 0:
            return 0.0
        return best_allowance(
            self.radius_sd, approach_rate=self.approach_rate, crash_time=self.crash_time
        ).sigmas

    @property
    def position(self) -> float:
        """Radius at which rapid feed may end for this part, X_part, mm."""
        return self.largest_radius + self._outward * (self.part_sigmas * self.radius_sd + self.gap)

    @property
    def population_position(self) -> float:
        """Radius at which rapid feed must end for any part of the population, X_pop, mm."""
        return self.finish_radius + self._outward * (
            self.stock.height + self.stock.allowance(self.combine) + self.gap
        )

    @property
    def _outward(self) -> int:
        """Direction from the part to the wheel: +1, in a bore -1."""
        return -1 if self.internal else 1

    @property
    def length_saved(self) -> float:
        """Air cutting saved, mm; negative: the part is larger than the population's rule allows."""
        return self._outward * (self.population_position - self.position)

    @property
    def time_saved(self) -> float:
        """Time saved by the measurement for this part, s."""
        return self.length_saved / self.approach_rate

    @property
    def mean_time_saved(self) -> float:
        """Upper bound of the mean time saved by the rule of the part, s; less where noise lifts the radius.

        ``(k (sd + roundness_sd) - z u)/approach_rate``.
        """
        return (self.stock.allowance(self.combine) - self.part_sigmas * self.radius_sd) / self.approach_rate

    @property
    def contact_probability(self) -> BothRules:
        """Probability that the part reaches into the gap, by each rule; by the part's an upper bound.

        From a profile the bound is tight where one place is highest by more than noise, as with a part off
        its axis or of few lobes; where many places are equally high, the largest is seldom too low. For the
        whole gap see `through_gap_probability`. The linear sum of two scatters of 3 sd each corresponds to z
        = 3 (sd + roundness_sd)/hypot(sd, roundness_sd) of the height: 4.24 for equal scatters.
        """
        return self._beyond(0.0)

    @property
    def through_gap_probability(self) -> BothRules:
        """Probability that the part reaches through the gap, by each rule; see `contact_probability`."""
        return self._beyond(self.gap)

    def _beyond(self, gap: float) -> BothRules:
        part = _tail(self.part_sigmas * self.radius_sd + gap, self.radius_sd)
        return BothRules(part, _tail(self.stock.allowance(self.combine) + gap, self.stock.height_sd))

    @property
    def outside_population(self) -> bool:
        """Whether the part has more material (mm) than the population's rule allows."""
        return self._outward * (self.largest_radius - self.population_position) > 0

    def plot(self, ax: Any = None) -> Any:
        """Draw both rules on the radius (mm), the population's distribution, this part; return the figure.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes. Default: a new figure.
        """
        return pictures.drawn("centering.setup._changeover_picture:plot", self, ax)

    @property
    def dataset(self) -> xr.Dataset:
        """Labelled values for the machine: radii in mm, times in s, probabilities; the plan as attribute."""
        given = {name: units_of(type(self))[name] for name in ("largest_radius", "radius_sd")}
        units = {"position": "mm", "population_position": "mm", **given, "time_saved": "s"}
        data = {name: ((), getattr(self, name), {"units": unit}) for name, unit in units.items()}
        told = {"units": "1", "long_name": "probability of reaching into the gap, at most"}
        chance = ("rule", list(self.contact_probability), told)
        return xr.Dataset(
            data | {"contact_probability": chance},
            {"rule": list(BothRules._fields)},
            {"changeover": encode(self)},
        )

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        return checks.kind("changeover", decode(dataset.attrs["changeover"]), cls)

    def _told(self) -> str:
        nearer, time = 1e3 * self.length_saved, self.time_saved
        told = f"{abs(nearer):.4g} µm {'beyond' if nearer >= 0 else 'short of'} the population's"
        told = f"{told} {self.population_position:.4f} mm"
        end = f"{time:.3g} s of air saved" if time >= 0 else f"{-time:.3g} s more of air, and no crash"
        return f"rapid feed to {self.position:.4f} mm, {told}: {end}"


def _tail(allowance: float, sd: float) -> float:
    """Probability that a normal variable exceeds its mean by more than the allowance."""
    return float(ndtr(-allowance / sd)) if sd > 0 else 0.0
