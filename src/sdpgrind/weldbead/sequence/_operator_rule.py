"""A sequence by a table of few heights and times, and the expected penalty that it costs."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._risk import nodes_of

_ROUNDING = 1e-9  # mm, s; chosen: far below what is read off a gauge or a clock
_LOWEST = (
    1 / 400
)  # lowest row over the greatest height; chosen: below it all but 0.01 % of the charge is spent
_CANDIDATES = 600  # heights among which the rows are placed; chosen: ten times as many as rows


class TableRule(sdp.Policy):
    """The planned policy read in steps: the next greater height of a row, the next shorter time of a column.

    The action of a cell is that of the plan in the middle between its row and the row below, which costs less
    than that of the row itself (of P1, 45 rows and 12 columns: 0.022 $ instead of 0.039 $). Below the first
    column, and from the target down, the rule stops.
    """

    def __init__(self, policy: sdp.Policy, heights: Floats, times: Floats) -> None:
        super().__init__(policy.problem, policy.layout, policy.table, policy.error)
        self.heights, self.times = heights, times
        middle = (heights + np.r_[0.0, heights[:-1]]) / 2
        state = np.meshgrid(middle, times, indexing="ij")
        place = policy.locate(dict(zip(("height", "time_left"), state, strict=True)))
        best, entry, force = (each.reshape(place.shape) for each in policy.act(place)[:3])
        self.cells = best, entry, _printable(force)

    def act(self, place: Any) -> tuple[Any, Any, Floats, Floats]:
        """Return move (-1: stop), entry, force (N) and gap (0) by the table."""
        height = place.points[0]
        left = (place.row + self.countdown.first) * self.layout.step
        row = np.minimum(np.searchsorted(self.heights, height - _ROUNDING), len(self.heights) - 1)
        column = np.searchsorted(self.times, left + _ROUNDING, side="right") - 1
        ends = (column < 0) | (height <= 0)
        best, entry, force = (each[row, column] for each in self.cells)
        return (
            np.where(ends, -1, best),
            np.where(ends, 0, entry),
            np.where(ends, np.nan, force),
            np.zeros(row.size),
        )

    @cached_property
    def expected(self) -> float:
        """Expected penalty from the last row and the last column, $, by forward recursion."""
        return expected(self, float(self.heights[-1]), float(self.times[-1]))


def _printable(force: Floats) -> Floats:
    """Forces with four digits, rounded down: within all upper limits."""
    unit = 10.0 ** (np.floor(np.log10(force)) - 3)
    return np.asarray(np.round(np.floor(force / unit + _ROUNDING) * unit, 6))


def expected(policy: sdp.Policy, height: float, time_left: float) -> float:
    """Return the expected penalty of following a policy from a height (mm) and a time left (s), $."""
    nodes = nodes_of(policy.layout.axes[0].high)
    mean: float = policy.distribution(nodes=nodes, height=height, time_left=time_left).mean
    return mean


def placed_heights(policy: sdp.Policy, times: Floats, high: float, count: int, share: float) -> Floats:
    """Return `count` heights up to `high`, mm, between which log(force) changes about equally.

    `share` is the weight of a change of the duration.
    """
    tried = np.geomspace(_LOWEST * high, high, _CANDIDATES)
    height, left = np.meshgrid(tried, times, indexing="ij")
    place = policy.locate({"height": height, "time_left": left})
    best, _, force, _ = (each.reshape(place.shape) for each in policy.act(place))
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.nan_to_num(np.abs(np.diff(np.log(force), axis=0)), nan=0.0, posinf=0.0)
    change = (steps + share * (np.diff(best, axis=0) != 0)).mean(axis=1)
    passed = np.r_[0.0, np.cumsum(change + 1e-6)]  # 1e-6: rises strictly
    found = np.interp(np.linspace(0.0, passed[-1], count), passed, tried)
    return np.unique([*(float(f"{height:.3g}") for height in found[:-1]), high])
