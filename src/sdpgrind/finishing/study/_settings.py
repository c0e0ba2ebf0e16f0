"""Factors of a study: levels by value, and the level of each run."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.finishing.study._linear_model import Codes
from sdpgrind.finishing.study._texts import level

Level = float | str
Factors = dict[str, tuple[Level, ...]]


@dataclasses.dataclass(frozen=True, eq=False)
class FreeRuns:
    """Runs of any kind, balanced or not, in place of an array."""

    codes: Codes


def checked_factors(factors: Any) -> Factors:
    """Factors and their levels, at least two different ones each; a repeated level is a dummy level."""
    if not isinstance(factors, Mapping) or not factors:
        raise TypeError(
            f"factors must be a mapping from names to levels, such as {{'force': (1.0, 2.0)}};"
            f" got {checks.shown(factors)}"
        )
    return {_named(name): _levels(str(name), levels) for name, levels in factors.items()}


def _named(name: object) -> str:
    if not isinstance(name, str) or not name or " x " in name or name in ("error", "total"):
        raise ValueError(
            f"a factor must have a name without ' x ' that is not 'error' or 'total'; got {name!r}"
        )
    return name


def _levels(name: str, levels: Any) -> tuple[Level, ...]:
    if isinstance(levels, str) or not isinstance(levels, Iterable):
        raise TypeError(
            f"levels of {name!r} must be a sequence of numbers or names; got {checks.shown(levels)}"
        )
    found = tuple(_level(name, value) for value in levels)
    if len(set(found)) < 2:
        raise ValueError(f"levels of {name!r} must be two or more that differ; got {list(found)}")
    return found


def _level(name: str, value: object) -> Level:
    return str(value) if isinstance(value, str) else checks.number(f"a level of {name!r}", value, "or a name")


def distinct(levels: Iterable[Level]) -> tuple[Level, ...]:
    """Levels without repeats, in their order."""
    return tuple(dict.fromkeys(levels))


def level_array(levels: Sequence[Level]) -> npt.NDArray[Any]:
    """Levels as an array; of objects where numbers and names mix, which numpy would turn into names."""
    mixed = len({isinstance(level, str) for level in levels}) > 1
    return np.array(levels, dtype=object if mixed else None)


def codes_of(array: Any, columns: Sequence[int] | None, factors: Mapping[str, Sequence[Level]]) -> Codes:
    """Index of each run's level among the distinct ones, (runs, factors), on columns (from 1) of an array."""
    if isinstance(array, FreeRuns):
        return array.codes
    return _codes_of_columns([array.matrix[:, k - 1] for k in columns or ()], factors)


def _codes_of_columns(
    columns: Sequence[npt.NDArray[np.int64]], factors: Mapping[str, Sequence[Level]]
) -> Codes:
    coded = []
    for (name, levels), column in zip(factors.items(), columns, strict=True):
        if len(levels) != column.max() + 1:
            raise ValueError(
                f"levels of {name!r} must be as many as its column has, {int(column.max()) + 1}"
                f" (a level may come twice); got {len(levels)}"
            )
        index = {level: k for k, level in enumerate(distinct(levels))}
        coded.append(np.array([index[level] for level in levels])[column])
    return np.column_stack(coded)


def codes_of_runs(settings: Any) -> tuple[Factors, Codes]:
    """Factors and codes from the value of each factor in each run."""
    factors = checked_factors(settings)
    lengths = {name: len(values) for name, values in factors.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"settings must be sequences of one length, a value for each run; got {lengths}")
    levels = {name: _sorted(distinct(values)) for name, values in factors.items()}
    codes = [[levels[name].index(value) for value in values] for name, values in factors.items()]
    return levels, np.array(codes).T


def _sorted(levels: tuple[Level, ...]) -> tuple[Level, ...]:
    """Numbers in ascending order, names in their order."""
    numbers = [level for level in levels if isinstance(level, float)]
    return tuple(sorted(numbers)) if len(numbers) == len(levels) else levels


def position(factors: Mapping[str, Sequence[Level]], name: object, value: object) -> int:
    """Index of a value among the distinct levels of a factor."""
    levels = distinct(factors[checks.one_of("factor", name, factors)])
    found = which(levels, value)
    if found is None:
        raise ValueError(f"{name} must be one of its levels, {', '.join(map(level, levels))}; got {value!r}")
    return found


def which(levels: Sequence[Level], value: object) -> int | None:
    """Index of the level equal to a value within rounding; None: none is. True is not 1."""
    return next((k for k, level in enumerate(levels) if _same(value, level)), None)


def _same(value: object, level: Level) -> bool:
    if isinstance(level, str):
        return isinstance(value, str) and value == level
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    return abs(float(value) - level) <= 1e-9 * abs(level)
