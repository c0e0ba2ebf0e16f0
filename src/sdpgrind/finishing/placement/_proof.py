"""A necessary condition that fails, with numbers; and how it is held against every azimuth."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from sdpgrind.finishing.placement._azimuths import AzimuthRange, ranges
from sdpgrind.finishing.placement._task import PlacingTask

RANGES_MAX = 400  # chosen: ranges of azimuths after which no proof is found; some seconds
SHARP = 0.25  # chosen: share of the excess by which a proof may be blunter than the condition itself


@dataclass(frozen=True)
class Proof:
    """A condition that every placement must fulfil, and none can.

    Attributes
    ----------
    condition : {"span", "height", "reach"}
        "span": travel of the table. "height": travel of the wrist at its radius. "reach": distance from the
        first axis.
    needed, available : float
        What the path needs at the best placement, at least, and what the robot has, in `unit`.
    unit : str
        Unit of both.
    text : str
        The proof in a sentence.
    """

    condition: str
    needed: float
    available: float
    unit: str
    text: str

    def __str__(self) -> str:
        return self.text


class Shortfall(NamedTuple):
    """What the path needs, at least, over a range of azimuths, and what there is, mm; `axis`: its name."""

    needed: float
    available: float
    axis: str = ""

    @property
    def excess(self) -> float:
        """What is missing, mm; a condition fails where it is > 0."""
        return self.needed - self.available


Condition = Callable[[PlacingTask, AzimuthRange], Shortfall]
"""Shortfall over a range of azimuths: at most the least one in it; exact where the range is one azimuth."""


def failing(task: PlacingTask, condition: Condition) -> Shortfall | None:
    """Return the least shortfall over all azimuths where a condition fails at each; None: not proved.

    Ranges are halved until the bound over each is above zero and near that of the condition at its middle,
    the least first. At an azimuth where the condition holds there is nothing to prove.
    """
    waiting = [_entry(task, condition, over) for over in ranges(task)]
    heapq.heapify(waiting)
    least, nearest = None, min(waiting).middle
    for _ in range(RANGES_MAX):
        if not nearest > 0 or not waiting:
            return least if nearest > 0 else None
        over = heapq.heappop(waiting).over
        found = condition(task, over)
        if found.excess < (1 - SHARP) * nearest:
            for half in over.halves():
                heapq.heappush(waiting, _entry(task, condition, half))
            nearest = min(nearest, *(entry.middle for entry in waiting))
        elif least is None or found.excess < least.excess:
            least = found
    return None


class _Entry(NamedTuple):
    """Range with the excess at its middle, mm."""

    middle: float
    over: AzimuthRange


def _entry(task: PlacingTask, condition: Condition, over: AzimuthRange) -> _Entry:
    return _Entry(condition(task, over.middle()).excess, over)
