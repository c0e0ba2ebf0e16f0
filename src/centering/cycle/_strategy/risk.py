"""Risk of a strategy where friction is not what it was told: times, pushes, parts thrown, by factor."""

from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np
import xarray as xr
from scipy.special import betaincinv

from centering._problem.model import GRAVITY
from centering._problem.problem import checked_range
from centering.cycle._strategy.choice import PushChoice
from centering.cycle._strategy.limit_curve import needed
from centering.cycle._strategy.outcomes import OutcomeTable
from centering.cycle._strategy.simulation import Followed, Parts
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, count, described, units_of
from sdpgrind.base.records import Record
from sdpgrind.base.rng import Seed, generator
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable

if TYPE_CHECKING:
    import pandas as pd


_NEAREST = 0.1  # chosen: least offset of a part over the greatest, as of a simulated machine
_TAIL = 0.025  # derived: chance beyond either end of a 95 % interval
_MANY = 0.95  # derived: the quantile that is told
_COLUMNS = {
    "time": "mean time of a part",
    "time_95": "time that 95 % of the parts keep",
    "pushes": "mean number of pushes",
    "thrown": "share of the parts that the table throws",
    "unfinished": "share of the parts that are not centred",
}


class Doubted(Followed, Protocol):
    """Interface of a strategy for its risk; see `Strategy`."""

    outcomes: OutcomeTable


@described("centering.risk")
class RiskTable(Record, ByValue, Described):
    """Risk of a strategy by the factor of friction, from `Strategy.robust`.

    Parameters
    ----------
    factor : array, (F,)
        True mean friction over that of the model, unit 1.
    time, time_95 : array, (F,)
        Mean time of a part, and the time that 95 % of the parts keep, s.
    pushes : array, (F,)
        Mean number of pushes, unit 1.
    thrown, unfinished : array, (F,)
        Shares of the parts that the table throws in its first run-up, and of those that are not centred after
        the greatest number of pushes, unit 1.
    runs : int
        Simulated parts at each factor. Default: 0, not known.

    Raises
    ------
    ValueError
        A column is not finite.

    Examples
    --------
    >>> columns = {"time": [2.6, 2.1], "time_95": [3.4, 2.8], "pushes": [4.1, 2.9]}
    >>> risk = RiskTable(factor=[0.6, 1.0], **columns, thrown=[0.01, 0.0], unfinished=[0.0, 0.0], runs=200)
    >>> print(risk.told.replace("; ", chr(10)))
    friction x 0.6 to 1
    slowest on average at x 0.6: 2.60 s, 95 % of parts within 3.40 s
    2 of 200 thrown (3.6 % at most, 95 %) at x 0.6
    none of 200 left uncentred (1.8 % at most, 95 %)
    >>> risk.to_dataframe()["time"].tolist()  # s
    [2.6, 2.1]
    """

    kind = "centering.risk"
    factor: Floats = array("1")
    time: Floats = array("s")
    time_95: Floats = array("s")
    pushes: Floats = array("1")
    thrown: Floats = array("1")
    unfinished: Floats = array("1")
    runs: int = count(at_least=0, default=0)

    @property
    def worst(self) -> int:
        """Row of the factor with the longest mean time, s."""
        return int(np.argmax(self.time))

    @property
    def dataset(self) -> xr.Dataset:
        """Columns by the factor of friction, with units."""
        units = units_of(type(self))
        labels = {name: {"units": units[name], "long_name": words} for name, words in _COLUMNS.items()}
        columns = {name: ("factor", getattr(self, name), label) for name, label in labels.items()}
        factor = {"units": units["factor"], "long_name": "true mean friction over that of the model"}
        return xr.Dataset(columns, {"factor": ("factor", self.factor, factor)}, {"runs": self.runs})

    def table(self) -> AmountTable:
        """Return the table of a page: times (s), pushes and shares (unit 1) by factor of friction."""
        names = ("factor", *_COLUMNS)
        known = units_of(type(self))
        columns = [Amounts.of(name, getattr(self, name), known[name]) for name in names]
        return AmountTable(f"Risk by the true friction over that told: {self.told}", columns)

    def to_dataframe(self) -> "pd.DataFrame":
        """Return times (s), pushes and shares (unit 1) as a table, a row for each factor."""
        return self.dataset.to_dataframe()

    def _written(self) -> xr.Dataset:
        return self.dataset

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        columns = {name: dataset[name].values for name in ("factor", *_COLUMNS)}
        return cls(**columns, runs=int(dataset.attrs.get("runs", 0)))

    @property
    def told(self) -> str:
        """One line: range of friction, slowest factor (s), parts thrown and not centred at the worst."""
        return (
            f"friction x {self.factor[0]:g} to {self.factor[-1]:g}; slowest on average at"
            f" x {self.factor[self.worst]:g}: {self.time[self.worst]:.2f} s, 95 % of parts within"
            f" {self.time_95[self.worst]:.2f} s; {self._most(self.thrown, 'thrown')};"
            f" {self._most(self.unfinished, 'left uncentred')}"
        )

    def _most(self, shares: Floats, what: str) -> str:
        """The largest share as a count of parts, the upper end of its 95 % interval, and its factor."""
        worst = int(np.argmax(shares))
        place = f" at x {self.factor[worst]:g}" if shares[worst] > 0 else ""
        if not self.runs:
            return f"at most {100 * shares[worst]:.2g} % of the parts simulated {what}{place}"
        parts = round(shares[worst] * self.runs)
        told = f"{parts or 'none'} of {self.runs} {what}"
        return f"{told} ({_percent(_upper_end(parts, self.runs))} % at most, 95 %){place}"

    def __repr__(self) -> str:
        return f"RiskTable({self.told})"


def _percent(share: float) -> str:
    return f"{100 * share:.2g}" if share < 0.01 else f"{100 * share:.1f}"


def _upper_end(found: int, runs: int) -> float:
    """Upper end of the 95 % interval of a share (Clopper and Pearson); of none 1 - 0.025^(1/runs)."""
    return 1.0 if found >= runs else float(betaincinv(found + 1, runs - found, 1 - _TAIL))


def robust(strategy: Doubted, friction_range: Any, runs: int, rng: Seed) -> RiskTable:
    """Follow a strategy at five factors of friction; see `Strategy.robust`."""
    low, high = checked_range("friction_range", friction_range)
    checks.count("runs", runs)
    both = low < 1.0 < high  # else the range has 1 as an end
    halves = [low, 0.5 * (low + 1.0), 1.0, 0.5 * (1.0 + high), high]
    factors = np.array(halves) if both else np.linspace(low, high, 5)
    rows = [
        _row(strategy, float(factor), runs, each)
        for factor, each in zip(factors, generator(rng).spawn(5), strict=True)
    ]
    columns = dict(zip(_COLUMNS, np.array(rows).T, strict=True))
    return RiskTable(factors, **columns, runs=runs)


def _row(strategy: Doubted, factor: float, runs: int, random: np.random.Generator) -> tuple[float, ...]:
    """Columns of a factor."""
    most = strategy.problem.offset_max
    start = most * (_NEAREST + (1.0 - _NEAREST) * (np.arange(runs) + random.uniform(size=runs)) / runs)
    parts = _LookedUp(strategy, start, random, factor)
    found = parts.run()
    time = found.time.copy()
    time[parts.thrown] += [strategy.timing.start_time(float(d)) for d in start[parts.thrown]]
    return (
        float(time.mean()),
        float(np.quantile(time, _MANY)),
        float(found.pushes.mean()),
        float(parts.thrown.mean()),
        float(parts.waiting.mean()),
    )


class _LookedUp(Parts):
    """Parts of another friction by the tables of the plan; the first push falls into the run-up."""

    def __init__(self, strategy: Doubted, start: Floats, random: np.random.Generator, factor: float) -> None:
        self._table = strategy.outcomes
        super().__init__(strategy, start, random, factor)
        places = zip(start.tolist(), self.phase.tolist(), strict=True)
        held = np.array([_held(strategy, offset, phase) for offset, phase in places])
        self.thrown = strategy.problem.model.mu_static * GRAVITY * self.scale < held

    def _travel(self, at: Any, choices: list[PushChoice], unit: Floats) -> Floats:
        place = self.offset[at] - self.measured[at] + self.scatter.stop_sd * unit[1, at]
        return np.array(
            [
                self._table.expected(choice.kind, choice.stroke + p, self._friction(int(k), unit[:, k]))
                for k, choice, p in zip(at, choices, place, strict=True)
            ]
        )


def _held(strategy: Doubted, offset: float, phase: float) -> float:
    """Friction mu g (mm/s^2) that holds a ring up to its `first_push` (mm, rad)."""
    there = strategy.timing.first_speeds(offset, phase)
    rates = strategy.timing.limit.accelerations(offset, there)
    radius = strategy.problem.model.part.radius
    return float(needed(offset * np.hypot(there**2, rates), rates * radius).max())
