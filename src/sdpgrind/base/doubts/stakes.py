"""Stakes: what it costs not to know, by the plan solved again at both ends of each interval."""

import re
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from sdpgrind.base.doubts.rows import Doubt

ALL = "all of them"
"""Name of the stake of all values together."""
_LONG = re.compile(r"\d+\.\d{6,}(e[-+]?\d+)?")  # chosen: digits of a computed end, not of a limit


class Figure(NamedTuple):
    """What a plan is judged by: its name, unit, value as believed, and how well it was solved, in words."""

    name: str
    unit: str
    value: float
    solved: str = ""


class Stake(NamedTuple):
    """Figure of the plan at both ends of the interval of a value; NaN: no plan, for the `reason`.

    That of several values together has no interval, ends of NaN and the same figure at both.
    """

    name: str
    unit: str
    low: float
    high: float
    at_low: float
    at_high: float
    reason: str = ""

    def change(self, believed: float) -> float:
        """Greatest difference between the plans at both ends and that of the believed value; inf: no plan."""
        found = [abs(value - believed) for value in (self.at_low, self.at_high) if np.isfinite(value)]
        return max(found, default=np.inf) if np.isfinite(believed) else np.inf


def stakes(
    rows: Iterable[Doubt], figure: Figure, solved: Callable[[str, float], float | None]
) -> tuple[Stake, ...]:
    """Return the stake of each measured value, largest first.

    `solved`: figure of the plan with a field changed; None: the plan does not depend on it. A ValueError of
    it is the reason why there is no such plan.
    """
    found = []
    for row in rows:
        if not row.measured:
            continue
        (at_low, why), (at_high, why_high) = (
            _tried(partial(solved, row.name, end)) for end in (row.low, row.high)
        )
        if at_low is not None and at_high is not None:
            found.append(Stake(row.name, row.unit, row.low, row.high, at_low, at_high, why or why_high))
    return tuple(sorted(found, key=lambda stake: -stake.change(figure.value)))


def together(found: Sequence[Stake], solved: Callable[[], float | None], note: str = "") -> tuple[Stake, ...]:
    """Return stakes with a last one, of all values taken over at once: one alone may contradict the others.

    `solved`: figure of the plan with all of them. `note`: how that plan differs besides. Fewer than two
    stakes: there is no such one.
    """
    if len(found) < 2:
        return tuple(found)
    return (*found, jointly(ALL, solved, note))


def jointly(name: str, solved: Callable[[], float | None], note: str = "") -> Stake:
    """Return the stake of several values as told; see `together`."""
    value, why = _tried(solved)
    at = np.nan if value is None else value
    return Stake(name, "", np.nan, np.nan, at, at, why or note)


def _tried(solved: Callable[[], float | None]) -> tuple[float | None, str]:
    try:
        return solved(), ""
    except ValueError as error:
        return np.nan, _LONG.sub(lambda number: f"{float(number[0]):.4g}", str(error))
