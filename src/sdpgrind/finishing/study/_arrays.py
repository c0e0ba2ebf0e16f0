"""Orthogonal arrays: any two columns contain each pair of levels equally often."""

from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described
from sdpgrind.finishing.study._array_tables import TABLES, Table


@described("finishing.array")
class OrthogonalArray(Described):
    """Orthogonal array of strength 2.

    Parameters
    ----------
    name : str
        Name.
    table : array_like, shape (runs, columns)
        Level of each column in each run, a whole number from 0.

    Raises
    ------
    ValueError
        A column has a single level or omits one, or two columns are not balanced against each other.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> array = fin.study.orthogonal_array("L18")
    >>> array.runs, array.levels
    (18, (2, 3, 3, 3, 3, 3, 3, 3))
    >>> array
    OrthogonalArray(L18(2^1 3^7): 18 runs, 8 columns)
    """

    name: str = custom()
    table: npt.ArrayLike = custom()

    def _check(self) -> None:
        table = _whole_numbers(self.table)
        object.__setattr__(self, "table", tuple(map(tuple, table.tolist())))
        for k, column in enumerate(table.T, start=1):
            if column.min() != 0 or set(column.tolist()) != set(range(max(2, int(column.max()) + 1))):
                raise ValueError(
                    f"column {k} must have two or more levels, 0, 1, ... in full; got"
                    f" {sorted(set(column.tolist()))}"
                )
        pairs = unbalanced(table)
        if pairs:
            raise ValueError(
                "the array must be orthogonal, each pair of levels of two columns equally often;"
                f" {self.name!r} is not in columns {pairs[0][0]} and {pairs[0][1]},"
                f" one of {len(pairs)} pairs: Study.of_runs takes any runs"
            )

    @cached_property
    def matrix(self) -> Table:
        """The table as an array, shape (runs, columns), each entry a whole number."""
        matrix = np.array(self.table)
        matrix.flags.writeable = False
        return matrix

    @property
    def runs(self) -> int:
        """Number of runs, a whole number."""
        return int(self.matrix.shape[0])

    @property
    def levels(self) -> tuple[int, ...]:
        """Number of levels of each column, each a whole number."""
        return tuple(int(n) + 1 for n in self.matrix.max(axis=0))

    def __repr__(self) -> str:
        return f"OrthogonalArray({self.name}: {self.runs} runs, {len(self.levels)} columns)"


def orthogonal_array(name: str) -> OrthogonalArray:
    """Return a standard orthogonal array, its runs and columns in Taguchi's order.

    Parameters
    ----------
    name : str
        L4, L8, L9, L12, L16, L18, L27 or L36, by the number of runs (a whole number); or in full: "L16(2^15)"
        (short: L16), "L16(4^5)", "L36(2^11 3^12)" (short: L36), "L36(2^3 3^13)" and so on.

    Returns
    -------
    OrthogonalArray
        In L4 to L9, L16 and L27 an interaction of two columns falls wholly on others; L12, L18 and L36 spread
        it over many, except for columns 2, 4 and 5 of L18: the interaction of two contains the whole effect
        of the third.

    Raises
    ------
    ValueError
        The name is unknown.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.study.orthogonal_array("L4").matrix.tolist()
    [[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]
    """
    known: dict[str, str] = {}
    for full in TABLES:
        known.setdefault(full.partition("(")[0], full)
    known |= {full: full for full in TABLES}
    full = known[checks.one_of("name", name, known)]
    return OrthogonalArray(full, TABLES[full]())


def unbalanced(table: Table) -> list[tuple[int, int]]:
    """Pairs of columns (from 1) whose pairs of levels are not equally frequent."""
    return [
        (i + 1, j + 1)
        for i, j in combinations(range(table.shape[1]), 2)
        if not _balanced(table[:, i], table[:, j])
    ]


def _balanced(one: npt.NDArray[Any], other: npt.NDArray[Any]) -> bool:
    cells = np.bincount(one * (other.max() + 1) + other, minlength=int((one.max() + 1) * (other.max() + 1)))
    return bool(np.all(cells == cells[0]))


def _whole_numbers(table: Any) -> Table:
    array = checks.finite_array("table", table)
    if array.ndim != 2 or array.shape[0] < 2 or array.shape[1] < 1:
        raise ValueError(f"table must be of shape (runs, columns) with two runs or more; got {array.shape}")
    if np.any(array != np.round(array)) or np.any(array < 0):
        raise ValueError("table must hold levels counted from 0, whole numbers; got others")
    return array.astype(np.int64)
