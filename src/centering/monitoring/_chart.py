"""Control charts of single values, moving range and average."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite, isnan, pi, sqrt
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.special import ndtr

from centering.monitoring import _part_record as part_record
from centering.monitoring._alarm import units_of, with_space
from centering.monitoring._sequential import ewma_run_length, ewma_sd, is_missing
from sdpgrind.base import checks, pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.records import Record
from sdpgrind.base.reported import Reported

_RANGE = 2 / sqrt(pi)  # derived: mean moving range of standard normal values, 1.128
_FEWEST = 20  # chosen: least number of parts of a batch; with 20, signals come 5.6 times as often
RULES = ("value", "range", "average")


@dataclass(frozen=True)
class ChartLimits:
    """Limits of one quantity, in its unit.

    Attributes
    ----------
    mean, sd : float
        Of the batch; the standard deviation is the mean moving range over 1.128.
    low, high : float
        Limits of single values.
    range_high : float
        Limit of the moving range (difference of consecutive parts).
    average_low, average_high : float
        Limits of the exponentially weighted average.
    """

    mean: float
    sd: float
    low: float
    high: float
    range_high: float
    average_low: float
    average_high: float


class ChartSignal(NamedTuple):
    """A value beyond its limit.

    Attributes
    ----------
    quantity : str
        Name of the quantity.
    part : int
        Number of the part; the first after the batch is 0.
    rule : {"value", "range", "average"}
        Chart.
    value, limit : float
        In the unit of the quantity.
    unit : str
        Unit of the quantity.
    """

    quantity: str
    part: int
    rule: str
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        beyond = "above" if self.value > self.limit else "below"
        what = {"value": "", "range": "change of ", "average": "average of "}[self.rule]
        limit = f"{self.limit:.4g}{with_space(self.unit)}"
        return f"part {self.part}: {what}{self.quantity} {self.value:.4g} is {beyond} {limit}"


class ControlChart(Reported, Record):
    """Control charts of several quantities, with limits from a first batch.

    Limits per quantity: single values ``mean +- sigmas sd``; moving range ``sqrt(2) sigmas sd``; average ``a
    <- a + weight (x - a)`` within ``mean +- sigmas sd sqrt(weight/(2 - weight))``. The standard deviation
    comes from the moving range of the batch, so that slow changes do not widen the limits.

    The limit of the range differs from common practice, 3.267 times its mean for 3 sigmas, which treats a
    range as normal and alarms falsely once in 109 parts; here it is 3.76 times, with a false alarm in 370
    parts like that of single values. For all three charts together see `parts_per_false_alarm`. Values should
    be nearly normal and independent. Roundness and amplitudes of undulations are skew where they are not much
    larger than their scatter, and pass upper limits more often: use their logarithms.

    Parameters
    ----------
    batch : mapping of str to array_like
        First values of each quantity, of at least 20 parts, in its unit: "roundness" (mm), "stock" (mm),
        amplitudes (mm) or any other.
    units : mapping of str to str, optional
        Units. Default: mm ("mu_kinetic": 1).
    sigmas : float
        Distance of the limits in standard deviations, unit 1.
    weight : float
        Weight of the newest part in the average, in (0, 1], unit 1.

    Raises
    ------
    ValueError, TypeError
        For fewer than 20 values, values that are all alike, or a weight out of range.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> roundness = 0.010 + 0.001 * rng.standard_normal(50)
    >>> stock = 0.15 + 0.02 * rng.standard_normal(50)
    >>> chart = ControlChart({"roundness": roundness, "stock": stock})
    >>> chart.update(roundness=0.0101, stock=0.149)
    ()
    >>> print(*chart.update(roundness=0.0102, stock=0.230), sep="; ")
    part 1: stock 0.23 is above 0.2043 mm; part 1: change of stock 0.081 is above 0.07988 mm
    >>> chart.summary["quantities"]["stock"]["in_control"]
    False
    """

    kind = "centering.chart"

    def __init__(
        self,
        batch: Mapping[str, npt.ArrayLike],
        *,
        units: Mapping[str, str] | None = None,
        sigmas: float = 3.0,
        weight: float = 0.2,
    ) -> None:
        if not isinstance(batch, Mapping) or not batch:
            raise TypeError(f"batch must be a mapping of names to values; got {checks.shown(batch)}")
        self._units = units_of(batch, units)
        self._sigmas = checks.positive("sigmas", sigmas, "1")
        self._weight = checks.share("weight", weight, "1")
        self._batch = {name: _batch(name, values, self._units[name]) for name, values in batch.items()}
        self._limits = {name: self._limited(values) for name, values in self._batch.items()}
        self.reset()

    def _limited(self, values: Floats) -> ChartLimits:
        mean, sd = float(values.mean()), float(np.abs(np.diff(values)).mean()) / _RANGE
        away, average = self._sigmas * sd, self._sigmas * sd * ewma_sd(self._weight)
        return ChartLimits(mean, sd, mean - away, mean + away, sqrt(2) * away, mean - average, mean + average)

    def reset(self) -> None:
        """Forget all parts after the batch."""
        self._values: dict[str, list[float]] = {name: [] for name in self._limits}
        self._averages = {name: [limits.mean] for name, limits in self._limits.items()}
        self._last = dict.fromkeys(self._limits, np.nan)
        self._signals: list[ChartSignal] = []
        self._count = 0

    @property
    def count(self) -> int:
        """Number of parts after the batch."""
        return self._count

    @property
    def limits(self) -> dict[str, ChartLimits]:
        """Limits by name, each in the unit of its quantity."""
        return dict(self._limits)

    @property
    def signals(self) -> tuple[ChartSignal, ...]:
        """All signals so far, in the units of their quantities."""
        return tuple(self._signals)

    @property
    def parts_per_false_alarm(self) -> float:
        """Least mean number of parts between false alarms of all charts, unit 1, for exact limits.

        The rates of the three charts of each quantity are added; coinciding alarms make it larger. Limits
        from few parts are inexact: signals come 5.6 times as often with a batch of 20, 2.4 times with 50, 1.3
        times with 200.
        """
        tail = 2 * ndtr(-self._sigmas)  # single values, and ranges
        average = 1 / ewma_run_length(self._weight, self._sigmas * ewma_sd(self._weight))
        return float(1 / ((2 * tail + average) * len(self._limits)))

    def update(self, **values: float) -> tuple[ChartSignal, ...]:
        """Take in one part.

        Parameters
        ----------
        **values
            Quantities by name, in their units; left out or NaN: not measured.

        Returns
        -------
        tuple of ChartSignal
            Signals of this part.

        Raises
        ------
        ValueError, TypeError
            For an unknown name, or a value that is no number.
        """
        for name, value in values.items():
            checks.one_of("values", name, self._limits)
            if not is_missing(value):
                checks.number(name, value, self._units[name])
        found = [
            signal for name in self._limits for signal in self._take(name, float(values.get(name, np.nan)))
        ]
        self._signals.extend(found)
        self._count += 1
        return tuple(found)

    def _take(self, name: str, value: float) -> list[ChartSignal]:
        """Put one value on its charts; return the signals."""
        limits, average = self._limits[name], self._averages[name][-1]
        self._values[name].append(value)
        if isnan(value):
            self._averages[name].append(average)
            return []
        average += self._weight * (value - average)
        self._averages[name].append(average)
        change, self._last[name] = abs(value - self._last[name]), value
        ranges = (
            ("value", value, limits.low, limits.high),
            ("range", change, -np.inf, limits.range_high),
            ("average", average, limits.average_low, limits.average_high),
        )
        return [
            ChartSignal(name, self._count, rule, seen, low if seen < low else high, self._units[name])
            for rule, seen, low, high in ranges
            if seen < low or seen > high
        ]

    @property
    def summary(self) -> dict[str, Any]:
        """State for the machine upstream, as JSON: unit, limits, last value, average, signals per quantity.

        "in_control": the last part gave no signal; "last" is None before the first measurement.
        """
        told = {name: self._told(name) for name in self._limits}
        return {"parts": self._count, "sigmas": self._sigmas, "weight": self._weight, "quantities": told}

    def _told(self, name: str) -> dict[str, Any]:
        now = [
            signal for signal in self._signals if signal.quantity == name and signal.part == self._count - 1
        ]
        last = self._last[name]
        return {
            "unit": self._units[name],
            **asdict(self._limits[name]),
            "last": last if isfinite(last) else None,
            "average": self._averages[name][-1],
            "in_control": not now,
            "signals": [str(signal) for signal in now],
        }

    def plot(self) -> Any:
        """Draw values, average and moving range over the parts (small ones in µm); return the figure."""
        return pictures.drawn("centering.monitoring._chart_picture:plot", self)

    def _written(self) -> xr.Dataset:
        batch = {name: values.tolist() for name, values in self._batch.items()}
        settings = {"batch": batch, "units": self._units, "sigmas": self._sigmas, "weight": self._weight}
        return part_record.dataset_of(self._values, self._units, settings)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        settings = part_record.settings_in(dataset)
        chart = cls(settings.pop("batch"), **settings)
        for values in part_record.parts_in(dataset):
            chart.update(**values)
        return chart

    def _history(self, name: str) -> tuple[Floats, Floats, Floats]:
        """Batch, values after it, averages after it."""
        return self._batch[name], np.array(self._values[name]), np.array(self._averages[name][1:])

    def __repr__(self) -> str:
        out = [name for name in self._limits if not self._told(name)["in_control"]]
        state = f"out of control: {', '.join(out)}" if out else "in control"
        return f"ControlChart({', '.join(self._limits)} over {counted(self._count, 'part')}: {state})"


def _batch(name: str, values: npt.ArrayLike, unit: str) -> Floats:
    """Checked batch of one quantity."""
    array = checks.finite_array(name, values, unit)
    if array.ndim != 1 or array.size < _FEWEST:
        raise checks.refuse(f"batch[{name!r}]", f"{_FEWEST} values or more", array.size)
    if np.ptp(array) == 0:
        raise checks.refuse(f"batch[{name!r}]", "values that are not all alike", float(array[0]), unit)
    return array
