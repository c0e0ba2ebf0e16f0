"""Recipe of the recursive estimators: step, start, and rows for the self-test."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal
from sdpgrind.identify import _exported_kernels as kernels
from sdpgrind.identify._triangle_kernels import TriangleLaw

_LEAST = math.ulp(0.0)  # derived: least weight, as it must be > 0
_LENGTH = 40  # chosen: rows of a chain of the self-test
_ZEROS = 0.3  # chosen: share of entries of a row that are 0
# chosen: weight that older rows keep while one row repeats: within a chain their digits are lost
_FADING = 1e-3
_MISSED = 0.2  # chosen: share of readings that are missing
_SD = "standard deviation of {}; infinite while it is not known"


@dataclass(frozen=True)
class Names:
    """Names and units of the values of an estimator, at most `MOST` of them."""

    names: tuple[str, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.names) > kernels.MOST:
            raise checks.refuse("names", f"at most {kernels.MOST} in an export", len(self.names))

    @property
    def padding(self) -> tuple[float, ...]:
        """Numbers behind those of the values; no unit."""
        return (0.0,) * (kernels.MOST - len(self.names))

    def each(self, ending: str, meaning: str, units: Sequence[str] = (), **more: Any) -> dict[str, Signal]:
        """Return a signal for each name, with an ending; `meaning` has a place for the name."""
        pairs = zip(self.names, (*units, *("",) * len(self.names)), strict=False)
        return {f"{name}{ending}": Signal(unit, meaning.format(name), **more) for name, unit in pairs}

    @property
    def outputs(self) -> dict[str, Signal]:
        """Values and standard deviations, in the units of the values."""
        return {**self.each("", "estimate", self.units), **self.each("_sd", _SD, self.units)}


def rows_recipe(names: Names, law: TriangleLaw, state: Floats) -> Recipe:
    """Return the recipe of recursive least squares.

    `law`: its forgetting of unit 1, its standard deviation in the unit of a target; `state`: that of
    `triangle_step`, before the first row.
    """
    weight = f"weight that the rows before keep; NaN: {law.forgetting:g}"
    return Recipe(
        "least_squares",
        kernels.exported_row,
        {
            "target": Signal("", "reading: the sum of regressors times values, and noise"),
            "forgetting": Signal("", weight, _LEAST, 1.0, missing=True, spread=0.0),
            **names.each("_row", "regressor of {}", spread=0.0),
        },
        names.outputs,
        law=(law,),
        after=names.padding,
        state=state,
        status=("determined", "undetermined"),
        equations="least squares with exponential forgetting, by Givens rotations: Mears (4.40), corrected",
        vectors=_Rows(len(names.names)).chains,
        kind="RecursiveLeastSquares",
    )


def walk_recipe(names: Names, walk: Floats, noise: Floats, state: Floats, of_row: bool) -> Recipe:
    """Return the recipe of a filter of random walks.

    Parameters
    ----------
    names : Names
        Values and their units.
    walk, noise : array, (p,)
        Variances, squared units.
    state : array, (p (p + 2),)
        Values, covariance, and 1 where a value is known, as in `exported_walk`.
    of_row : bool
        Whether a reading is that of a combination of the values.
    """
    size = len(names.names)
    return Recipe(
        "random_walk",
        kernels.exported_walk_of_row if of_row else kernels.exported_walk,
        _readings(names, np.sqrt(noise), of_row),
        names.outputs,
        law=(size, walk, *((noise[0],) if of_row else (noise, np.eye(size)))),
        after=names.padding,
        state=state[:-size] if of_row else state,
        tables={
            "walk": "variance of each step",
            "noise": "variance of each reading",
            "unit": "rows of readings",
        },
        status=("known",) if of_row else ("known", "not yet known"),
        equations="Kalman filter of random walks: Mears (4.35)-(4.39)",
        vectors=_WalkReadings(state[:size], np.sqrt(walk + noise), of_row).chains,
        kind="RandomWalk",
    )


def _readings(names: Names, sd: Floats, of_row: bool) -> dict[str, Signal]:
    """Return the inputs of a filter whose readings have these standard deviations, in their units."""
    if not of_row:
        each = names.each("_reading", "reading of {}", names.units, missing=True).items()
        return {name: replace(one, spread=wide) for (name, one), wide in zip(each, sd.tolist(), strict=True)}
    told = "reading: the sum of shares times values, and noise"
    reading = Signal("", told, missing=True, spread=float(sd[0]))
    return {"reading": reading, **names.each("_row", "share of {} in the reading", spread=0.0)}


@dataclass(frozen=True)
class _Rows:
    """Targets, weights and rows: all different, of few directions, with entries of 0, one repeated."""

    size: int

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` rows of inputs in chains, of unit 1."""
        return [self._one(rng, k % 4) for k in range(max(count // _LENGTH, 4))]

    def _one(self, rng: np.random.Generator, kind: int) -> Floats:
        rows, weight = rng.normal(size=(_LENGTH, self.size)), np.full(_LENGTH, np.nan)
        if kind == 1:  # one direction to begin with, nearly one then
            rows[:8] = rows[0] * rng.normal(size=(8, 1))
            rows[8:12] = rows[0] * (1.0 + 1e-13 * rng.normal(size=(4, self.size)))
        elif kind == 2:
            rows[rng.random(rows.shape) < _ZEROS] = 0.0
            weight = rng.choice([np.nan, 1.0, 0.9, 0.5], _LENGTH)
        elif kind == 3:
            rows[10:], weight[10:] = rows[10], _FADING
            rows[25:] = rng.normal(size=rows[25:].shape)
        target = rows @ np.arange(1.0, self.size + 1.0) + 0.1 * rng.normal(size=_LENGTH)
        return np.column_stack([target, weight, rows])


@dataclass(frozen=True)
class _WalkReadings:
    """Readings about a start, some missing; or readings of combinations with entries of 0."""

    start: Floats
    sd: Floats
    of_row: bool

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` rows of inputs in chains, in the units of the readings."""
        return [self._one(rng) for _ in range(max(count // _LENGTH, 1))]

    def _one(self, rng: np.random.Generator) -> Floats:
        size, sd = self.start.size, self.sd
        if not self.of_row:
            found = self.start + np.cumsum(sd * rng.normal(size=(_LENGTH, size)), axis=0)
            found[rng.random(found.shape) < _MISSED] = np.nan
            return np.asarray(found)
        rows = rng.normal(size=(_LENGTH, size))
        rows[rng.random(rows.shape) < _ZEROS] = 0.0
        reading = rows @ self.start + sd[0] * rng.normal(size=_LENGTH)
        reading[rng.random(_LENGTH) < _MISSED] = np.nan
        return np.column_stack([reading, rows])
