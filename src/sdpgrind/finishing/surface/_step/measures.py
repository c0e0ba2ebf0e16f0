"""Units of a representation: millimetres and radians in the numbers of its geometry."""

import math
from typing import NamedTuple

from sdpgrind.finishing.surface._step.entities import StepFile, StepRow

# source: ISO 10303-41, si_prefix
PREFIXES = {
    "": 1.0, "EXA": 1e18, "PETA": 1e15, "TERA": 1e12, "GIGA": 1e9, "MEGA": 1e6, "KILO": 1e3, "HECTO": 1e2,
    "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6, "NANO": 1e-9, "PICO": 1e-12,
    "FEMTO": 1e-15, "ATTO": 1e-18,
}  # fmt: skip
MILLIMETRES = 1e3  # derived: in a metre
DEEPEST = 8  # chosen: units that are converted into one another


class StepUnits(NamedTuple):
    """A file's unit of length in mm, and of plane angles in rad, NaN where it names none."""

    length: float
    angle: float


def units_of(file: StepFile, context: int) -> StepUnits:
    """Return the units of a context of representation; a length needs one."""
    assigned = file.find(context, "GLOBAL_UNIT_ASSIGNED_CONTEXT")
    members = [] if assigned is None else assigned.references(0)
    length = [_scale(file, unit, "METRE") for unit in members if file.find(unit, "LENGTH_UNIT")]
    angle = [_scale(file, unit, "RADIAN") for unit in members if file.find(unit, "PLANE_ANGLE_UNIT")]
    if not length:
        raise ValueError(
            f"{file.name(context)} must name a unit of length (LENGTH_UNIT); a unit is never guessed"
        )
    return StepUnits(_tidy(MILLIMETRES * length[0]), angle[0] if angle else math.nan)


def _scale(file: StepFile, unit: int, base: str, depth: int = 0) -> float:
    """Unit in metres or radians."""
    row = file.row(unit, "SI_UNIT", "CONVERSION_BASED_UNIT")
    if depth > DEEPEST:
        raise row.refused("must not be converted in a circle")
    if row.type == "SI_UNIT":
        return _si(row, base)
    measure = file.row(
        row.reference(-1), "MEASURE_WITH_UNIT", "LENGTH_MEASURE_WITH_UNIT", "PLANE_ANGLE_MEASURE_WITH_UNIT"
    )
    factor = measure.number_at(0)
    if not factor > 0:
        raise measure.refused(f"must be > 0; got {factor:g}")
    return factor * _scale(file, measure.reference(1), base, depth + 1)


def _si(row: StepRow, base: str) -> float:
    prefix, name = row.word(-2), row.word(-1)
    if name != base or prefix not in PREFIXES:
        raise row.refused(f"must be in {base}; got .{prefix}. .{name}.")
    return PREFIXES[prefix]


def _tidy(scale: float) -> float:
    """Scale without the rounding of 1e3 * 1e-3, so that mm stay to the bit."""
    return float(f"{scale:.15g}")
