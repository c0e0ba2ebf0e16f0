"""Reports of the command line: the first parts, and the plan's prediction next to the outcome.

Parts that were broken off are marked and counted, and left out of means; a share of all parts says so.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from hwsim._log.columns import modelled
from hwsim._report.worst import GAVE_UP, broken_off, worst_part
from sdpgrind.base.brief import counted

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHOWN = 10  # parts printed one by one; chosen: the summary still fits a screen
Finished = npt.NDArray[np.bool_]
"""Whether each part was finished."""


@dataclass(frozen=True)
class CommandReport:
    """Printed report of a run: a head, the first parts, predicted and realised means.

    `head` gives lines from title, plan and job; `summary` gives lines from log, plan, job and `Finished`.
    """

    columns: Sequence[tuple[str, str]]  # name and format of each column of the table
    headings: Mapping[str, str]  # shorter headings of some columns
    head: Callable[[str, Any, Any], Iterator[str]]
    summary: Callable[["Log", Any, Any, Finished], Iterator[str]]
    part: str = "part"
    otherwise: str = GAVE_UP  # reason where no flag is set

    def __call__(self, title: str, log: "Log", plan: Any, job: Any = None) -> str:
        """Return the whole report as text."""
        why = broken_off(log.outcome, self.otherwise)
        finished = np.array([not each for each in why])
        table = parts_table(log, self.part, self.columns, self.headings, why)
        means = [
            summary_head(int(finished.sum()), len(log), self.part),
            *self.summary(log, plan, job, finished),
            *broken_lines(why, self.part),
        ]
        return "\n".join([*self.head(title, plan, job), "", *table, "", *means])


def parts_table(
    log: "Log",
    part: str,
    columns: Sequence[tuple[str, str]],
    short: Mapping[str, str],
    why: Sequence[str] = (),
) -> Iterator[str]:
    """Lines of a table of the first parts and the worst of each column; a column for each (name, format).

    `short`: headings of some columns. `why` ends the line of a part that was broken off.
    """
    outcome = modelled(log.outcome)
    yield "  ".join([part, *(f"{_heading(outcome, name, short):>12}" for name, _ in columns)])
    for k in range(min(len(log), _SHOWN)):
        cells = (f"{_cell(outcome[name].values[k], form):>12}" for name, form in columns)
        yield "  ".join([f"{k:{len(part)}d}", *cells]) + (f"  broken off: {why[k]}" if why and why[k] else "")
    if len(log) > _SHOWN:
        yield f" ...  ({len(log) - _SHOWN} more)"
    yield from _worst(outcome, part, columns)


def _worst(outcome: Any, part: str, columns: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Two lines: the worst value of each column over all parts, and the part that has it."""
    parts = {name: worst_part(name, outcome[name].values) for name, _ in columns}
    if all(number is None for number in parts.values()):
        return
    values, numbers = [" " * len(part)], [" " * len(part)]
    for name, form in columns:
        number = parts[name]
        values.append(f"{_cell(outcome[name].values[number or 0], form):>12}")
        numbers.append(f"{'-' if number is None else number:>12}")
    for words, cells in (("worst", values), (f"in {part}", numbers)):
        yield words + "  ".join(cells)[len(words) :]  # the cells are wider than the word


def _cell(value: Any, form: str) -> str:
    if np.isnan(value):
        return "-"
    return format(int(value) if form == "d" else float(value), form)


def _heading(outcome: Any, name: str, short: Mapping[str, str]) -> str:
    unit, word = outcome[name].attrs["units"], short.get(name, name)
    return word if unit == "1" else f"{word} {unit}"


def summary_head(finished: int, parts: int, part: str) -> str:
    """Heading for lines of `summary_line`."""
    some = "" if finished == parts else f"{finished} of "
    return f"{f'mean of {some}{counted(parts, part)}':<24}{'planned':>12}{'realised':>12}{'std. error':>12}"


def summary_line(name: str, values: Any, form: str, planned: float | None = None) -> str:
    """Line with the planned value, the realised mean and its standard error."""
    error = format(values.std(ddof=1) / np.sqrt(values.size), form) if values.size > 1 else "-"
    promise = "" if planned is None else format(planned, form)
    return f"{name:<24}{promise:>12}{format(values.mean(), form):>12}{error:>12}"


def of_all(name: str, finished: Finished) -> str:
    """Name of a share (%) in which parts that were broken off count, too."""
    return f"{name} (%)" if finished.all() else f"{name}, of all (%)"


def broken_lines(why: Sequence[str], part: str) -> Iterator[str]:
    """Lines with number of parts broken off, and reasons; none when all were finished."""
    broken = Counter(filter(None, why))
    if not broken:
        return
    yield summary_line("broken off (%)", 100.0 * np.array([bool(each) for each in why]), ".1f", 0.0)
    reasons = ", ".join(f"{reason} ({number})" for reason, number in broken.items())
    if broken.total() == len(why):
        yield f"no {part} was finished: {reasons}"
    else:
        yield (
            f"{broken.total()} of {len(why)} {part}s were broken off, "
            f"and are in no mean of times and sizes: {reasons}"
        )
