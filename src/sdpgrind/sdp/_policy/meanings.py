"""What states and controls of a policy are, in words for an export."""

from typing import Any

from sdpgrind.sdp._policy.stage_told import stage_told
from sdpgrind.sdp._problem.coordinates import Axis

_EDGES = {"hold": "the end counts", "refuse": "refused (-1)", "stop": "the process ends"}
_LISTED = 6  # chosen: listed values that a meaning names; of more the ends


def meanings_of(policy: Any, inputs: list[str], controls: list[str]) -> dict[str, str]:
    """Return what the `inputs` (in units of axes and stages) and `controls` of a policy are."""
    layout, problem = policy.layout, policy.problem
    found = {axis.name: _axis(axis) for axis in layout.axes}
    late = stage_told(policy)[1]
    found[layout.stage_name] = f"countdown to the deadline{late and '; '}{late}"
    found["mode"] = "number of the mode: " + ", ".join(f"{k} {name}" for k, name in enumerate(layout.modes))
    levels = {} if problem is None else {move.name: move.levels for move in problem.moves}
    return {name: found[name] for name in inputs} | {
        name: f"{_control(layout.moves, levels, name)}; NaN where the action has no such control, as a stop"
        for name in controls
    }


def _axis(axis: Axis) -> str:
    name = axis.name.replace("_", " ")
    return f"{name}; below {axis.low:g} {_edge(axis.below)}, above {axis.high:g} {_edge(axis.above)}"


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
