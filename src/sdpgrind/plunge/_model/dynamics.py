"""Coefficients of a model at other rotations and wear flat areas; rates that do not burn.

Chip forces are independent of the rotation n; sliding follows its law; the heat at which the work burns grows
with n^(1/4), the depth of damage falls with n^(-3/4). All functions take arrays; `burn_depth` and `core_at`
also CasADi symbols.
"""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.kernels import DeflectionLaw, PlungeCore
from sdpgrind.plunge._model.model import PlungeModel

HALVINGS = 60  # chosen: halves a bracket below the rounding of a double


def core_at(model: PlungeModel, rotation: Any = None, area: Any = None) -> PlungeCore:
    """Coefficients at another rotation (rad/s) and wear flat area: numbers, arrays or symbols."""
    core = model.core
    share = 1.0 if rotation is None else rotation / model.work_rotation
    sliding = 1.0 if area is None else area / model.wear_flat_area
    if rotation is not None:
        sliding = sliding * _sliding(model, rotation) / _sliding(model, model.work_rotation)
    cooling = share**0.25
    return core._replace(
        K2=core.K2 * sliding,
        heat0=core.heat0 / cooling,
        heat1=core.heat1 / cooling,
        heat2=core.heat2 * sliding / cooling,
        reach=core.reach / share**0.75,
        power2=core.power2 * sliding,
    )


def _sliding(model: PlungeModel, rotation: Any) -> Any:
    """Sliding force of the model's wheel at an infeed rate of 1 mm/s, N/mm."""
    return model.power.sliding.force(
        depth_of_cut=2 * np.pi / rotation, work_speed=0.5 * model.work_diameter * rotation,
        wheel_speed=model.wheel_speed, equivalent_diameter=model.equivalent_diameter,
        wear_flat_area=model.wear_flat_area,
    )  # fmt: skip


def burn_depth(v: Any, core: PlungeCore, log: Any = np.log) -> Any:
    """Depth of damage, mm, at rates v > 0; negative: distance to damage. `log` is that of the symbols."""
    root = v**0.25
    return core.reach * root * log((core.heat0 + core.heat1 * v + core.heat2 * v**core.p) / root)


def coolest_rate(core: PlungeCore) -> Floats:
    """Rates (mm/s) at which the ratio of heat to the heat of burning is least."""
    parts = np.broadcast_arrays(3 * core.heat1, (4 * core.p - 1) * core.heat2, core.p, core.heat0)
    terms = zip(*(part.ravel().tolist() for part in parts), strict=True)
    rates = [_kernels.rate(y, DeflectionLaw(k1, k2, p)) for k1, k2, p, y in terms]
    return np.reshape(rates, parts[0].shape)


def burns_always(core: PlungeCore) -> Any:
    """Whether the work burns at every rate."""
    return burn_depth(coolest_rate(core), core) > 0


def allowed_rate(core: PlungeCore, depth: Floats, most: float) -> Floats:
    """Greatest rates (mm/s), at most `most`, with no more than `depth` (mm, >= 0) of damage."""
    low = np.minimum(np.broadcast_to(coolest_rate(core), np.shape(depth)), most)
    high = np.full(np.shape(depth), most)
    free = burn_depth(high, core) <= depth
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = burn_depth(middle, core) <= depth
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(free, most, low)
