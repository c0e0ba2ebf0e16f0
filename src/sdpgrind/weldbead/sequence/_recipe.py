"""What is exported of a planned sequence: its look-up, the table, states that reach every cell."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe
from sdpgrind.weldbead.sequence._look_up_kernels import next_pass_at

_OUTPUTS = {"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "gap": "$"}
_ROUNDS = 2  # chosen: states in each cell in which the action changes


def recipe_of(policy: Any, durations: list[float], feeds: list[float]) -> Recipe:
    """Return what is exported of a `SequencePolicy`, in mm, s, N and $."""
    single, problem = policy.table.single, policy.problem
    if single is None or problem.finish_charge is not None or policy.table.bent.any():
        raise checks.refuse(
            "thing",
            "a policy of a table in height and time left, without a charge for the finish or for the height"
            " that changes within a cell",
            repr(policy),
        )
    law = (*single.arrays, np.array(durations), np.array(feeds))
    return Recipe(
        "bead",
        next_pass_at,
        {"height": "mm", "time_left": "s"},
        _OUTPUTS,
        law=law,
        status=("next pass", "stop"),
        equations="Brown (2012): expected penalty-to-go by dynamic programming; the action of the table.",
        vectors=_States(policy, single.arrays[6]).chains,
        spread=(0.5 * float(policy.table.layout.axes[0].high), 0.5 * float(problem.horizon)),
        kind="SequencePolicy",
        job=problem.job,
        answer=_command,
        commands={"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "stop": ""},
    )


def _command(status: int, found: dict[str, float]) -> dict[str, Any]:
    """Return the command of a sequence controller."""
    if status == 1:
        return {"stop": 1.0}
    return {name: found[name] for name in ("duration", "feed_rate", "normal_force")} | {"stop": 0.0}


class _States:
    """States of the table: nodes, cells in which the action changes, between nodes, outside."""

    def __init__(self, policy: Any, at: Any) -> None:
        self._heights, self._times = policy.states()
        self._lowest = -policy.table.countdown.first * policy.problem.stage
        self._at = at[:, 0, :]

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` states (mm, s), and each cell in which the action changes."""
        high, late = self._heights[-1], self._times[-1]
        low = self._heights[0]
        heights = rng.uniform(low - 0.05 * (high - low), 1.05 * high, count)
        times = rng.uniform(self._lowest - 1.0, 1.05 * late, count)
        nodes = np.column_stack([rng.choice(self._heights, count), rng.choice(self._times, count)])
        ends = [(a, b) for a in (low, high, 0.0, -0.1, 1.1 * high) for b in (0.0, late, -1.0, 1.1 * late)]
        changed = self._changing(rng)
        return [np.vstack([np.array(ends), np.column_stack([heights, times]), nodes, changed])]

    def _changing(self, rng: np.random.Generator) -> Floats:
        """Return states within the cells that have lines."""
        rows, cells = np.nonzero(self._at >= 0)
        rows, cells = np.tile(rows, _ROUNDS), np.tile(cells, _ROUNDS)
        width = np.diff(self._heights)
        heights = self._heights[cells] + rng.uniform(0.0, 1.0, cells.size) * width[cells]
        step = self._times[1] - self._times[0]
        return np.column_stack([heights, self._lowest + (rows + rng.uniform(0.0, 1.0, rows.size)) * step])
