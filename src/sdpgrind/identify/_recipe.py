"""Recipe of the recursive estimators: step, start, and rows for the self-test."""

import math
from dataclasses import dataclass

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe
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

    def each(self, ending: str = "") -> dict[str, str]:
        """Return names with an ending, and the units of the values."""
        units = (*self.units, *("",) * len(self.names))
        return {f"{name}{ending}": unit for name, unit in zip(self.names, units, strict=False)}

    def outputs(self) -> tuple[dict[str, str], dict[str, str]]:
        """Return values and standard deviations with their units, and what they are."""
        told = {f"{name}_sd": _SD.format(name) for name in self.names}
        return {**self.each(), **self.each("_sd")}, {**dict.fromkeys(self.names, "estimate"), **told}


def rows_recipe(names: Names, law: TriangleLaw, state: Floats) -> Recipe:
    """Return the recipe of recursive least squares.

    `law`: its forgetting of unit 1, its standard deviation in the unit of a target; `state`: that of
    `triangle_step`, before the first row.
    """
    rows = dict.fromkeys(names.each("_row"), "")
    outputs, told = names.outputs()
    return Recipe(
        "least_squares",
        kernels.exported_row,
        {"target": "", "forgetting": "", **rows},
        outputs,
        law=(law,),
        after=names.padding,
        state=state,
        missing=("forgetting",),
        ranges={"forgetting": (_LEAST, 1.0)},
        meanings={
            "target": "reading: the sum of regressors times values, and noise",
            "forgetting": f"weight that the rows before keep; NaN: {law.forgetting:g}",
            **{name: f"regressor of {name.removesuffix('_row')}" for name in rows},
            **told,
        },
        status=("determined", "undetermined"),
        equations="least squares with exponential forgetting, by Givens rotations: Mears (4.40), corrected",
        vectors=_Rows(len(rows)).chains,
        spread=(1.0, *(0.0,) * (1 + len(rows))),
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
    rows, (outputs, told) = dict.fromkeys(names.each("_row"), ""), names.outputs()
    readings = {"reading": "", **rows} if of_row else names.each("_reading")
    meant = {name: f"reading of {name.removesuffix('_reading')}" for name in readings}
    if of_row:
        meant = {name: f"share of {name.removesuffix('_row')} in the reading" for name in rows}
        meant["reading"] = "reading: the sum of shares times values, and noise"
    return Recipe(
        "random_walk",
        kernels.exported_walk_of_row if of_row else kernels.exported_walk,
        readings,
        outputs,
        law=(size, walk, *((noise[0],) if of_row else (noise, np.eye(size)))),
        after=names.padding,
        state=state[:-size] if of_row else state,
        missing=tuple(name for name in readings if name not in rows),
        meanings={**meant, **told},
        tables={
            "walk": "variance of each step",
            "noise": "variance of each reading",
            "unit": "rows of readings",
        },
        status=("known",) if of_row else ("known", "not yet known"),
        equations="Kalman filter of random walks: Mears (4.35)-(4.39)",
        vectors=_WalkReadings(state[:size], np.sqrt(walk + noise), of_row).chains,
        spread=(*np.sqrt(noise[: 1 if of_row else size]).tolist(), *(0.0,) * (size if of_row else 0)),
        kind="RandomWalk",
    )


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
