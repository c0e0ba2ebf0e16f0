"""A line for each part on the page of a log."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from hwsim._log.columns import modelled
from hwsim._report.charged import FLAGS, charged_names
from hwsim._report.worst import broken_off
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Sentences

_MOST = 500  # parts on lines of their own; chosen: they take a quarter of a page of 1.5 MB
_WIDTH = 9  # columns of a table; chosen: they fit the width of a page
_ALWAYS = ("time", *FLAGS)  # chosen: a reader looks for them, and twenty burned parts are all alike


def every_part(log: Any, columns: Callable[[Any, int], Sequence[Amounts]]) -> Iterator[Block]:
    """Yield a line for each part: `columns` of a log and of the number of parts that are shown."""
    yield Heading("Every part")
    if len(log) > _MOST:
        yield Sentences(
            [
                f"The first {_MOST} of {len(log)} parts; the figures above, worst parts included, and the "
                "digest of the outcomes below are of all parts."
            ]
        )
    for narrow in _narrow(columns(log, min(len(log), _MOST))):
        yield AmountTable("Each part", narrow)


def outcomes(log: Any, shown: int) -> list[Amounts]:
    """Return columns with what the first parts of a run became, and why they were broken off."""
    outcome, why = modelled(log.outcome), broken_off(log.outcome)
    columns = [Amounts.of("part", range(shown))]
    columns += [_column(outcome[name], name, shown) for name in _scalars(outcome, charged_names(log))]
    if any(why):
        columns.append(Amounts.of("broken_off", [each or "no" for each in why[:shown]]))
    return columns


def _scalars(outcome: Any, charged: Sequence[str]) -> list[str]:
    """Outcomes of one number a part, hidden truths last.

    What is the same for all parts is left out, except time and flags; so is a copy of another outcome;
    of two copies the charged one is kept.
    """
    names = [str(n) for n, v in outcome.data_vars.items() if v.dims == ("part",) and v.dtype.kind in "fiub"]
    told = [n for n in names if n in _ALWAYS or outcome.sizes["part"] == 1 or _varies(outcome[n].values)]
    kept: list[str] = []
    for name in sorted(told, key=lambda name: (name not in charged, name.startswith("true_"))):
        if name in _ALWAYS or not any(_alike(outcome[name], outcome[other]) for other in kept):
            kept.append(name)
    return sorted(kept, key=lambda name: (name.startswith("true_"), told.index(name)))


def _alike(one: Any, other: Any) -> bool:
    """Whether two outcomes are equal in each part, unit included."""
    same_unit = one.attrs.get("units") == other.attrs.get("units")
    return same_unit and np.array_equal(one.values.astype(float), other.values.astype(float), equal_nan=True)


def _varies(values: Any) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and (known.size < values.size or np.any(known != known[0])))


def _column(variable: Any, name: str, shown: int) -> Amounts:
    return Amounts.of(name, variable.values[:shown], str(variable.attrs.get("units", "")))


def _narrow(columns: Sequence[Amounts]) -> Iterator[list[Amounts]]:
    """Cut columns into tables that fit a page, the first column in each."""
    first, *others = columns
    for k in range(0, max(len(others), 1), _WIDTH):
        yield [first, *others[k : k + _WIDTH]]
