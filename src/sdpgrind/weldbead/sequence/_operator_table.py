"""The table by which an operator grinds: duration and force by height and time left."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.text_table import aligned
from sdpgrind.weldbead.sequence._operator_rule import TableRule, expected, placed_heights
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._sheet_file import write_sheet

LOSS_MAX = 0.02  # relative; chosen: below the error that coefficients of a process have
_SIZES = ((12, 5), (24, 10), (45, 15))  # rows and most columns; chosen: the last fills a sheet of A4
# chosen by trial on the presets, where the best of 0 to 1 changes: weights of durations where rows are placed
_SHARES = (0.0, 0.3)
_STEPS = 3  # steps between columns that are tried; chosen: durations that share a divisor favour one of them


@dataclass(frozen=True)
class OperatorTable:
    """A planned sequence as a table for the wall, with what reading it in steps costs.

    Made by `SequencePolicy.operator_table`. Between entries: the row of the next greater height and
    the column of the next shorter time. Above the greatest height its row holds; below the shortest time,
    stop.

    Attributes
    ----------
    heights : array (rows,)
        Rows: heights, mm.
    times : array (columns,)
        Columns: times left, s.
    duration : array (rows, columns)
        Duration of the next pass, s; 0: stop.
    normal_force : array (rows, columns)
        Normal force, N; NaN: stop.
    expected : float
        Expected penalty by the table from its last row and column, $.
    planned : float
        Expected penalty of the plan from there, $.
    full : bool
        Whether a finer table would be larger than a sheet of A4.
    """

    heights: Floats
    times: Floats
    duration: Floats
    normal_force: Floats
    expected: float
    planned: float
    full: bool = False

    @property
    def loss(self) -> float:
        """Expected penalty that reading the table in steps adds, $."""
        return self.expected - self.planned

    @property
    def sentences(self) -> tuple[str, ...]:
        """How the table is read, and what that costs, $."""
        share = f" ({100 * self.loss / self.planned:.3g} %)" if self.planned > 0 else ""
        full = "; a finer table does not fit on A4" if self.full else ""
        return (
            "Measure the height; between two rows take that of the greater height, further down. Take the "
            "time left; between two columns take that of the shorter time, further left.",
            "The cell has the duration of the next pass, reset included, and its normal force; a dash means "
            f"stop. Stop at the target height, too, and with less than {self.times[0]:g} s left.",
            f"From {self.heights[-1]:.4g} mm and {self.times[-1]:g} s it costs {self.expected:.4g} $ on "
            f"average, the plan itself {self.planned:.4g} $: {self.loss:+.2g} ${share}{full}.",
        )

    def action(self, height: float, time_left: float) -> tuple[float, float]:
        """Return duration (s; 0: stop) and force (N; NaN: stop) at a height (mm) and a time left (s).

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101)
        >>> table = policy.operator_table(heights=[0.5, 1.0, 2.0], times=[20, 40, 60])
        >>> table.action(0.0, 30.0)
        (0.0, nan)
        """
        column = int(np.searchsorted(self.times, time_left + 1e-9, side="right")) - 1
        if column < 0 or height <= 0:
            return 0.0, float("nan")
        row = min(int(np.searchsorted(self.heights, height - 1e-9)), len(self.heights) - 1)
        return float(self.duration[row, column]), float(self.normal_force[row, column])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file, complete or not at all: ``.csv``, ``.txt``, or ``.html`` for the printer.

        Parameters
        ----------
        path : path
            File in an existing folder. A ``.csv`` has one line an entry: height (mm), time left (s), duration
            (s), normal force (N).

        Raises
        ------
        ValueError
            For another ending.
        ImportError
            For HTML without jinja2 (extra ``report``).
        """
        write_sheet(self, path)

    def _lines(self) -> Iterator[str]:
        yield "height [mm],time_left [s],duration [s],normal_force [N]"
        for row, height in enumerate(self.heights.tolist()):
            for column, left in enumerate(self.times.tolist()):
                force = self.normal_force[row, column]
                said = "" if np.isnan(force) else repr(float(force))
                yield f"{height!r},{left!r},{float(self.duration[row, column])!r},{said}"

    def _cells(self) -> list[list[str]]:
        both = zip(self.duration.tolist(), self.normal_force.tolist(), strict=True)
        return [[_cell(*cell) for cell in zip(*row, strict=True)] for row in both]

    def _blocks(self) -> Iterator[Any]:
        from sdpgrind.base.sheets.amounts import Amounts
        from sdpgrind.base.sheets.blocks import AmountTable, Sentences

        rows = [f"{height:.4g}" for height in self.heights]
        columns = [Amounts.of("height", rows, heading="height mm \\ time left s")]
        for left, cells in zip(self.times, zip(*self._cells(), strict=True), strict=True):
            columns.append(Amounts.of(f"{left:g}", cells))
        yield AmountTable("Next pass: duration s / normal force N", columns)
        yield Sentences(self.sentences)

    def __str__(self) -> str:
        cells = [["mm \\ s", *(f"{left:g}" for left in self.times)]]
        cells += [[f"{height:.4g}", *row] for height, row in zip(self.heights, self._cells(), strict=True)]
        lines = ["Next pass: duration s / normal force N", *aligned(cells, ">")]
        return "\n".join([*lines, "", *self.sentences, ""])

    def __repr__(self) -> str:
        return (
            f"OperatorTable({len(self.heights)} heights, {len(self.times)} times, costs {self.loss:+.2g} $)"
        )


def _cell(duration: float, force: float) -> str:
    return "-" if np.isnan(force) else f"{duration:g} / {force:.4g}"


def operator_table(
    problem: SequenceProblem, plan: sdp.Policy, heights: npt.ArrayLike | None, times: npt.ArrayLike | None
) -> OperatorTable:
    """Return the table of given rows and columns, or the first of growing tables whose loss is small."""
    given = None if heights is None else _rising("heights", heights, problem.height_max, "height_max", "mm")
    columns = None if times is None else _rising("times", times, problem.horizon, "horizon", "s")
    for count, most in _SIZES:
        rows = _rows(problem, plan, count) if given is None else [given]
        across = list(_columns(problem, most)) if columns is None else [columns]
        tried = [TableRule(plan, up, left) for up in rows for left in across]
        best = min(tried, key=lambda rule: rule.expected)
        planned = expected(plan, float(best.heights[-1]), float(best.times[-1]))
        if best.expected <= (1 + LOSS_MAX) * planned or (given is not None and columns is not None):
            return _table(problem, best, planned)
    return _table(problem, best, planned, full=True)


def _table(problem: SequenceProblem, rule: TableRule, planned: float, *, full: bool = False) -> OperatorTable:
    best, _, force = rule.cells
    moves = np.array([problem.stage * move.duration for move in rule.layout.moves])
    duration = np.where(best < 0, 0.0, moves[np.maximum(best, 0)])
    normal_force = np.where(best < 0, np.nan, force)
    return OperatorTable(rule.heights, rule.times, duration, normal_force, rule.expected, planned, full)


def _rows(problem: SequenceProblem, plan: sdp.Policy, count: int) -> list[Floats]:
    """Rows: so many heights, closer where the action changes."""
    times = next(_columns(problem, plan.layout.count + 1))  # every stage
    return [placed_heights(plan, times, problem.height_max, count, share) for share in _SHARES]


def _columns(problem: SequenceProblem, most: int) -> Iterator[Floats]:
    """Columns at even steps of whole stages, at most so many: for the smallest steps that allow it."""
    first, last = (round(each / problem.stage) for each in (min(problem.durations), problem.horizon))
    least = -(-(last - first + 1) // most)
    for step in range(least, least + _STEPS):
        yield np.arange(float(last), first - 1, -step)[::-1] * problem.stage


def _rising(name: str, given: Any, most: float, limit: str, unit: str) -> Floats:
    """Check rows or columns of a user."""
    values = np.asarray(list(given) if isinstance(given, Iterable) else [given], dtype=float)
    if values.size == 0 or not np.all(np.diff(values) > 0) or values[0] <= 0:
        raise checks.refuse(name, "rising numbers > 0", given, unit)
    if values[-1] > most:
        raise checks.refuse(f"{name}[-1]", f"<= {limit}, {most:g}", float(values[-1]), unit)
    return values
