"""What was varied and what was read: settings and readings of a study, checked, and its linear model."""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.finishing._study.arrays import OrthogonalArray, orthogonal_array
from sdpgrind.finishing._study.confounding import Confounding, assigned, checked_columns, confounding
from sdpgrind.finishing._study.linear_model import Codes, LinearModel, Term
from sdpgrind.finishing._study.ratios import RATIOS, sn_ratio
from sdpgrind.finishing._study.settings import Factors, FreeRuns, Level, checked_factors, codes_of_array, distinct


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Observations(Frozen):
    """Settings and readings of a study; see `Study`."""

    array: Any
    factors: Mapping[str, Sequence[Level]]
    response: npt.ArrayLike
    _: dataclasses.KW_ONLY
    ratio: str = "smaller"
    reference: float = 1.0
    columns: Sequence[int] | None = None
    interactions: Sequence[tuple[str, str]] = ()
    name: str = "response"
    unit: str = ""
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        factors = checked_factors(self.factors)
        if not isinstance(self.array, FreeRuns):
            array = _array(self.array)
            widths = [len(levels) for levels in factors.values()]
            taken = assigned(array, widths) if self.columns is None else checked_columns(array, self.columns)
            if len(taken) != len(factors):
                raise ValueError(f"columns must be one for each of the {len(factors)} factors; got {len(taken)}")
            object.__setattr__(self, "array", array)
            object.__setattr__(self, "columns", taken)
        object.__setattr__(self, "factors", factors)
        object.__setattr__(self, "interactions", _interactions(self.interactions, factors))
        object.__setattr__(self, "reference", checks.positive("reference", self.reference, self.unit))
        checks.one_of("ratio", self.ratio, RATIOS)
        object.__setattr__(self, "response", _readings(self.response, self.unit))
        object.__setattr__(self, "units", _units(self.units, factors))
        self._check()

    @property
    def runs(self) -> int:
        """Number of runs, missing ones included, a whole number."""
        return len(self.readings)

    @property
    def readings(self) -> Floats:
        """The response, shape (runs, replicates), in `unit`; NaN where a run is missing."""
        return np.asarray(self.response)

    @property
    def missing(self) -> tuple[int, ...]:
        """Runs without readings, each a whole number from 1."""
        return tuple(int(k) + 1 for k in np.flatnonzero(np.isnan(self.readings[:, 0])))

    @cached_property
    def run_codes(self) -> Codes:
        """Which distinct level each factor has in each run, a whole number from 0, shape (runs, factors)."""
        if isinstance(self.array, FreeRuns):
            return self.array.codes
        columns = [self.array.matrix[:, k - 1] for k in self.columns or ()]
        return codes_of_array(self.factor_levels, columns)

    @property
    def settings(self) -> dict[str, npt.NDArray[Any]]:
        """Value of each factor in each run, in its own unit, arrays of shape (runs,)."""
        levels = {name: np.array(self.levels(name)) for name in self.factors}
        return {name: levels[name][self.run_codes[:, k]] for k, name in enumerate(self.factors)}

    def levels(self, factor: str) -> tuple[Level, ...]:
        """Return the distinct levels of a factor, in its own unit, in the order in which they were given."""
        return distinct(self.factor_levels[checks.one_of("factor", factor, self.factors)])

    @property
    def sn_ratio(self) -> Floats:
        """Signal-to-noise ratio (unit dB) of each run that is there; with ratio "none" the mean reading."""
        return sn_ratio(self.readings[self.present], self.ratio, reference=self.reference)

    @property
    def confounding(self) -> Confounding | None:
        """Which interactions of two factors fall on a third, shares in unit 1; None for runs that are no array."""
        if isinstance(self.array, FreeRuns):
            return None
        return confounding(self.array, dict(zip(self.factors, self.columns or (), strict=True)))

    @property
    def factor_levels(self) -> Factors:
        """Levels of each factor as they were given, each in its own unit."""
        return {name: tuple(levels) for name, levels in self.factors.items()}

    @property
    def reference_of_back(self) -> float:
        """What a ratio of 0 dB is, in `unit`."""
        return self.reference if self.ratio in ("smaller", "larger") else 1.0

    @cached_property
    def present(self) -> npt.NDArray[np.bool_]:
        """Whether each run has readings, shape (runs,), no unit."""
        return ~np.isnan(self.readings[:, 0])

    @cached_property
    def observed(self) -> Floats:
        """What is analysed, (observations,), in the unit dB: the ratio of each run; with "none" each reading."""
        return self.readings[self.present].ravel() if self.ratio == "none" else self.sn_ratio

    @cached_property
    def linear_model(self) -> LinearModel:
        """Effects of all factors and of the named interactions on what is analysed (unit dB)."""
        repeats = self.readings.shape[1] if self.ratio == "none" else 1
        codes = np.repeat(self.run_codes[self.present], repeats, axis=0)
        counts = tuple(len(self.levels(name)) for name in self.factors)
        names = list(self.factors)
        pairs: list[Term] = [(names.index(a), names.index(b)) for a, b in self.interactions]
        return LinearModel(codes, counts, (*((k,) for k in range(len(names))), *pairs))

    def label(self, factor: str) -> str:
        """Return the name of a `factor`, with its unit in brackets where it has one."""
        unit = self.units.get(factor, "")
        return f"{factor} [{unit}]" if unit else factor

    def term_name(self, term: Term) -> str:
        """Return the name of a `term` of the linear model: no unit."""
        names = list(self.factors)
        return " x ".join(names[k] for k in term)

    def _check(self) -> None:
        if len(self.run_codes) != self.runs:
            raise ValueError(f"response must have one entry for each of the {len(self.run_codes)} runs; got {self.runs}")
        _ = self.sn_ratio
        for k, name in enumerate(self.factors):
            absent = set(range(len(self.levels(name)))) - set(self.run_codes[self.present, k].tolist())
            if absent:
                raise ValueError(f"each level must have a reading; {name} has none at {self.levels(name)[min(absent)]!r}")
        if not self.linear_model.full_rank:
            raise ValueError(f"effects must be told apart by the runs; those of {self._confused()} are not")

    def _confused(self) -> str:
        model = self.linear_model
        plain = [model.columns(model.codes, term).shape[1] for term in model.terms]
        lost = [self.term_name(term) for term, df, full in zip(model.terms, model.df, plain, strict=True) if df < full]
        return ", ".join(lost) or "all factors together"


def _array(array: Any) -> OrthogonalArray:
    if isinstance(array, OrthogonalArray):
        return array
    if array is None:
        raise TypeError("array must be an OrthogonalArray, the name of one, or a table of levels; got None")
    return orthogonal_array(array) if isinstance(array, str) else OrthogonalArray("array", array)


def _readings(response: npt.ArrayLike, unit: str) -> Floats:
    """Readings (runs, replicates), NaN only in whole runs."""
    try:
        readings = np.array(response, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"response must be {checks.with_unit('numbers', unit)}; got {checks.shown(response)}") from None
    if readings.ndim not in (1, 2) or readings.size == 0:
        raise ValueError(f"response must be of shape (runs,) or (runs, replicates); got {readings.shape}")
    readings = readings.reshape(len(readings), -1)
    lost = np.isnan(readings)
    partly = np.any(lost, axis=1) & ~np.all(lost, axis=1)
    if np.any(partly):
        raise ValueError(
            f"response must be numbers, or NaN in all readings of a missing run; run {int(np.argmax(partly)) + 1} has both"
        )
    checks.finite_array("response", readings[~lost], unit)
    readings.flags.writeable = False
    return readings


def _units(units: Any, factors: Factors) -> dict[str, str]:
    if not isinstance(units, Mapping):
        raise TypeError(f"units must be a mapping from factors to their units; got {checks.shown(units)}")
    for name in units:
        checks.one_of("units", name, factors)
    return {str(name): str(unit) for name, unit in units.items()}


def _interactions(pairs: Any, factors: Factors) -> tuple[tuple[str, str], ...]:
    found: list[tuple[str, str]] = []
    for pair in pairs:
        if isinstance(pair, str) or len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"an interaction must be a pair of two factors; got {pair!r}")
        for name in pair:
            checks.one_of("a factor of an interaction", name, factors)
        found.append((pair[0], pair[1]))
    for one, other in combinations(found, 2):
        if set(one) == set(other):
            raise ValueError(f"interactions must be without repeats; got {other} twice")
    return tuple(found)
