"""What a roughness model does not know of what is finished."""

from collections.abc import Sequence
from typing import Any

_KNOWN = "zigzag"  # a pattern that each roughness model knows


def unknown(model: Any, pattern: str, tools: Sequence[float], forces: Sequence[float]) -> str:
    """Return what of pattern, tools (mm) and forces (N) a roughness model does not know; empty: nothing."""
    (tool, _), (force, _) = known = model.tool_diameter_range, model.normal_force_range
    found = [] if model.covers(pattern, tool, force) else [f"pattern {pattern}"]
    strange = (
        [each for each in tools if not model.covers(_KNOWN, each, force)],
        [each for each in forces if not model.covers(_KNOWN, tool, each)],
    )
    for name, unit, values, (low, high) in zip(("tool", "force"), ("mm", "N"), strange, known, strict=True):
        if values:
            each = " or ".join(f"{value:g}" for value in values)
            found.append(f"a {name} of {each} {unit} ({low:g} to {high:g} {unit})")
    return " or ".join(found)
