"""Verb `plan`: sequence of pushes by stochastic dynamic programming over offset and friction belief."""

from concurrent.futures import Executor
from typing import Any

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.as_sdp import (
    FRACTIONS,
    Size,
    StrategyGround,
    finish_offset,
    moves,
    offset_axis,
    resolved,
)
from centering.cycle._strategy.cycle_times import cycle_timing, table_speeds
from centering.cycle._strategy.outcomes import PushKind, default_kinds, simulated
from centering.cycle._strategy.strategy import Strategy
from centering.cycle._strategy.timing import SETTLED
from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress, ProgressOption, portion, reporting
from sdpgrind.base.warned import warn

GIVEN_UP = 60.0  # chosen: charge of a part that is not centred after the greatest number of pushes, s
_SHARES = (0.0, 0.6, 0.8, 1.0)  # chosen: of the work: pushes simulated, the settled belief, the first pushes


@reporting
def plan(
    problem: CenteringProblem,
    *,
    spindle_speed: str | float = "scheduled",
    executor: Executor | None = None,
    progress: ProgressOption = None,
) -> Strategy:
    """Return the sequence of pushes that centres a part in the least expected time.

    Parameters
    ----------
    problem : CenteringProblem
        Part, machine, scatter of the pushes, tolerance.
    spindle_speed : "scheduled" or float
        Table speed, rad/s: the fastest allowed at each offset, or a fixed one, reduced where the offset
        demands.
    executor : concurrent.futures.Executor, optional
        Runs the simulations; the result does not depend on it.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Strategy
        Expected times (s) and pushes for every offset, believed friction and number of pushes seen.

    Raises
    ------
    ValueError
        `spindle_speed` is not > 0, or above `CenteringLimits.spindle_speed_max`.

    Warns
    -----
    UserWarning
        The tolerance is below half the stick-slip jump.

    Examples
    --------
    >>> from centering._problem.presets import preset
    >>> strategy = plan(preset("printed").replace(mass=0.8))  # doctest: +SKIP
    >>> strategy.push(offset=1.0)  # doctest: +SKIP
    """
    checks.kind("problem", problem, CenteringProblem, ", as preset(...) gives it")
    if isinstance(spindle_speed, str):
        checks.one_of("spindle_speed", spindle_speed, ("scheduled",))
    else:
        checks.at_most(
            "spindle_speed", spindle_speed, "spindle_speed_max", problem.limits.spindle_speed_max, "rad/s"
        )
    if problem.quantum_note:
        warn(problem.quantum_note)
    assert callable(progress)  # made by the decorator
    kinds = default_kinds(problem.limits.push_speed_max)
    return solved(prepared(problem, spindle_speed, kinds, Size(), executor, progress), executor, progress)


def prepared(
    problem: CenteringProblem,
    spindle_speed: str | float,
    kinds: tuple[PushKind, ...],
    size: Size,
    executor: Executor | None,
    tell: Progress,
) -> StrategyGround:
    """Simulate the kinds of push and fix the table speeds."""
    size, axis = resolved(problem, size), offset_axis(problem, size.offsets)
    outcomes = simulated(
        problem.model,
        kinds,
        longest=1.3 * axis.high,
        acceleration=problem.limits.acceleration_max,
        executor=executor,
        tell=portion(tell, _SHARES[0], _SHARES[1]),
    )
    offsets = np.geomspace(axis.low, axis.high, axis.nodes)
    speeds = table_speeds(problem, offsets, spindle_speed)
    timing = cycle_timing(problem, outcomes, offsets, speeds)
    return StrategyGround(problem, outcomes, timing, speeds, finish_offset(problem), size)


def solved(ground: StrategyGround, executor: Executor | None, tell: Progress) -> Strategy:
    """Compute the strategy: first with a settled belief, then backward to the first push."""
    first = min(SETTLED, ground.problem.pushes_max - 1)
    further = ground.problem.pushes_max - first
    given_up = sdp.Stop("given up", _given_up, allowed=_no_more)
    named = _named(portion(tell, _SHARES[1], _SHARES[2]), "the pushes after the first ones")
    policies = [_staged(ground, first, further, given_up, False, executor, named)]
    if first:
        seen = sdp.Stop("seen", _Settled(policies[0]), allowed=_no_more)
        named = _named(portion(tell, _SHARES[2], _SHARES[3]), "the first pushes")
        policies.append(_staged(ground, first, first, seen, True, executor, named))
    return Strategy(ground.problem, ground.outcomes, ground.speeds, _joined(ground.size, *policies))


def _staged(
    ground: StrategyGround,
    settled: int,
    stages: int,
    end: sdp.Stop,
    timed: bool,
    executor: Executor | None,
    tell: Progress,
) -> sdp.Policy:
    """Policy of so many pushes until an end; the belief settles after `settled` of them."""
    count = sdp.Stages(stages, 1.0, "unseen", "")
    problem = sdp.Problem(ground.axes, moves(ground, settled, timed), [end], count)
    return sdp.plan(problem, executor=executor, progress=tell)


def _named(tell: Progress, name: str) -> Progress:
    """Progress that says `name` before each text."""
    return lambda share, text: tell(share, f"{name}: {text}")


class _Settled:
    """Expected time (s) at the nodes with the settled belief: terminal cost of the first pushes."""

    def __init__(self, policy: sdp.Policy) -> None:
        self.policy = policy

    def __call__(self, s: Any) -> Floats:
        return np.asarray(self.policy.table.value[-1, 0] + 0.0 * s.offset)


def _given_up(s: Any) -> Floats:
    """Charge (s) of an abandoned part."""
    return np.asarray(GIVEN_UP + 0.0 * s.offset)


def _no_more(s: Any) -> Any:
    return s.unseen < 0.5


def _joined(
    size: Size, settled: sdp.Policy, first: sdp.Policy | None = None
) -> tuple[Floats, Floats, Floats]:
    """Value, kind and share [pushes seen, offset, friction] of both policies."""
    tables = [(settled.table, -1)]
    if first is not None:
        stages = range(first.table.value.shape[0] - 1, 0, -1)
        tables = [*((first.table, stage) for stage in stages), *tables]
    value, kind, entry = (
        np.stack([getattr(table, name)[row, 0] for table, row in tables])
        for name in ("value", "best", "entry")
    )
    shape = (len(tables), *size)
    return value.reshape(shape), kind.reshape(shape).astype(np.int64), FRACTIONS[entry].reshape(shape)
