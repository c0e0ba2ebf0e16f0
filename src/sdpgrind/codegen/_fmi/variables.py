"""Variables of an FMU: inputs, flags of readings, outputs and status, each with its value reference."""

from collections.abc import Iterator
from dataclasses import dataclass

from sdpgrind.base import checks
from sdpgrind.codegen._recipe import Recipe

STATUS = "status"
_FLAG = "_valid"


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


def variables_of(recipe: Recipe) -> list[UnitVariable]:
    """Return the variables of a recipe; refuse names that occur twice."""
    found = [*_inputs(recipe), *_outputs(recipe)]
    checks.unique(
        "names of inputs, their flags (NAME_valid), outputs and status", [one.name for one in found]
    )
    return found


def _inputs(recipe: Recipe) -> Iterator[UnitVariable]:
    for k, (name, unit) in enumerate(recipe.inputs.items()):
        missing = name in recipe.missing
        told = f"{words(name)}; no reading where {name}{_FLAG} is false" if missing else words(name)
        yield UnitVariable(name, "Real", "input", k, told, unit)
        if missing:
            told = f"whether {name} is a reading"
            yield UnitVariable(f"{name}{_FLAG}", "Boolean", "input", first_flag(recipe) + k, told)


def _outputs(recipe: Recipe) -> Iterator[UnitVariable]:
    for k, (name, unit) in enumerate(recipe.outputs.items()):
        yield UnitVariable(
            name, "Real", "output", len(recipe.inputs) + k, f"{words(name)}; 0 before the first step", unit
        )
    told = "result of the last step; 0 before the first"
    yield UnitVariable(STATUS, "Enumeration", "output", status_reference(recipe), told)


def first_flag(recipe: Recipe) -> int:
    """Return the value reference of the flag of the first input."""
    return len(recipe.inputs) + len(recipe.outputs)


def status_reference(recipe: Recipe) -> int:
    """Return the value reference of the status."""
    return first_flag(recipe) + len(recipe.inputs)


def words(name: str) -> str:
    """Return a name as words."""
    return name.replace("_", " ")
