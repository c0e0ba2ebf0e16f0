"""Budget of a refinement: time and memory, predicted before each halving of the cells.

The clock decides only which grid is the last: a budget changes no value of any grid.
"""

from dataclasses import dataclass, field
from time import monotonic

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.budget import afford
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._transitions.sampled import Sampled
from sdpgrind.sdp._transitions.shift import Shift

LARGEST = 2.0 * 2**30  # chosen: bytes of tables without a given limit; more does not fit a small machine
# measured: largest memory of a solve over its tables of shifts, 1.4 to 2.1 on the weld-bead presets
COPIES = 2.2
FIXED = 2e6  # measured: bytes of a solve beyond that on small grids, 0.5 to 1.7 MB on 101 and 201 nodes
CHECK = 1.3  # measured: time of a grid with the check of its look-ups over that without, at most


@dataclass
class Resources:
    """Limits of a refinement (s, bytes; None: no limit), and the times of its grids, s."""

    time_limit: float | None = None
    memory_limit: float | None = None
    _last: float = field(default_factory=monotonic)
    _times: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, time_limit: float | None, memory_limit: float | None) -> "Resources":
        """Check the limits; the time begins now."""
        if time_limit is not None:
            checks.positive("time_limit", time_limit, "s")
        if memory_limit is not None:
            checks.positive("memory_limit", memory_limit, "bytes")
        return cls(time_limit, memory_limit)

    @property
    def given(self) -> bool:
        """Whether there is a limit."""
        return self.time_limit is not None or self.memory_limit is not None

    @property
    def largest(self) -> float:
        """Most bytes of a solve."""
        return LARGEST if self.memory_limit is None else self.memory_limit

    @property
    def told(self) -> str:
        """The limits in words."""
        time = "" if self.time_limit is None else f"{self.time_limit:g} s and "
        return f"{time}{self.largest / 2**30:.3g} GiB of tables"

    def bytes(self, problem: Problem, refine: int) -> float:
        """Return the bytes that the memory limit counts, of a grid with its cells cut in `refine`."""
        tables = table_bytes(problem, refine)
        if self.memory_limit is None:
            return tables
        return COPIES * tables + _sweep_bytes(problem, refine) + FIXED

    def fits(self, problem: Problem, refine: int) -> bool:
        """Whether a grid with its cells cut in `refine` fits into the memory limit, if there is one."""
        return self.memory_limit is None or self.bytes(problem, refine) <= self.memory_limit

    def check(self, problem: Problem) -> None:
        """Refuse a memory limit (bytes) that is below the first grid."""
        if not self.fits(problem, 1):
            least, nodes = self.bytes(problem, 1), _nodes(problem, 1)
            rule = f">= {least:.3g}, which the first grid of {nodes:g} nodes is predicted to take"
            raise checks.refuse("memory_limit", rule, self.memory_limit, "bytes")

    def solved(self) -> None:
        """Note that a grid is done."""
        now = monotonic()
        self._times.append(now - self._last)
        self._last = now

    def out_of_time(self, problem: Problem) -> bool:
        """Whether the next grid would end too late: by the last time and its growth, 4 to 8 on one axis."""
        if self.time_limit is None:
            return False
        least = 2.0 ** (1 + len(problem.axes))
        growth = self._times[-1] / max(self._times[-2], 1e-6) if len(self._times) > 1 else least
        noisy = 3.0 if any(isinstance(move.to, Sampled) for move in problem.moves) else 1.0
        predicted = CHECK * noisy * self._times[-1] * min(max(growth, least), 2 * least)
        return sum(self._times) + predicted > self.time_limit


def afford_grid(problem: Problem) -> None:
    """Refuse a problem whose own grid the memory of this computer does not hold."""
    nodes = _nodes(problem, 1)
    size = COPIES * table_bytes(problem, 1) + _sweep_bytes(problem, 1)
    afford(f"a grid of {nodes:.4g} nodes", size, "fewer nodes, moves or stages need less")


def table_bytes(problem: Problem, refine: int) -> float:
    """Return the bytes of the tables of shifts: weight and charge of every row, lag and other node."""
    rows = (m.choices * (m.levels.count if m.levels else 1) for m in problem.moves if isinstance(m.to, Shift))
    return 16.0 * _nodes(problem, refine) * sum(rows)


def _sweep_bytes(problem: Problem, refine: int) -> float:
    """Bytes of the costs of all moves, kept for their durations, and of the stages, twice with their copy."""
    stages, durations = problem.stages, [move.duration for move in problem.moves]
    count = stages.count + 1 if isinstance(stages, Stages) else 1
    slots = len(durations) * (max(durations) + 1)
    return _nodes(problem, refine) * len(problem.modes) * (20.0 * slots + 64.0 * count)


def _nodes(problem: Problem, refine: int) -> float:
    return float(np.prod([(axis.nodes - 1) * refine + 1 for axis in problem.axes], dtype=float))
