"""Roughness of finished parts against the model, and their settings against its ranges."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.rows import Doubt, compared, untold
from sdpgrind.base.tables import table_of
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.roughness._fit import identify_roughness
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._terms import NAMES
from sdpgrind.finishing.study._study import Study

_SCALE = 0.1  # chosen: change of ln R_a, 10 % of the roughness, below which a term is known well enough
_LEVELS = 3  # derived: a parabola over the logarithm of the force
_HINT = "finished parts (pattern, tool_diameter, normal_force, roughness_ra)"


def believed(model: RoughnessModel) -> dict[str, float]:
    """Coefficients and scatter of the model by name."""
    values = np.asarray(model.coefficients, dtype=float).tolist()
    return dict(zip(NAMES, values, strict=True)) | {"residual_sd": model.residual_sd}


def of_parts(problem: FinishingProblem, data: Any) -> tuple[list[Doubt], list[str]]:
    """Rows of the coefficients, and sentences on scatter and settings."""
    estimate = identify_roughness(data, throw=False)
    rows = [
        compared(estimate, name, value, scale=_SCALE, note="from finished parts")
        for name, value in believed(problem.model).items()
    ]
    found = _settings(problem.model, data)
    if not estimate.ok:
        return rows, found
    calls = to_plan_with(['finishing.identify(log, "roughness")'])
    return rows, [f"The roughness model was fitted {estimate.message}.", *found, *calls]


def untold_rows(problem: FinishingProblem, found: Sequence[Doubt]) -> list[Doubt]:
    """Rows of the coefficients that are not among those found."""
    names = {row.name for row in found}
    return [
        untold(name, "", value, _HINT) for name, value in believed(problem.model).items() if name not in names
    ]


def _settings(model: RoughnessModel, data: Any) -> list[str]:
    """Sentences on forces and tools beyond the range of the model, and too few of them."""
    columns = data.settings if isinstance(data, Study) else table_of(data, "controller")[0]
    found = []
    for name, (low, high), unit in (
        ("normal_force", model.normal_force_range, "N"),
        ("tool_diameter", model.tool_diameter_range, "mm"),
    ):
        levels = np.unique(np.asarray(columns[name], dtype=float))
        told = f"{name} was {', '.join(f'{level:.4g}' for level in levels[:6])} {unit}"
        if levels[0] < low or levels[-1] > high:
            found.append(f"{told}; the model is meant for {low:g} to {high:g} {unit}.")
        if name == "normal_force" and levels.size < _LEVELS:
            found.append(f"{told}: two more forces would tell force_slope from force_bend.")
    return found
