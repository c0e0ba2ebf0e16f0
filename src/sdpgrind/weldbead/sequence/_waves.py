"""Waves along a bead, which passes level as far as their limit of force lets them.

A pass of mean depth m is asked for m + w(x) where the bead is w(x) above its mean; the limit reaches the
depth D, so clip(m + w, 0, D) is taken, and what is left of the waves meets the next pass.
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
        depth = share * np.clip(asked + self._height, 0.0, limit)
        self._height = self._height - (depth - depth.mean())
        return float(depth.mean())
