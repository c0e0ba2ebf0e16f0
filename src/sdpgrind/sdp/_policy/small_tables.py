"""Small tables of a policy: codes of actions, rounded numbers, cells with lines as sorted lists.

A number is offset + scale * n, with constants for each code of an action (a move with an entry of its lists).
The ends of its range are not left: a control stays in the interval of its move.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy.single import frame_of
from sdpgrind.sdp._policy.small_kernels import GAP, VALUE, SmallTable, ToldTable
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._solve.kinks import Kinks

PRECISIONS = ("int16", "float32", "double")  # from the smallest on
_TYPES: dict[str, tuple[type, type]] = {
    "int16": (np.int16, np.float32),
    "float32": (np.float32, np.float64),
    "double": (np.float64, np.float64),
}
"""Type of rounded numbers, and of costs of lines whose order these would change."""
_ROUNDED = ("control", "line_control", "cost", "told")
LARGEST = 2**15 - 1  # derived: largest n of 16 bits; -LARGEST - 1 stands for infinity
_TOLD = {"gap": GAP, "value": VALUE}


@dataclass(frozen=True)
class Small:
    """Small tables, and what they say at the nodes.

    Attributes
    ----------
    precision : str
        One of `PRECISIONS`.
    table : SmallTable
        Policy.
    told : ToldTable or None
        What is told beside the action; None: nothing.
    control : array [row, mode, node]
        Control at the nodes, in its unit; NaN: a stop, or a move without one.
    """

    precision: str
    table: SmallTable
    told: ToldTable | None
    control: Floats

    @property
    def law(self) -> tuple[Any, ...]:
        """The tables, as C has them."""
        return (self.table,) if self.told is None else (self.table, self.told)

    @property
    def wide(self) -> tuple[Any, ...]:
        """The tables with doubles and long whole numbers: one compiled kernel serves all of them."""
        return tuple(one._make(map(_wide, one._fields, one)) for one in self.law)


def _wide(name: str, thing: Any) -> Any:
    if not isinstance(thing, np.ndarray):
        return thing
    return thing.astype(np.float64 if name in _ROUNDED or thing.dtype.kind == "f" else np.int64)


@dataclass(frozen=True)
class Codes:
    """Codes of actions: -1, -2, ... the stops; then each move with each entry of its lists."""

    first: Any
    move: Any
    stops: int

    @classmethod
    def of(cls, solution: Solution) -> "Codes":
        """Read the moves of a policy."""
        counts = [len(move.lists[0][1]) if move.lists else 1 for move in solution.layout.moves]
        first = np.concatenate([[0], np.cumsum(counts)])
        return cls(first[:-1], np.repeat(np.arange(len(counts)), counts), len(solution.layout.stops))

    def __call__(self, best: Any, entry: Any) -> Any:
        """Return the codes of moves (stops < 0) with entries."""
        return np.where(best < 0, best, self.first[np.maximum(best, 0)] + entry)


class Rounding:
    """How numbers are kept: multiples of a scale in 16 bits, or floats.

    Parameters
    ----------
    precision : str
        One of `PRECISIONS`.
    """

    def __init__(self, precision: str) -> None:
        self.kind, self.wide = _TYPES[precision]
        self.whole = precision == "int16"

    def coding(self, groups: list[Floats]) -> Floats:
        """Return offset and scale of each group of numbers, [group, 2]; NaN and 0 where it has none."""
        known = [some[np.isfinite(some)] for some in groups]
        return np.array([self._coding(some) if some.size else (np.nan, 0.0) for some in known])

    def _coding(self, numbers: Floats) -> tuple[float, float]:
        if not self.whole:
            return 0.0, 1.0
        low, high = float(numbers.min()), float(numbers.max())
        middle, scale = low + 0.5 * (high - low), (high - low) / (2 * LARGEST)
        while middle + scale * LARGEST > high or middle - scale * LARGEST < low:
            scale = float(np.nextafter(scale, 0.0))  # the last bits of the ends
        return middle, scale

    def stored(self, numbers: Floats, coding: Floats) -> Any:
        """Return numbers as they are kept, with offset and scale `coding[..., 2]` of each; half to even."""
        offset, scale = coding[..., 0], coding[..., 1]
        if not self.whole:
            return np.where(np.isnan(offset), 0.0, numbers).astype(self.kind)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.rint(np.where(scale > 0.0, (numbers - offset) / scale, 0.0))
        found = np.where(np.isfinite(found), found, 0.0)
        if np.any(np.abs(found) > LARGEST):
            raise checks.refuse("precision", "float32 or double for this policy", "int16")
        return found.astype(self.kind)


def decoded(stored: Any, coding: Floats) -> Floats:
    """Return the numbers that the kernels read."""
    found: Floats = coding[..., 0] + coding[..., 1] * stored.astype(float)
    return found


def small_of(solution: Solution, precision: str, told: tuple[str, ...] = ()) -> Small:
    """Return the small tables of a policy; `told` of "gap" and "value" ($) stand beside the action."""
    rounding, codes, t = Rounding(precision), Codes.of(solution), solution.table
    kinks = solution.kinks
    code, line_code = codes(t.best, t.entry), codes(kinks.act, kinks.entry)
    number = range(codes.move.size)
    groups = [np.append(t.control[code == k], kinks.control[line_code == k]) for k in number]
    coding = rounding.coding(groups)
    own = coding[np.maximum(code, 0)]
    control = rounding.stored(np.where(code < 0, own[..., 0], t.control), own)
    lines = _Lines(rounding, codes, kinks, line_code, coding)
    codes_of = narrowed(1, code, codes.move, line_code)
    first, cells, start, place = narrowed(2, *_sorted(kinks), lines.place)
    line_control, cost, wide = lines.arrays
    table = SmallTable(
        frame_of(solution), solution.shape, codes_of[0], control, coding, codes_of[1], first, cells, start,
        codes_of[2], line_control, place, cost, wide, lines.coding, bool(np.any(lines.place < 0)),
    )  # fmt: skip
    read = np.where(code < 0, np.nan, decoded(control, own))
    return Small(precision, table, _told(solution, rounding, told), read)


def narrowed(least: int, *arrays: Any) -> list[Any]:
    """Return whole numbers in the fewest bytes, `least` or more, that hold those of all the arrays.

    One type for several arrays, and one number for an array without any: each tuple of types is compiled.
    """
    filled = [a if a.size else np.zeros((1, *a.shape[1:]), np.int64) for a in map(np.asarray, arrays)]
    low, high = min(int(a.min()) for a in filled), max(int(a.max()) for a in filled)
    kinds = [k for k in (np.int8, np.int16, np.int32, np.int64) if np.dtype(k).itemsize >= least]
    kind = next(k for k in kinds if np.iinfo(k).min <= low and high <= np.iinfo(k).max)
    return [np.ascontiguousarray(a, dtype=kind) for a in filled]


def _sorted(kinks: Kinks) -> tuple[Any, ...]:
    """Return the first cell of each group (row, mode), the cells, and the first line of each."""
    rows, modes, cells = kinks.at.shape
    flat = kinks.at.reshape(rows * modes, cells)
    group, cell = np.nonzero(flat >= 0)
    first = np.searchsorted(group, np.arange(flat.shape[0] + 1))
    number = flat[group, cell]
    assert np.array_equal(number, np.arange(number.size))  # `sorted_kinks` numbers them in this order
    return first, cell, kinks.start


class _Lines:
    """Lines of cost: controls by code; costs rounded where the order at both ends of a cell stays."""

    def __init__(self, rounding: Rounding, codes: Codes, kinks: Kinks, code: Any, coding: Floats) -> None:
        self.code, self.kinks = code, kinks
        own = coding[np.maximum(code, 0)][:, None]
        self.control = rounding.stored(np.where(code[:, None] < 0, own[..., 0], kinks.control), own)
        numbers = np.arange(-codes.stops, codes.move.size)
        self.coding = rounding.coding([kinks.cost[code == k].ravel() for k in numbers])
        told = self.coding[code + codes.stops][:, None]
        cost = rounding.stored(kinks.cost, told)
        kept = self._in_order(decoded(cost, told))
        self.place = np.where(kept, np.cumsum(kept) - 1, -np.cumsum(~kept))
        self.cost, self.wide = cost[kept], kinks.cost[~kept].astype(rounding.wide)

    def _in_order(self, rounded: Floats) -> Any:
        """Mask of lines in cells in which all lines keep their order at both ends."""
        start, out = self.kinks.start, np.ones(self.code.size, bool)
        for a, b in itertools.pairwise(start):
            exact, near = self.kinks.cost[a:b], rounded[a:b]
            out[a:b] = np.array_equal(_order(exact), _order(near))
        return out

    @property
    def arrays(self) -> list[Any]:
        """Controls and costs; a line that is never read where there is none."""
        each = (self.control, self.cost, self.wide)
        return [array if len(array) else np.zeros((1, 2), array.dtype) for array in each]


def _order(cost: Floats) -> Any:
    """Signs of all differences of the lines of one cell at both ends."""
    return np.sign(cost[:, None] - cost[None])


def _told(solution: Solution, rounding: Rounding, names: tuple[str, ...]) -> ToldTable | None:
    """Tables told beside the action; infinity is a number of its own in 16 bits."""
    if not names:
        return None
    tables = [getattr(solution.table, name) for name in names]
    coding = rounding.coding([table.ravel() for table in tables])
    coding[np.isnan(coding[:, 0])] = 0.0, 1.0  # of infinities alone
    none = float(-LARGEST - 1) if rounding.whole else np.nan
    endless = [rounding.whole & np.isinf(table) for table in tables]
    parts: list[Any] = []
    for table, one, never in zip(tables, coding, endless, strict=True):
        stored = rounding.stored(table, np.broadcast_to(one, (*table.shape, 2)))
        parts.append(np.where(never, none, stored).astype(rounding.kind))
    kind = np.array([_TOLD[name] for name in names], dtype=np.int8)
    coding = np.column_stack([coding, np.full(len(names), none)])
    return ToldTable(kind, np.concatenate(parts), coding, bool(np.any(endless)))
