"""Roughness of finished parts against the model, and their settings against its ranges."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.rows import Doubt, compared, untold
from sdpgrind.base.tables import table_of
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.roughness._fit import identify_roughness
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._terms import NAMES
from sdpgrind.finishing.study._study import Study
from sdpgrind.identify import Estimate

# derived: a term of ln R_a with this standard deviation is a factor of R_a with one as large as itself; a
# logarithm or an exponent near 0 is no lack of data
_SCALE = 1.0
_LEVELS = 3  # derived: a parabola over the logarithm of the force
_ROUNDING = 1e-9  # chosen: relative; ends of ranges that are alike
_HINT = "finished parts (pattern, tool_diameter, normal_force, roughness_ra)"
_UNITS = {"tool_diameter": "mm", "normal_force": "N"}


class FittedRoughness(NamedTuple):
    """Estimate of the roughness model, and the problem that takes it over with the ranges of its readings."""

    estimate: Estimate
    problem: FinishingProblem


def believed(model: RoughnessModel) -> dict[str, float]:
    """Coefficients and scatter of the model by name."""
    values = np.asarray(model.coefficients, dtype=float).tolist()
    return dict(zip(NAMES, values, strict=True)) | {"residual_sd": model.residual_sd}


def of_parts(problem: FinishingProblem, data: Any) -> tuple[list[Doubt], list[str], FittedRoughness | None]:
    """Rows of the coefficients, sentences on scatter and settings, and what the data make of the problem."""
    estimate = identify_roughness(data, throw=False)
    rows = [
        compared(estimate, name, value, scale=_SCALE, note="from finished parts")
        for name, value in believed(problem.model).items()
    ]
    levels = {name: _levels(data, name) for name in _UNITS}
    found = _settings(problem.model, levels)
    if not estimate.ok:
        return rows, found, None
    ranges = _ranges(problem.model, levels)
    call = 'finishing.identify(log, "roughness")'
    fitted = FittedRoughness(estimate, problem.updated(estimate).replace(**ranges))
    words = [f"The roughness model was fitted {estimate.message}.", *found, *_beyond(problem, levels)]
    return rows, [*words, *_to_plan_with(call, ranges)], fitted


def untold_rows(problem: FinishingProblem, found: Sequence[Doubt]) -> list[Doubt]:
    """Rows of the coefficients that are not among those found."""
    names = {row.name for row in found}
    return [
        untold(name, "", value, _HINT) for name, value in believed(problem.model).items() if name not in names
    ]


def _levels(data: Any, name: str) -> Floats:
    """Levels of a setting, in its unit."""
    columns = data.settings if isinstance(data, Study) else table_of(data, "controller")[0]
    levels = np.unique(np.asarray(columns[name], dtype=float))
    found: Floats = levels[np.isfinite(levels)]
    return found


def _settings(model: RoughnessModel, levels: dict[str, Floats]) -> list[str]:
    """Sentences on forces and tools beyond the range of the model, and too few of them."""
    found = []
    for name in ("normal_force", "tool_diameter"):
        each, unit, (low, high) = levels[name], _UNITS[name], getattr(model, f"{name}_range")
        told = f"{name} was {', '.join(f'{level:.4g}' for level in each[:6])} {unit}"
        if each[0] < low or each[-1] > high:
            found.append(f"{told}; the model is meant for {low:g} to {high:g} {unit}.")
        if name == "normal_force" and each.size < _LEVELS:
            found.append(f"{told}: two more forces would tell force_slope from force_bend.")
    return found


def _beyond(problem: FinishingProblem, levels: dict[str, Floats]) -> list[str]:
    """Sentences on a plan whose force or tool is beyond the readings; these tell no pitch."""
    planned = {"normal_force": problem.model.best_force(), "tool_diameter": problem.tool_diameter}
    found = []
    for name, value in planned.items():
        low, high, unit = levels[name][0], levels[name][-1], _UNITS[name]
        if not low * (1 - _ROUNDING) <= value <= high * (1 + _ROUNDING):
            found.append(
                f"{name} of the plan, {value:.3g} {unit}, is beyond the readings, {low:.4g} to {high:.4g}"
                f" {unit}: its roughness is extrapolated, whatever the model."
            )
    pitch = f"{problem.path.pitch:.3g} mm in the plan"
    return [*found, f"The model has no term for the pitch, {pitch}: that of the readings has to be the same."]


def _ranges(model: RoughnessModel, levels: dict[str, Floats]) -> dict[str, tuple[float, float]]:
    """Ranges of the readings where those of the model are others."""
    read = {f"{name}_range": (float(each[0]), float(each[-1])) for name, each in levels.items()}
    return {
        name: ends
        for name, ends in read.items()
        if not np.allclose(ends, getattr(model, name), rtol=_ROUNDING, atol=0.0)
    }


def _to_plan_with(call: str, ranges: dict[str, tuple[float, float]]) -> list[str]:
    """Sentence with the call that plans with what is told, within the ranges of the readings."""
    (told,) = to_plan_with([call])
    if not ranges:
        return [told]
    given = ", ".join(f"{name}=({low:.6g}, {high:.6g})" for name, (low, high) in ranges.items())
    return [f"{told.removesuffix('.')}.replace({given})."]
