"""Response surface of a study: quadratic in numbers with 3 levels or more, linear with 2, names by level."""

import dataclasses

import numpy as np

from sdpgrind import identify
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._anova import anova
from sdpgrind.finishing.study._observations import Observations, analysed, present
from sdpgrind.finishing.study._pooling import Pool
from sdpgrind.finishing.study._settings import Level


@dataclasses.dataclass(frozen=True)
class FactorAxis:
    """Axis of a factor on the surface."""

    factor: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether all levels are numbers."""
        return all(isinstance(level, float) for level in self.levels)

    @property
    def logarithmic(self) -> bool:
        """Whether the coordinate is logarithmic: all levels are positive numbers."""
        return self.numeric and min(map(float, self.levels)) > 0

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest level, in its own unit."""
        numbers = [float(level) for level in self.levels]
        return min(numbers), max(numbers)

    @property
    def degree(self) -> int:
        """Degree of the polynomial; 0 for names."""
        return 0 if not self.numeric else min(2, len(self.levels) - 1)

    def coordinate(self, value: Level) -> float:
        """Coordinate of a level: -1 at the least, 1 at the greatest."""
        low, high = self.ends
        if self.logarithmic:
            low, high, at = np.log(low), np.log(high), np.log(float(value))
        else:
            at = float(value)
        return float((2 * at - low - high) / (high - low))

    def value(self, coordinate: float) -> float:
        """Level at a coordinate, in its own unit."""
        low, high = self.ends
        share = 0.5 * (coordinate + 1)
        return float(low * (high / low) ** share if self.logarithmic else low + share * (high - low))

    def columns(self, value: Level) -> list[float]:
        """Entries of a level in a row of the design."""
        if not self.numeric:
            return [float(value == other) for other in self.levels[1:]]
        x = self.coordinate(value)
        return [x**k for k in range(1, self.degree + 1)]


@dataclasses.dataclass(frozen=True)
class SurfaceFit:
    """Fitted response surface; ratios in dB."""

    axes: tuple[FactorAxis, ...]
    estimate: identify.Estimate
    variance: float

    def row(self, settings: dict[str, Level]) -> Floats:
        """Row of the design at settings."""
        return np.array([1.0, *(x for axis in self.axes for x in axis.columns(settings[axis.factor]))])

    def law(self, settings: dict[str, Level]) -> tuple[float, float]:
        """Mean and standard deviation of the ratio of a further run, dB, with uncertain coefficients."""
        row = self.row(settings)
        sd = np.sqrt(self.variance + row @ self.estimate.covariance @ row)
        return float(row @ self.estimate.value), float(sd)

    def position(self, axis: FactorAxis) -> int:
        """Index of the first coefficient of an axis."""
        widths = [len(other.columns(other.levels[0])) for other in self.axes]
        return 1 + sum(widths[: self.axes.index(axis)])


def surface_fit(study: Observations, pool: Pool) -> SurfaceFit:
    """Fit the surface to the ratios of a study, without the pooled factors."""
    names = {row.source for row in anova(study, pool).effects}
    axes = tuple(FactorAxis(name, study.levels(name)) for name in study.factors if name in names)
    y, there = analysed(study).y, present(study)
    settings = {name: values[there].tolist() for name, values in study.settings.items()}
    rows = [
        [1.0, *(x for axis in axes for x in axis.columns(settings[axis.factor][k]))] for k in range(y.size)
    ]
    count = len(rows[0])
    if y.size <= count:
        raise ValueError(
            f"the study must leave an error for a response surface of {count} coefficients; got {y.size} runs"
        )
    estimate = identify.least_squares(rows, y, names=[f"b{k}" for k in range(count)])
    left = y - np.array(rows) @ estimate.value
    return SurfaceFit(axes, estimate, float(left @ left) / (y.size - count))
