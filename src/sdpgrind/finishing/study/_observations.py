"""Settings and readings of a study, checked."""

import dataclasses
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.finishing.study._analysed import Analysed
from sdpgrind.finishing.study._arrays import OrthogonalArray, orthogonal_array
from sdpgrind.finishing.study._confounding import Confounding, assigned, checked_columns, confounding
from sdpgrind.finishing.study._linear_model import LinearModel, Term
from sdpgrind.finishing.study._published import PUBLISHED
from sdpgrind.finishing.study._ratios import RATIOS, sn_ratio
from sdpgrind.finishing.study._settings import (
    Factors,
    FreeRuns,
    Level,
    checked_factors,
    codes_of,
    codes_of_runs,
    distinct,
    level_array,
)


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
                raise ValueError(
                    f"columns must be one for each of the {len(factors)} factors; got {len(taken)}"
                )
            object.__setattr__(self, "array", array)
            object.__setattr__(self, "columns", taken)
        object.__setattr__(self, "factors", factors)
        object.__setattr__(self, "interactions", _interactions(self.interactions, factors))
        object.__setattr__(self, "reference", checks.positive("reference", self.reference, self.unit))
        checks.one_of("ratio", self.ratio, RATIOS)
        object.__setattr__(self, "response", _readings(self.response, self.unit))
        object.__setattr__(self, "units", _units(self.units, factors))
        self._check()

    @classmethod
    def of_runs(
        cls,
        settings: Mapping[str, Sequence[Level]],
        response: npt.ArrayLike,
        *,
        ratio: str = "smaller",
        reference: float = 1.0,
        interactions: Sequence[tuple[str, str]] = (),
        name: str = "response",
        unit: str = "",
        units: Mapping[str, str] | None = None,
    ) -> Self:
        """Make a study of any runs, analysed by a general linear model (type II) where they are not balanced.

        Parameters
        ----------
        settings : mapping of str to sequence
            Value of each factor in each run.
        response, ratio, reference, interactions, name, unit, units
            As for `Study`; the response in `unit`.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> wool = ["A", "A", "B", "B", "B"]
        >>> study = fin.Study.of_runs({"wool": wool}, [1.0, 2.0, 4.0, 5.0, 6.0], ratio="none")
        >>> study.anova()["wool"].df
        1
        """
        factors, codes = codes_of_runs(settings)
        return cls(
            FreeRuns(codes),
            factors,
            response,
            ratio=ratio,
            reference=reference,
            interactions=interactions,
            name=name,
            unit=unit,
            units=units or {},
        )

    @classmethod
    def published(cls, name: str = "wang-2001") -> Self:
        """Return a published experiment.

        ``"wang-2001"`` is Table 2 of Wang and Jan (2001): an L18 of tool diameter (mm), path pattern, feed
        rate (mm/s) and normal force (N; the source calls it pressure), with one reading of R_a (mm) a run.
        Smaller is better, and 10 µm is 0 dB, as in the printed ratios. The source's text lists 3 mm and the
        zigzag first, but its letters follow Table 2 (A1 is 4 mm, B1 the fractal of order 5).

        Parameters
        ----------
        name : {"wang-2001"}
            Name of the experiment.

        Raises
        ------
        ValueError
            The name is unknown.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> fin.Study.published("wang-2001").anova(pool="F<1").pooling.names
        ('feed_rate',)
        """
        data = PUBLISHED[checks.one_of("name", name, PUBLISHED)]
        response = 1e-3 * np.array(data["roughness_um"])
        return cls(
            data["array"],
            data["factors"],
            response,
            reference=1e-3 * data["reference_um"],
            name="roughness R_a",
            unit="mm",
            units=data["units"],
        )

    @property
    def runs(self) -> int:
        """Number of runs with the missing ones, a whole number."""
        return len(self.readings)

    @property
    def readings(self) -> Floats:
        """Response, shape (runs, replicates), in `unit`; NaN: the run is missing."""
        return np.asarray(self.response)

    @property
    def missing(self) -> tuple[int, ...]:
        """Runs without readings, each a whole number from 1."""
        return tuple(int(k) + 1 for k in np.flatnonzero(np.isnan(self.readings[:, 0])))

    @property
    def settings(self) -> dict[str, npt.NDArray[Any]]:
        """Value of each factor in each run, (runs,), in its own unit; objects where numbers and names mix."""
        levels = {name: level_array(self.levels(name)) for name in self.factors}
        codes = codes_of(self.array, self.columns, self.factors)
        return {name: levels[name][codes[:, k]] for k, name in enumerate(self.factors)}

    def levels(self, factor: str) -> tuple[Level, ...]:
        """Return the distinct levels of a `factor`, in its own unit, in the order given."""
        return distinct(self.factors[checks.one_of("factor", factor, self.factors)])

    @property
    def sn_ratio(self) -> Floats:
        """Signal-to-noise ratio of each run with readings, dB; with ratio "none" the mean reading."""
        return sn_ratio(self.readings[present(self)], self.ratio, reference=self.reference)

    @property
    def confounding(self) -> Confounding | None:
        """Confounding of main effects with interactions of two factors, shares in unit 1; None: no array."""
        if isinstance(self.array, FreeRuns):
            return None
        return confounding(self.array, dict(zip(self.factors, self.columns or (), strict=True)))

    def _check(self) -> None:
        codes = codes_of(self.array, self.columns, self.factors)
        if len(codes) != self.runs:
            raise ValueError(
                f"response must have one entry for each of the {len(codes)} runs; got {self.runs}"
            )
        found, there = analysed(self), present(self)
        for k, name in enumerate(self.factors):
            absent = set(range(len(self.levels(name)))) - set(codes[there, k].tolist())
            if absent:
                raise ValueError(
                    f"each level must have a reading; {name} has none at {self.levels(name)[min(absent)]!r}"
                )
        if not found.model.full_rank:
            raise ValueError(f"effects must be told apart by the runs; those of {_confused(found)} are not")


def _confused(found: Analysed) -> str:
    model = found.model
    plain = [model.columns(model.codes, term).shape[1] for term in model.terms]
    lost = [
        found.named(term) for term, df, full in zip(model.terms, model.df, plain, strict=True) if df < full
    ]
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
        raise TypeError(
            f"response must be {checks.with_unit('numbers', unit)}; got {checks.shown(response)}"
        ) from None
    if readings.ndim not in (1, 2) or readings.size == 0:
        raise ValueError(f"response must be of shape (runs,) or (runs, replicates); got {readings.shape}")
    readings = readings.reshape(len(readings), -1)
    lost = np.isnan(readings)
    partly = np.any(lost, axis=1) & ~np.all(lost, axis=1)
    if np.any(partly):
        raise ValueError(
            "response must be numbers, or NaN in all readings of a missing run; run"
            f" {int(np.argmax(partly)) + 1} has both"
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


def present(study: Observations) -> npt.NDArray[np.bool_]:
    """Whether each run has readings, (runs,)."""
    return ~np.isnan(study.readings[:, 0])


def analysed(study: Observations) -> Analysed:
    """Ratio of each run with readings (with ratio "none" each reading), and the linear model."""
    there, names, single = present(study), list(study.factors), study.ratio == "none"
    readings = study.readings[there]
    y = readings.ravel() if single else sn_ratio(readings, study.ratio, reference=study.reference)
    codes = codes_of(study.array, study.columns, study.factors)[there]
    codes = np.repeat(codes, readings.shape[1] if single else 1, axis=0)
    counts = tuple(len(study.levels(name)) for name in names)
    pairs: list[Term] = [(names.index(a), names.index(b)) for a, b in study.interactions]
    terms: tuple[Term, ...] = (*((k,) for k in range(len(names))), *pairs)
    unit = RATIOS[study.ratio].unit or study.unit
    return Analysed(y, LinearModel(codes, counts, terms), tuple(names), unit)
