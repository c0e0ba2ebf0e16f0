"""What a model comes to at other rotations of the work and other wear flat areas; the rates that are allowed there.

Chips need as much force at any rotation; sliding follows its law; the heat that the surface stands goes with n^(1/4), how
deep it reaches with n^(-3/4). Written with operators: arrays and symbols of CasADi go through the same lines.
"""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.kernels import Give, PlungeCore
from sdpgrind.plunge._model.model import PlungeModel

HALVINGS = 60


def core_at(model: PlungeModel, rotation: Any = None, area: Any = None) -> PlungeCore:
    """Coefficients at another rotation (rad/s) and wear flat area; numbers, arrays or symbols."""
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
    """Sliding force (N/mm) of the model's wheel at 1 mm/s of infeed."""
    return model.power.sliding.force(
        depth_of_cut=2 * np.pi / rotation, work_speed=0.5 * model.work_diameter * rotation, wheel_speed=model.wheel_speed,
        equivalent_diameter=model.equivalent_diameter, wear_flat_area=model.wear_flat_area,
    )  # fmt: skip


def burn_depth(v: Any, core: PlungeCore, log: Any = np.log) -> Any:
    """Depth of damage, mm, of arrays or, with their own logarithm, symbols; negative: what is left; v > 0."""
    root = v**0.25
    return core.reach * root * log((core.heat0 + core.heat1 * v + core.heat2 * v**core.p) / root)


def coolest(core: PlungeCore) -> Floats:
    """Rates (mm/s) at which the least of what the surface stands is used: between the two roots of burning."""
    parts = np.broadcast_arrays(3 * core.heat1, (4 * core.p - 1) * core.heat2, core.p, core.heat0)
    terms = zip(*(part.ravel().tolist() for part in parts), strict=True)
    rates = [_kernels.rate(y, Give(k1, k2, p)) for k1, k2, p, y in terms]
    return np.reshape(rates, parts[0].shape)


def burns_always(core: PlungeCore) -> Any:
    """Whether no rate is without damage."""
    return burn_depth(coolest(core), core) > 0


def allowed_rate(core: PlungeCore, depth: Floats, most: float) -> Floats:
    """Greatest rates (mm/s), up to `most`, whose damage goes no deeper than `depth` (mm, >= 0)."""
    low = np.minimum(np.broadcast_to(coolest(core), np.shape(depth)), most)
    high = np.full(np.shape(depth), most)
    free = burn_depth(high, core) <= depth
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = burn_depth(middle, core) <= depth
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(free, most, low)
