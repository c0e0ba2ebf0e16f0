"""Recipe of a strategy: the push at a state, its tables, and states for the self-test."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from centering.cycle._strategy.cycle_times import WORTH
from centering.cycle._strategy.exported_kernels import exported_push
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal

_OUTPUTS = {
    "aim": Signal("mm", "mean travel of the part that is intended; 0 where it is centred"),
    "stroke": Signal("mm", "greatest travel of the tip after the first touch; 0 where the part is centred"),
    "push_speed": Signal("mm/s", "greatest speed of the tip"),
    "gentle": Signal("", "1 where the push has the gentle profile, else 0"),
    "retract": Signal("", "1 where the tip retracts at once, else 0"),
    "spindle_speed": Signal("rad/s", "speed of the table"),
    "expected_time": Signal("s", "expected time from the touch of this push to the end"),
    "kind": Signal("", "number of the kind of push in the strategy; -1 where the part is centred"),
}
_TABLES = {
    "policy_0": "kind of the best push: pushes seen, offset, friction scale",
    "policy_1": "mean travel intended over offset, at the same nodes",
    "value": "expected time (s) to the end, at the same nodes",
    "kinds": "of each kind of push: speed (mm/s), gentle, retracts at once",
    "outcomes_1": "mean travel (mm): kind of push, stroke, friction scale",
    "outcomes_2": "number of the greatest stroke of each kind",
    "speeds": "speed of the table (rad/s) at the nodes of the offset",
}
_FRICTION_MAX, _EVIDENCE_MAX = 1e3, 1e6  # chosen: beyond any belief
_CHAIN = 64  # chosen: states of a chain of the self-test
_FAR = 0.2  # chosen: share of beliefs far from 1
# chosen: states for which no stroke may be long enough: greatest offset, friction beyond the tables
_LONG = 5
_NEAR = 1e-3  # chosen: share of the greatest offset by which the self-test varies it


def recipe_of(strategy: Any, tables: tuple[Any, ...], greatest: float) -> Recipe:
    """Return the recipe of a strategy.

    Parameters
    ----------
    strategy : Strategy
        The strategy.
    tables : tuple
        Value, kind, share, outcomes, speeds and axes, as the strategy looks them up (mm, s, rad).
    greatest : float
        Greatest offset, mm.
    """
    value, kind, share, outcomes, speeds, axes = tables
    kinds = [(one.push_speed, float(one.shape == "gentle"), float(one.retract)) for one in strategy.kinds]
    narrow = kind.astype(np.int8 if len(kinds) <= np.iinfo(np.int8).max else np.int64)
    unused = np.zeros((1, 1, 1))  # travel of single pushes: the choice is by the mean
    return Recipe(
        "push",
        exported_push,
        _inputs(greatest),
        _OUTPUTS,
        law=(
            (narrow, share), value, np.array(kinds), (unused, *outcomes[1:]), speeds, axes,
            float(strategy.finish), WORTH,
        ),
        tables=_TABLES,
        status=("push", "centred"),
        equations="least expected time by dynamic programming; stroke of the wanted mean travel",
        vectors=_PushStates(float(strategy.finish), greatest, value.shape[0], axes).chains,
        kind="Strategy",
    )  # fmt: skip


def _inputs(greatest: float) -> dict[str, Signal]:
    """Return the state of a part, offset at most the greatest (mm), in the order of `exported_push`."""
    friction = "mean of the believed friction scale: friction of the part over that of the model"
    evidence = "evidence of that belief, or the number of pushes so far"
    offset = "measured offset of the part from the axis of the spindle"
    return {
        "offset": Signal("mm", offset, 0.0, greatest, spread=_NEAR * greatest),
        "friction": Signal("", friction, 0.0, _FRICTION_MAX, default=1.0, spread=0.1),
        "evidence": Signal("", evidence, 0.0, _EVIDENCE_MAX, default=0.0, spread=0.3),
    }


@dataclass(frozen=True)
class _PushStates:
    """States: offsets from centred to the greatest, beliefs near 1 and far from it, few pushes and many.

    And one about each node of the tables, whose numbers few other states read.
    """

    finish: float
    greatest: float
    modes: int
    axes: tuple[float, ...]

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` states (mm, 1, 1) in chains."""
        return [*(self._one(rng) for _ in range(max(count // _CHAIN, 1))), self._nodes(rng)]

    def _nodes(self, rng: np.random.Generator) -> Floats:
        """States about all nodes: pushes seen, offset, friction scale."""
        log_low, log_step, offsets, low, step, frictions = self.axes
        nodes = np.indices((self.modes, int(offsets), int(frictions))).reshape(3, -1)
        pushes, place, scale = nodes + rng.uniform(-0.5, 0.5, nodes.shape)
        offset = np.clip(np.exp(log_low + log_step * place), self.finish, self.greatest)
        return np.column_stack([offset, np.maximum(low + step * scale, 0.0), WORTH * np.maximum(pushes, 0.0)])

    def _one(self, rng: np.random.Generator) -> Floats:
        offset = np.exp(rng.uniform(np.log(0.5 * self.finish), np.log(self.greatest), _CHAIN))
        far = rng.random(_CHAIN) < _FAR
        friction = np.where(far, rng.uniform(0.2, 3.0, _CHAIN), rng.normal(1.0, 0.1, _CHAIN))
        offset[:_LONG], friction[:_LONG] = self.greatest, 3.0
        return np.column_stack([offset, np.maximum(friction, 0.0), rng.uniform(0.0, self.modes, _CHAIN)])
