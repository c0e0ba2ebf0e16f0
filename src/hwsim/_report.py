"""Tables that the command line prints: the first parts one by one, and the plan's promise beside what came of it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hwsim._log import Log

_SHOWN = 10  # parts printed one by one


def parts_table(log: "Log", part: str, columns: Sequence[tuple[str, str]], short: Mapping[str, str]) -> Iterator[str]:
    """Lines of a table of the first parts: a column (name, format) of the outcome each; `short` are headings of some."""
    outcome = log.outcome
    yield "  ".join([part, *(f"{_heading(outcome, name, short):>12}" for name, _ in columns)])
    for k in range(min(len(log), _SHOWN)):
        cells = (f"{_cell(outcome[name].values[k], form):>12}" for name, form in columns)
        yield "  ".join([f"{k:{len(part)}d}", *cells])
    if len(log) > _SHOWN:
        yield f" ...  ({len(log) - _SHOWN} more)"


def _cell(value: Any, form: str) -> str:
    return format(int(value) if form == "d" else float(value), form)


def _heading(outcome: Any, name: str, short: Mapping[str, str]) -> str:
    unit, word = outcome[name].attrs["units"], short.get(name, name)
    return word if unit == "1" else f"{word} {unit}"


def summary_head(log: "Log", part: str) -> str:
    """Heading of the lines that `summary_line` makes."""
    return f"{f'mean of {len(log)} {part}s':<24}{'planned':>12}{'realised':>12}{'std. error':>12}"


def summary_line(name: str, values: Any, form: str, planned: float | None = None) -> str:
    """Planned (the plan on its own model) against realised (the stand), with the standard error of the mean."""
    error = format(values.std(ddof=1) / np.sqrt(values.size), form) if values.size > 1 else "-"
    promise = "" if planned is None else format(planned, form)
    return f"{name:<24}{promise:>12}{format(values.mean(), form):>12}{error:>12}"
