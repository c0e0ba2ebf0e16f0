"""Confounding of interactions of two factors with the main effect of a third."""

import dataclasses
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._array_tables import Table
from sdpgrind.finishing.study._arrays import OrthogonalArray
from sdpgrind.finishing.study._texts import aligned, percent

WHOLE = 1 - 1e-9  # share from which confounding is whole; chosen: 1e-9 covers rounding


@dataclasses.dataclass(frozen=True, repr=False)
class Confounding:
    """Confounding of interactions of two factors with main effects in an array.

    Attributes
    ----------
    names, columns : tuple of str, tuple of int
        Factors and their columns, from 1.
    shares : mapping of (str, str, str) to float
        For two factors and a third: share of the third's effect (in degrees of freedom, unit 1) that lies in
        the interaction of the two. 1: the two are inseparable; zeros are left out.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> factors = {"a": (1.0, 2.0), "b": (1.0, 2.0), "c": (1.0, 2.0)}
    >>> fin.Study("L8", factors, range(1, 9), columns=(1, 2, 4)).confounding
    no main effect is touched by an interaction of two other factors
    >>> found = fin.Study("L8", factors, range(1, 9), columns=(1, 2, 3)).confounding
    >>> round(found.shares["a", "b", "c"], 9)
    1.0
    """

    names: tuple[str, ...]
    columns: tuple[int, ...]
    shares: dict[tuple[str, str, str], float]

    @property
    def clear(self) -> bool:
        """Whether no main effect is confounded with an interaction of two others; no unit."""
        return not self.shares

    @property
    def whole(self) -> tuple[tuple[str, str, str], ...]:
        """Interactions of the first two that are inseparable from the third: names, no unit."""
        return tuple(names for names, share in self.shares.items() if share > WHOLE)

    def __repr__(self) -> str:
        if self.clear:
            return "no main effect is touched by an interaction of two other factors"
        rows = [(f"{a} x {b}", c, percent(share)) for (a, b, c), share in self.shares.items()]
        return aligned(("interaction", "falls on", "share of its effect"), rows)


def confounding(array: OrthogonalArray, columns: dict[str, int]) -> Confounding:
    """Confounding of factors on columns (from 1) of an array; see `Study.confounding`."""
    taken = checked_columns(array, tuple(columns.values()))
    names = tuple(columns)
    bases = [contrasts(array.matrix[:, k - 1]) for k in taken]
    shares = {}
    for i, j in combinations(range(len(names)), 2):
        for k in range(len(names)):
            share = 0.0 if k in (i, j) else overlap(bases[i], bases[j], bases[k])
            if share > 1e-12:
                shares[names[i], names[j], names[k]] = share
    return Confounding(names, taken, shares)


def checked_columns(array: OrthogonalArray, columns: Sequence[int]) -> tuple[int, ...]:
    """Columns from 1 as whole numbers, in range and without repeats."""
    for k, column in enumerate(columns):
        if checks.count("columns", column) > len(array.levels):
            raise checks.refuse("columns", f"columns of the array, 1 to {len(array.levels)}", column)
        if column in columns[:k]:
            raise ValueError(f"columns must be without repeats; got {column} twice")
    return tuple(int(column) for column in columns)


def assigned(array: OrthogonalArray, levels: Sequence[int]) -> tuple[int, ...]:
    """Columns (from 1) that fit the numbers of levels, each the first with fewest whole interactions."""
    taken: list[int] = []
    for k, count in enumerate(levels):
        free = [c for c, n in enumerate(array.levels, start=1) if n == count and c not in taken]
        if not free:
            raise ValueError(
                f"factors must fit the array: {array.name} has no free column of {count} levels"
                f" for factor {k + 1} of {len(levels)}"
            )
        lost = [_hiding(array.matrix, taken, column) for column in free]
        taken.append(free[int(np.argmin(lost))])
    return tuple(taken)


def _hiding(matrix: Table, taken: list[int], column: int) -> int:
    """Number of interactions of two taken columns that contain the whole effect of another."""
    bases, third = [contrasts(matrix[:, k - 1]) for k in taken], contrasts(matrix[:, column - 1])
    return sum(overlap(one, other, third) > WHOLE for one, other in combinations(bases, 2))


def contrasts(column: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> Floats:
    """Orthonormal contrasts between the levels of a balanced column, shape (runs, levels - 1)."""
    marks = np.eye(int(column.max()) + 1)[column]
    q, _ = np.linalg.qr(np.column_stack([np.ones(column.size), marks[:, :-1]]))
    return np.asarray(q[:, 1:])


def overlap(one: Floats, other: Floats, third: Floats) -> float:
    """Share of the third effect that lies in the interaction of the first two, unit 1."""
    product = np.sqrt(len(one)) * (one[:, :, None] * other[:, None, :]).reshape(len(one), -1)
    return float(np.sum((third.T @ product) ** 2) / third.shape[1])
