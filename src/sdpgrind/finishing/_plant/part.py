"""Settings of the compiled core of the finishing cell, and results of a part from its state."""

import math
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._plant import kernels as core
from sdpgrind.finishing._plant.truth import CellTruth
from sdpgrind.finishing._problem.problem import FinishingProblem

_FORCES = (
    "normal_force", "normal_force_sd", "normal_force_min", "normal_force_max", "lift_off", "feed", "feed_sd",
)  # fmt: skip


def cell_settings(cell: Any, truth: CellTruth, offset: float) -> Floats:
    """Settings of the compiled core of a `hwsim.FinishingCell`: drawn values are true."""
    problem, axis, settings = cell.problem, cell.torque_axis, np.zeros(core.SETTINGS)
    settings[core.TICK], settings[core.LEVER] = cell.tick, problem.lever_arm
    settings[core.CONTACT_ANGLE], settings[core.SIDE] = problem.contact_angle, 1.0 if problem.pushed else -1.0
    settings[core.FRICTION], settings[core.LOAD] = truth.friction_ratio, truth.load_torque
    settings[core.RESOLUTION], settings[core.OFFSET] = axis.angle_step, offset
    settings[core.CURRENT_STEP], settings[core.CURRENT_MAX] = axis.current_step, axis.current_limit
    return settings


def forces_of(state: Floats, wanted: float | None) -> dict[str, float]:
    """Force (N) and feed (mm/s) over the path; NaN where nothing was played."""
    count = float(state[core.COUNT])
    if count == 0:
        return dict.fromkeys(_FORCES if wanted is None else (*_FORCES, "force_error"), math.nan)
    values = (
        state[core.FORCE_MEAN], math.sqrt(state[core.FORCE_SQUARES] / count),
        state[core.FORCE_MIN], state[core.FORCE_MAX],
        state[core.LIFTED] / count, state[core.FEED_MEAN], math.sqrt(state[core.FEED_SQUARES] / count),
    )  # fmt: skip
    found = {name: float(value) for name, value in zip(_FORCES, values, strict=True)}
    if wanted is None:
        return found
    return {**found, "force_error": math.hypot(found["normal_force"] - wanted, found["normal_force_sd"])}


def roughness_of(
    problem: FinishingProblem, truth: CellTruth, force: float, normal: float
) -> dict[str, float]:
    """Roughness (mm) of the model at the mean force, with the part's error; NaN for an unknown pattern."""
    model, pattern = problem.model, problem.path.pattern
    tried = model.covers(pattern, model.tool_diameter_range[0], model.normal_force_range[0])
    if not (tried and force > 0.0):
        return {"roughness_ra": math.nan, "extrapolated": 1.0}
    settings, error = (pattern, problem.tool_diameter, force), truth.roughness_error
    drawn = model.residual_sd * normal if error is None else error
    median = float(model.median(*settings, extrapolate=True))
    return {"roughness_ra": median * math.exp(drawn), "extrapolated": float(not model.covers(*settings))}
