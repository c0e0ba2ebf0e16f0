"""Recipe of a planned sequence: its look-up, the table, states that reach every cell."""

from functools import partial
from math import nan
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Role, Signal
from sdpgrind.sdp.kernels import stage_told
from sdpgrind.weldbead.sequence._action import SequenceAction
from sdpgrind.weldbead.sequence._look_up_kernels import next_pass_at

_OUTPUTS = {
    "duration": Signal("s", "time of the next pass; 0 with the status stop"),
    "feed_rate": Signal("mm/s", "feed along the bead of the next pass; NaN with the status stop"),
    "normal_force": Signal("N", "force of the disc onto the bead of the next pass; NaN with the status stop"),
    "gap": Signal("$", "extra expected penalty of the best other duration, or of stopping; infinite where"
                  " there is none"),
}  # fmt: skip
_TABLES = {
    "frame": "first row: length of a stage (s), stages, first and lowest slice, whether late ones have one,"
    " endless; second row, height: origin, spacing (mm), logarithmic, ends (mm), what is done beyond them",
    "shape": "nodes of the height",
    "best": "move at each node: slice, mode, height; < 0: stop",
    "entry": "place of the force in the list of the move, at each node",
    "control": "force at each node, N",
    "gap": "penalty of the best other move less that of the best, at each node, $",
    "at": "number of the cell in which the move changes, or -1: slice, mode, cell of the height",
    "start": "first line of each such cell, and the end",
    "lines": "cost of a move at both ends of such a cell ($), its force at both (N), move, place in its list",
    "durations": "duration of each move, s",
    "feeds": "feed of each move, mm/s",
}
_ROUNDS = 2  # chosen: states in each cell in which the action changes


def recipe_of(policy: Any, durations: list[float], feeds: list[float]) -> Recipe:
    """Return the recipe of a `SequencePolicy`, in mm, s, N and $."""
    single = _check(policy)
    law = (*single.arrays, np.array(durations), np.array(feeds))
    return Recipe(
        "bead",
        next_pass_at,
        _inputs(policy),
        _OUTPUTS,
        law=law,
        tables=_TABLES,
        status=("next pass", "stop"),
        equations="Brown (2012): expected penalty-to-go by dynamic programming; the action of the table.",
        vectors=_States(policy, single.arrays[6]).chains,
        kind="SequencePolicy",
        role=Role(
            commands={"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "stop": ""},
            answer=_command,
            report=partial(_expected, policy),
            reports={"penalty": "$", "mean_cut": "mm", "gap": "$"},
            stands_for="SequenceController",
            tier="sequence",
            job=policy.problem.job,
        ),
    )


def _inputs(policy: Any) -> dict[str, Signal]:
    """Return height (mm) and time (s) of states that have an answer; below the table grinding stops."""
    high, (times, late) = float(policy.table.layout.axes[0].high), stage_told(policy.table)
    height = "mean height of the bead above the base, mm to be ground off; < 0: ground into the base"
    left = "; ".join(filter(None, ["time to the deadline", late]))
    return {
        "height": Signal("mm", height, high=high, spread=0.5 * high),
        "time_left": Signal("s", left, *times, spread=0.5 * float(policy.problem.horizon)),
    }


def _check(policy: Any) -> Any:
    """Return the look-up of single states; refuse what it does not know by the condition that fails."""
    single = policy.table.single
    rules = {
        "a policy of a table in height and time left": single is None,
        "a policy without a charge for the finish": policy.problem.finish_charge is not None,
        "a policy whose charge for the height is straight between nodes (sdp.Linear, sdp.Constant): that of"
        " this one is bent within cells in which grinding may stop": policy.table.bent.any(),
    }
    for rule, failed in rules.items():
        if failed:
            raise checks.refuse("thing", rule, policy)
    return single


def _command(status: int, found: dict[str, float]) -> dict[str, Any]:
    """Return the command of a sequence controller."""
    if status == 1:
        return {"stop": 1.0}
    return {name: found[name] for name in ("duration", "feed_rate", "normal_force")} | {"stop": 0.0}


def _expected(policy: Any, status: int, state: dict[str, float], found: dict[str, float]) -> dict[str, float]:
    """Return what a `SequenceController` reports: the plan's expectation ($, mm) of the action of the C."""
    gap = found.get("gap", nan)
    asked = found["duration"], found["feed_rate"], found["normal_force"]
    action = SequenceAction(status == 1, asked[0], asked[1], asked[2], gap, policy.problem)
    cut = 0.0 if action.stop else float(action.mean_cut)
    return {"penalty": float(policy.value(**state)), "mean_cut": cut, "gap": gap}


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
