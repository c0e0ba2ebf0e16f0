"""Blocks of the page of a comparison: each figure of each controller, and paired differences."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hwsim._log.columns import modelled
from hwsim._report.charged import FAULTS, FLAGS, least_of
from hwsim._report.statistics import counted_share, mean
from hwsim._report.worst import broken_off, worst_part
from sdpgrind.base.brief import counted, listed
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Picture, Sentences


def comparison(log: Any) -> Iterator[Block]:
    """Yield the blocks of a log of `compare`, up to the problem."""
    outcome = modelled(log.outcome)
    names, plant = [str(name) for name in outcome.controller.values], outcome.attrs.get("plant", "data")
    scalar = [str(n) for n, v in outcome.data_vars.items() if v.dims == ("controller", "part")]
    told = [name for name in scalar if np.any(np.ptp(np.nan_to_num(outcome[name].values), axis=(0, 1)))]
    flags = [name for name in told if name in FLAGS]
    told = [name for name in told if name not in FLAGS]
    yield Sentences(
        [
            f"the same {counted(len(log), 'part')} on {plant} by {listed(names)}",
            "; ".join(_scrap(outcome, names)),
            *_firm(outcome, names, told),
        ],
        strong=True,
    )
    yield Heading("Worst part of each controller")
    yield AmountTable("Worst value", [_worst(outcome[name], name) for name in told], ("figure", *names))
    yield AmountTable("Its part", [_which(outcome[name], name) for name in told], ("figure", *names))
    if flags:
        yield Heading("Parts with a flag")
        shares = [Amounts.of(name, map(counted_share, outcome[name].values.astype(float))) for name in flags]
        yield AmountTable("Number of parts, and 95 % interval of their share", shares, ("flag", *names))
    yield Heading("Means")
    rows = [_amounts(outcome[name], name, outcome[name].values, least_of(name)) for name in told]
    yield AmountTable("Mean over the parts, 95 % interval", rows, ("figure", *names))
    if len(names) > 1:
        less = [_amounts(outcome[n], n, outcome[n].values[1:] - outcome[n].values[:1]) for n in told]
        heads = ("figure", *(f"{name} minus {names[0]}" for name in names[1:]))
        yield AmountTable("Difference part by part, 95 % interval", less, heads)
    yield Heading("Pictures")
    yield Picture("Every figure", log.plot)


def _unit(variable: Any) -> str:
    return str(variable.attrs.get("units", ""))


def _scrap(outcome: Any, names: list[str]) -> Iterator[str]:
    """Faults of the parts of each controller, and parts broken off."""
    broken = [[bool(why) for why in broken_off(outcome.isel(controller=k))] for k in range(len(names))]
    bad = {"broken off": np.array(broken)}
    bad |= {words: outcome[name].values > 0 for name, words in FAULTS.items() if name in outcome}
    for words, parts in bad.items():
        counts = [f"{int(each.sum()) or 'none'} by {who}" for who, each in zip(names, parts, strict=True)]
        yield f"{words}: {', '.join(counts)}"


def _amounts(variable: Any, name: str, rows: Any, least: float = -np.inf) -> Amounts:
    return Amounts.of(name, [mean(np.asarray(row, dtype=float), least) for row in rows], _unit(variable))


def _worst(variable: Any, name: str) -> Amounts:
    worst = [worst_part(name, row) for row in variable.values]
    values = [row[number or 0] for row, number in zip(variable.values, worst, strict=True)]
    return Amounts.of(name, values, _unit(variable))


def _which(variable: Any, name: str) -> Amounts:
    worst = [worst_part(name, row) for row in variable.values]
    return Amounts.of(name, ["all alike" if number is None else number for number in worst])


def _firm(outcome: Any, names: list[str], told: list[str]) -> Iterator[str]:
    """The first figure in which the last controller differs from the first beyond the interval."""
    for name in told if len(names) > 1 else ():
        found = mean(outcome[name].values[-1] - outcome[name].values[0])
        if abs(found.value) > found.half and not name.startswith("true_"):
            unit = "" if _unit(outcome[name]) == "1" else _unit(outcome[name])
            apart = f"{names[-1]} minus {names[0]} {found.shown(1.0)} {unit}".rstrip()
            yield f"{name.replace('_', ' ')}, mean over the parts: {apart}"
            return
