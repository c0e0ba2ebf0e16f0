"""Inputs and controls of a policy as signals of an export: units, ranges, words."""

from typing import Any

from sdpgrind.codegen import Signal
from sdpgrind.sdp._policy.stage_told import stage_told
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.coordinates import Axis

_ANY = 1e9  # chosen: in the unit of an axis; beyond what any is used for
_UNKNOWN = "unit of the plan"  # derived: `sdp.Move` has none for its controls
_VARIED = 0.25  # chosen: share of an input's extent by which the self-test varies it
_EDGES = {"hold": "the end counts", "refuse": "refused (-1)", "stop": "the process ends"}
_LISTED = 6  # chosen: listed values that a meaning names; of more the ends


def extents_of(policy: Solution) -> dict[str, tuple[float, float]]:
    """Return ends of the table, in its units: mode, if there are several, stage coordinate, axes."""
    layout, count = policy.layout, policy.countdown
    modes = {"mode": (0.0, float(len(layout.modes) - 1))} if len(layout.modes) > 1 else {}
    ends = count.lowest * layout.step, layout.count * layout.step
    stage = {} if layout.endless else {layout.stage_name: ends}
    return {**modes, **stage, **{axis.name: (axis.low, axis.high) for axis in layout.axes}}


def inputs_of(policy: Solution) -> dict[str, Signal]:
    """Return the inputs, in their units; within their ranges the look-up refuses what has no answer."""
    layout, extents = policy.layout, extents_of(policy)
    (earliest, first), late = stage_told(policy)
    modes = ", ".join(f"{k} {name}" for k, name in enumerate(layout.modes))
    count = f"countdown to the deadline{late and '; '}{late}"
    low, high = extents.get(layout.stage_name, (0.0, 0.0))
    found = {
        "mode": Signal("", f"number of the mode: {modes}", 0.0, len(layout.modes) - 1.0, spread=0.0),
        layout.stage_name: Signal(layout.stage_unit, count, earliest, first, spread=_VARIED * (high - low)),
        **{axis.name: _axis(axis) for axis in layout.axes},
    }
    return {name: found[name] for name in extents}


def controls_of(policy: Any) -> dict[str, Signal]:
    """Return the controls, of which no unit is known."""
    moves, problem = policy.layout.moves, policy.problem
    levels = {} if problem is None else {move.name: move.levels for move in problem.moves}
    none = "NaN where the action has no such control, as a stop"
    return {name: Signal(_UNKNOWN, f"{_control(moves, levels, name)}; {none}") for name in policy._controls}


def _axis(axis: Axis) -> Signal:
    told = f"{axis.name.replace('_', ' ')}; below {axis.low:g} {_edge(axis.below)}"
    low = axis.low if axis.below == "refuse" else -_ANY
    high = axis.high if axis.above == "refuse" else _ANY
    told += f", above {axis.high:g} {_edge(axis.above)}"
    return Signal(axis.unit, told, low, high, spread=_VARIED * (axis.high - axis.low))


def _edge(edge: Any) -> str:
    return _EDGES[edge] if isinstance(edge, str) else f"and there the process ends, {edge:g} $"


def _control(moves: Any, levels: dict[str, Any], name: str) -> str:
    """Values of a control in each move that has it."""
    told = []
    for move in moves:
        if move.level == name:
            level = levels.get(move.name)
            told.append(f"{move.name}: {f'{level.low:g} to {level.high:g}' if level else 'continuous'}")
        told += [f"{move.name}: {_listed(values)}" for known, values in move.lists if known == name]
    return f"control of {'; '.join(told)}"


def _listed(values: tuple[float, ...]) -> str:
    values = tuple(sorted(set(values)))
    if len(values) > _LISTED:
        return f"{len(values)} values from {values[0]:g} to {values[-1]:g}"
    return ", ".join(f"{one:g}" for one in values)
