"""Slices of a table by stage, to the deadline and beyond it (late side), and the charge on being late."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.coordinates import Stages

ROUNDING = 1e-9  # chosen: share of a cell or stage that counts as rounding; larger hides real offsets


class CountdownArrival(NamedTuple):
    """End of a move: slice of the table, late charge missing in its values, late charge there, stage."""

    row: int
    lacks: float
    late: float
    stage: int | None


@dataclass(frozen=True)
class Countdown:
    """Map of stages to slices. `first` is the stage of the first slice.

    With `has_base` the first slice ("base") serves all stages up to its own; its values lack the late charge.
    """

    step: float
    charge: Any
    first: int = 0
    has_base: bool = False
    endless: bool = False

    @classmethod
    def of(cls, stages: Any, first: int = 0) -> "Countdown":
        """Read the stages of a problem."""
        return (
            cls(stages.step, stages.late, first)
            if isinstance(stages, Stages)
            else cls(0.0, None, endless=True)
        )

    @property
    def lowest(self) -> int:
        """First stage with a slice of its own."""
        return self.first + (1 if self.has_base else 0)

    def time(self, row: Any) -> Any:
        """Stage coordinate of a slice."""
        return (row + self.first) * self.step

    def late(self, time: Any) -> Floats:
        """Late charge at stage coordinates."""
        return (
            np.zeros(np.shape(time))
            if self.charge is None
            else np.asarray(self.charge(np.maximum(-np.asarray(time), 0.0)))
        )

    def row(self, stage: Any) -> Any:
        """Slice that serves a stage."""
        return np.zeros(np.shape(stage), np.int64) if self.endless else np.maximum(stage - self.first, 0)

    def in_base(self, row: Any) -> Any:
        """Whether a slice is the base."""
        return (row == 0) & self.has_base

    def begin(self, row: int, time: float) -> tuple[int, float]:
        """Return the stage of a state of slice `row`, and its time beyond it (0 unless late in the base)."""
        if self.endless:
            return 0, 0.0
        if not self.in_base(row):
            return row + self.first, 0.0
        stage = int(np.floor(time / self.step + ROUNDING))
        return stage, float(max(0.0, time - stage * self.step))

    def arrival(self, row: int, duration: int, begin: float | None = None) -> CountdownArrival | None:
        """Return the end of a move from slice `row`; None before a table without base.

        `begin`: stage coordinate of its start in the base. None: the lowest stage out of it.
        """
        if self.endless:
            return CountdownArrival(0, 0.0, 0.0, None)
        end, base = row - duration, 1 if self.has_base else 0
        if end >= base and not self.in_base(row):
            return CountdownArrival(end, 0.0, float(self.late(self.time(end))), end + self.first)
        if not self.has_base:
            return None
        used = self.lowest * self.step if begin is None else begin
        late = float(self.late((used if row == 0 else self.time(row)) - duration * self.step))
        return CountdownArrival(0, late, late, end + self.first)
