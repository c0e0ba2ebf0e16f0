"""How much was left between damage and stock, from a log; what noise does to that and to roundness, by simulation."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._control import part_kernels as kernels
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._control.foreseen import foreseen

PARTS = 64
"""Parts that are simulated to learn what noise does."""


def measured_slack(part_log: Any, controller: CycleController) -> float:
    """Return the balance slack (8), mm: least of measured stock less depth of damage from measured power; NaN without balance.

    Clipped and missing readings are left out.
    """
    return _least(_readings(_columns(part_log), controller))


def at_size(part_log: Any) -> bool:
    """Whether the part was ground to size, as the controller saw it, and not broken off."""
    return bool(part_log.column("controller", "remaining_planned")[-1] <= 0.0)


def scatter_of_slack(part_log: Any, controller: CycleController) -> float:
    """Return the standard deviation of one reading of the slack about its course, mm, as a part shows it; NaN: too few."""
    return _scatter(_readings(_columns(part_log), controller))


def _columns(part_log: Any) -> dict[str, Floats]:
    names = ("size", "grinding_power", "power_saturated", "balancing_command", "infeed_rate_planned")
    return {name: part_log.column("controller", name) for name in names}


def _readings(columns: Mapping[str, Floats], controller: CycleController) -> Floats:
    used = (columns["balancing_command"] > 0) & (columns["power_saturated"] == 0)
    used &= np.isfinite(columns["size"]) & np.isfinite(columns["grinding_power"])
    rate, power = columns["infeed_rate_planned"][used], columns["grinding_power"][used]
    burn = np.maximum(controller.problem.model.burn_depth(rate, power), 0.0)
    return np.asarray(controller.problem.stock - columns["size"][used] - burn)


def _least(readings: Floats) -> float:
    return float(readings.min()) if readings.size else float("nan")


def _scatter(readings: Floats) -> float:
    """From second differences, which leave of a smooth course next to nothing."""
    return float(np.sqrt(np.mean(np.diff(readings, 2) ** 2) / 6)) if readings.size > 2 else float("nan")


@lru_cache(maxsize=512)
def noise_of_slack(controller: CycleController) -> tuple[float, float, float]:
    """Return by how much the measured slack is too small on average, its scatter, and that of one reading, mm.

    By simulation of the model.

    A least value of many noisy ones is too small: `controller` grinds parts of its own model, with the noise that it reckons
    with. Without a balance: no bias and no scatter.
    """
    rng = np.random.default_rng(0)
    parts = [(true - _least(readings), _scatter(readings)) for true, readings in (_both(controller, rng) for _ in range(PARTS))]
    off, each = np.array([part for part in parts if np.all(np.isfinite(part))]).reshape(-1, 2).T
    return (float(np.mean(off)), float(np.std(off)), float(np.mean(each))) if len(off) > 1 else (0.0, 0.0, 0.0)


@lru_cache(maxsize=512)
def scatter_of_roundness(controller: CycleController) -> float:
    """Return how far the out-of-roundness goes beyond its mean (upper semideviation, mm), by simulation of the model.

    The upper end of what so few parts tell of it: two standard errors more.

    With the noise that the controller reckons with and contacts that it does not know.
    """
    rng, model = np.random.default_rng(0), controller.problem.model
    contacts = controller.law.zero_sd * rng.standard_normal(PARTS)
    ends = [foreseen(controller.problem, controller.law, rng=rng, contact=each)[0] for each in contacts]
    left = [model.roundness(end[kernels.RATE]) for end in ends]
    beyond = np.array(left) - np.mean(left)
    beyond = beyond[beyond > 0]
    return float(np.sqrt(np.mean(beyond**2)) * (1 + 2 / np.sqrt(2 * beyond.size))) if beyond.size else 0.0


def _both(controller: CycleController, rng: np.random.Generator) -> tuple[float, Floats]:
    """True balance slack and readings of it (mm) of a simulated part."""
    state, columns = foreseen(controller.problem, controller.law, rng=rng)
    return float(state[kernels.SLACK]), _readings(columns, controller)
