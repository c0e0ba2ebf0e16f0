"""Columns of the table of one part, outcomes that are told, and words for parts."""

from collections.abc import Sequence
from math import nan
from typing import Any

import numpy as np

from hwsim._log.frames import NUMBERS
from hwsim.protocols import PartLog
from sdpgrind.base.checks import Floats


def columns(log: PartLog, names: Sequence[str], part: int = -1) -> dict[str, Floats]:
    """Columns of the first table for one part, -1: the last; NaN where there is no such column."""
    table = log[log.tiers[0]]
    rows = table.part.values == (table.part.values[-1] if part < 0 else part)
    missing = np.full(rows.sum(), nan)
    return {name: table[name].values[rows] if name in table.variables else missing for name in names}


def part_named(log: PartLog, part: int = -1, noun: str = "part") -> str:
    """Return words for the part that a picture shows in detail, -1: the last; by its number in the run."""
    count = len(log)
    if NUMBERS in log.outcome.attrs:  # some parts of a run
        return f"{noun} {log.outcome.attrs[NUMBERS][part]}"
    return f"{noun} {part % count}, the last" if part % count == count - 1 > 0 else f"{noun} {part % count}"


def parts_named(log: PartLog) -> str:
    """Return words for all parts that a picture shows."""
    numbers = log.outcome.attrs.get(NUMBERS)
    return "Every part" if numbers is None else f"Parts {', '.join(map(str, numbers))}"


def modelled(outcome: Any) -> Any:
    """Return outcomes without roughness that its model drew beyond its range, where it tells none: NaN."""
    if "extrapolated" not in outcome or "roughness_ra" not in outcome:
        return outcome
    known = outcome.roughness_ra.where(outcome.extrapolated == 0)
    return outcome.assign(roughness_ra=known.assign_attrs(outcome.roughness_ra.attrs))
