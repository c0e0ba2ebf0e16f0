"""Tables by a monotone key with exact slopes: cubic Hermite interpolation, clamped with a flag."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._trace.table_kernels import NO_KEY, look_up, look_up_many, pack

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

CELLS = 2  # chosen: guide cells per node; fewer need more bisection
ROUNDING = 1e-12  # chosen: relative span of a constant column
LEAST_DENSITY = 0.05  # chosen: least density of nodes over the mean; 0 leaves none where nothing bends
KINK = 1e-9  # chosen: share of the range; closer nodes are one place with two slopes


@dataclass(frozen=True, eq=False, repr=False)
class LocusTable:
    """Columns (K, n) by a strictly monotone key (K,), with their exact slopes by the key.

    Compiled code calls ``look_up(table.packed, key, out)`` with `width` columns. `units`: the name of the key
    and those of the columns, with their units; for exports.

    Examples
    --------
    >>> key = np.array([0.0, 1.0, 3.0])
    >>> table = LocusTable(key, np.column_stack([key**3]), np.column_stack([3 * key**2]))
    >>> table.at(2.0)
    array([8.])
    >>> table.at(5.0), table.clamped(5.0)
    (array([27.]), True)
    """

    key: Floats
    columns: Floats
    slopes: Floats
    units: Mapping[str, str] = field(default_factory=dict)
    packed: Floats = field(init=False, repr=False)
    width: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        key = checks.finite_array("key", self.key)
        if key.ndim != 1 or key.size < 2:
            raise checks.refuse("key", "a row of 2 numbers or more", key.shape)
        _check_monotone(key)
        columns, slopes = (
            checks.finite_array("columns", self.columns),
            checks.finite_array("slopes", self.slopes),
        )
        if columns.ndim != 2 or len(columns) != key.size or columns.shape[1] == 0:
            raise checks.refuse("columns", f"of shape ({key.size}, n)", columns.shape)
        if slopes.shape != columns.shape:
            raise checks.refuse("slopes", f"of shape {columns.shape}", slopes.shape)
        rising = slice(None, None, 1 if key[-1] > key[0] else -1)
        rows = [part[rising].copy() for part in (key, columns, slopes)]
        object.__setattr__(self, "width", columns.shape[1])
        object.__setattr__(self, "packed", pack(*rows, CELLS * key.size))
        for name, array in (("key", key), ("columns", columns), ("slopes", slopes)):
            object.__setattr__(self, name, _fixed(array))

    def __repr__(self) -> str:
        return (
            f"LocusTable({self.key.size} nodes from {self.low:.6g} to {self.high:.6g}, {self.width} columns)"
        )

    def __deepcopy__(self, memo: object) -> Self:
        return self  # immutable

    @cached_property
    def low(self) -> float:
        """Least key."""
        return float(min(self.key[0], self.key[-1]))

    @cached_property
    def high(self) -> float:
        """Greatest key."""
        return float(max(self.key[0], self.key[-1]))

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it."""
        from sdpgrind.locus._trace.recipe import recipe_of

        return recipe_of(self.packed, self.key, self.width, self.units)

    def at(self, key: Any, *, out: Floats | None = None) -> Floats:
        """Return the clamped columns at a key (n,), in `out` if given, or at many (..., n); refuse NaN."""
        if type(key) is float:  # fast path of control loops
            if out is None:
                out = np.empty(self.width)
            if look_up(self.packed, key, out) == NO_KEY:
                raise _no_key("key", key)
            return out
        keys = np.asarray(key, dtype=float)
        rows = np.empty((keys.size, self.width))
        bad = look_up_many(self.packed, np.ascontiguousarray(keys.ravel()), rows)
        if bad >= 0:
            raise _no_key(f"key[{bad}]" if keys.ndim else "key", keys.ravel()[bad])
        return rows.reshape(*keys.shape, -1)

    def clamped(self, key: Any) -> Any:
        """Return whether a key, or each of many, is outside the table."""
        outside = (np.asarray(key) < self.low) | (np.asarray(key) > self.high)
        return outside if outside.ndim else bool(outside)

    def errors(self) -> Floats:
        """Return the error bound h^4/384 |f''''| of each column (n,), by differences; inf: unknown."""
        widths = np.abs(np.diff(self.key))
        found: Floats = np.max(widths[:, None] ** 4 / 384.0 * self._fourth(), axis=0)
        return found

    def thinned(self, count: int) -> "LocusTable":
        """Return a table of about `count` >= 2 nodes with equal relative errors; ends and kinks stay."""
        checks.count("count", count, at_least=2)
        if count >= self.key.size:
            return self
        span, size = np.ptp(self.columns, axis=0), np.max(np.abs(self.columns), axis=0)
        changes = span > ROUNDING * size
        bends = (self._fourth() / np.where(changes, span, np.inf)).max(axis=1)
        weights = np.where(np.isinf(bends), 0.0, bends) ** 0.25 * np.abs(np.diff(self.key))
        shares = np.cumsum(weights + LEAST_DENSITY * weights.mean() + np.finfo(float).tiny)
        edges = np.concatenate([[0.0], shares / shares[-1]])
        kinks = np.flatnonzero(self._kinks())
        kept = np.unique(np.concatenate([_nearest(edges, count), kinks, kinks + 1]))
        return LocusTable(self.key[kept], self.columns[kept], self.slopes[kept], self.units)

    def _kinks(self) -> Any:
        """Return the mask of intervals that only join two smooth parts."""
        return np.abs(np.diff(self.key)) < KINK * (self.high - self.low)

    def _fourth(self) -> Floats:
        """Return |f''''| (K - 1, n), the greater of both nodes of an interval; 0 across a kink."""
        widths, rises, kinks = np.diff(self.key)[:, None], np.diff(self.columns, axis=0), self._kinks()
        third = 6.0 * (widths * (self.slopes[:-1] + self.slopes[1:]) - 2.0 * rises) / widths**3
        third[kinks] = np.nan
        inner = np.abs(np.diff(third, axis=0) / (0.5 * (widths[:-1] + widths[1:])))
        unknown = np.full((1, self.width), np.nan)
        found: Floats = np.fmax(np.vstack([unknown, inner]), np.vstack([inner, unknown]))
        return np.where(kinks[:, None], 0.0, np.where(np.isnan(found), np.inf, found))


def _nearest(edges: Floats, count: int) -> Any:
    """Return the indices of the edges nearest to equal shares."""
    wanted = np.linspace(0.0, 1.0, count)
    after = np.clip(np.searchsorted(edges, wanted), 1, edges.size - 1)
    return np.where(wanted - edges[after - 1] < edges[after] - wanted, after - 1, after)


def _check_monotone(key: Floats) -> None:
    """Refuse a key that is not strictly monotone."""
    steps = np.diff(key)
    wrong = np.flatnonzero((np.sign(steps) != np.sign(steps[0])) | (steps == 0))
    if wrong.size:
        k = int(wrong[0])
        told = f"{key[k]:.12g} and {key[k + 1]:.12g}"
        raise ValueError(f"key must rise or fall strictly; key[{k}] and key[{k + 1}] are {told}")


def _no_key(name: str, value: float) -> ValueError:
    return checks.refuse(name, "a number, no NaN", float(value))


def _fixed(array: Floats) -> Floats:
    own = array.copy()
    own.flags.writeable = False
    return own
