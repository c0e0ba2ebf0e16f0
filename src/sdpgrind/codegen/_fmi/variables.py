"""Variables of an FMU: inputs, flags of readings, outputs and status, each with its value reference."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sdpgrind.base import checks
from sdpgrind.codegen._recipe import Recipe, Signal

STATUS = "status"
_FLAG = "_valid"
_READ = "_measured"  # chosen: ending of an input that is named as an output


@dataclass(frozen=True)
class UnitVariable:
    """Variable of an FMU.

    Parameters
    ----------
    type : str
        Element of the standard: Real, Boolean or Enumeration.
    """

    name: str
    type: str
    causality: str
    reference: int
    description: str
    unit: str = ""
    limits: tuple[float, float] = (-math.inf, math.inf)


def variables_of(recipe: Recipe) -> list[UnitVariable]:
    """Return the variables of a recipe; refuse names that occur twice."""
    found = [*_inputs(recipe), *_outputs(recipe)]
    checks.unique(
        "names of inputs, their flags (NAME_valid), outputs and status", [one.name for one in found]
    )
    return found


def _inputs(recipe: Recipe) -> Iterator[UnitVariable]:
    for k, (name, one) in enumerate(recipe.inputs.items()):
        known = f"{name}{_READ}" if name in recipe.outputs else name
        told = _meaning(name, one) + (f"; no reading where {known}{_FLAG} is false" if one.missing else "")
        yield UnitVariable(known, "Real", "input", k, told, one.unit, recipe.limits[k])
        if one.missing:
            told = f"whether {known} is a reading"
            yield UnitVariable(f"{known}{_FLAG}", "Boolean", "input", first_flag(recipe) + k, told)


def _outputs(recipe: Recipe) -> Iterator[UnitVariable]:
    for k, (name, one) in enumerate(recipe.outputs.items()):
        told = f"{_meaning(name, one)}; 0 before the first step"
        yield UnitVariable(name, "Real", "output", len(recipe.inputs) + k, told, one.unit)
    told = "result of the last step; 0 before the first"
    yield UnitVariable(STATUS, "Enumeration", "output", status_reference(recipe), told)


def first_value(low: float, high: float) -> float:
    """Return the start of an input: 0, or the nearest value in range."""
    return min(max(0.0, low), high)


def first_flag(recipe: Recipe) -> int:
    """Return the value reference of the flag of the first input."""
    return len(recipe.inputs) + len(recipe.outputs)


def status_reference(recipe: Recipe) -> int:
    """Return the value reference of the status."""
    return first_flag(recipe) + len(recipe.inputs)


def _meaning(name: str, one: Signal) -> str:
    """Return what an input or output is, as far as that is told: else its name as words."""
    return one.meaning or name.replace("_", " ")
