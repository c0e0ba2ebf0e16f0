"""Waves along a bead, which passes level as far as their limit of force lets them.

A pass of mean depth m moves the tip along a level that takes the volume of m, Brown (1988), (6.2b): where
the bead is w(x) above its mean, max(s + w, 0), with s such that this is m on average. The limit of force
reaches the depth D: clip(s + w, 0, D) is taken, and what is left of the waves meets the next pass.
"""

from collections.abc import Mapping
from typing import Self

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess

_PLACES = 60  # chosen: places of one wave; the mean of what they lose errs by less than 1e-3 of it


class Waves:
    """Heights (mm) of a bead about their mean, pass by pass."""

    def __init__(self, height: Floats) -> None:
        self._height = height

    @classmethod
    def of(cls, waviness: float) -> Self:
        """Waves of sine with a standard deviation, mm; 0: a level bead."""
        phase = 2 * np.pi * (np.arange(_PLACES) + 0.5) / _PLACES
        return cls(np.sqrt(2.0) * waviness * np.sin(phase) if waviness > 0 else np.zeros(1))

    def cut(self, believed: SequenceProblem, now: GrindingProcess, command: Mapping[str, float]) -> float:
        """Take a commanded pass (N, mm/s, s); return its mean depth, mm, and keep what is left.

        `believed`: problem for whose mean process the pass is planned; `now`: the process as it is in it.
        """
        force, feed = command["normal_force"], command["feed_rate"]
        taken = float(now.mean_cut(force, feed))
        if self._height.size == 1:
            return taken
        planner = believed.depths.expected(believed.model)
        most = believed.force_interval(command["duration"])[1]
        asked, limit = (float(planner.mean_cut(each, feed)) for each in (force, most))
        share = taken / asked if asked > 0 else 0.0
        depth = share * np.clip(_level(self._height, asked) + self._height, 0.0, limit)
        self._height = self._height - (depth - depth.mean())
        return float(depth.mean())


def _level(height: Floats, asked: float) -> float:
    """Depth s for which max(s + height, 0) is `asked` on average, mm."""
    high = np.sort(height)[::-1]
    count = np.arange(1, high.size + 1)
    levels = (asked * high.size - np.cumsum(high)) / count  # the `count` highest places are cut
    cut = levels + high > 0
    return float(levels[np.flatnonzero(cut)[-1]]) if cut.any() else -float(high[0])
