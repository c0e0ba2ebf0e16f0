"""Values of an estimate as fields of a problem."""

from math import inf
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.quantities import specs
from sdpgrind.identify import Estimate
from sdpgrind.physics import GrindingPower
from sdpgrind.plunge._model.drive import Drive
from sdpgrind.plunge._model.model import PlungeModel

OF_DEFLECTION = frozenset(["normal_force_ratio", "stiffness", "linear_time_constant"])
"""Fields that scale the deflection, and so the time constant."""
_CONTACT, _WEAR = "contact_zero", "wheel_wear"
_LEAST_LAG = 1e-6  # chosen: s; a fit that ends at its bound 0 stops a rounding above it


def taken(model: PlungeModel, estimate: Estimate) -> dict[str, Any]:
    """Return the changes of a problem by the names of its fields; another quantity is refused.

    The contact zero is that of one part, and is left out unless it is all that was estimated.
    """
    names = [name for name in estimate.names if not name.startswith(_CONTACT)] or list(estimate.names)
    of_power, of_drive = _numbers(GrindingPower), _numbers(Drive)
    known = ["time_constant", "B", "burning_sd", *_numbers(PlungeModel), *of_power, *of_drive, _WEAR]
    for name in names:
        checks.one_of("estimate.names", name, known)
    values: dict[str, Any] = {name: estimate[name] for name in names}
    if "B" in values:
        values["burning"] = model.burning.replace(B=values.pop("B"))
    if _WEAR in values:
        values["grinding_ratio"] = grinding_ratio(model, values.pop(_WEAR))
    power = {name: values.pop(name) for name in of_power if name in values}
    if power:
        values["power"] = model.power.replace(**power)
    for name in ("feed_lag", "power_lag"):
        if values.get(name, inf) < _LEAST_LAG:
            values[name] = 0.0
    return values


def grinding_ratio(model: PlungeModel, wear: float) -> float:
    """Return the grinding ratio of a radial wear per radial stock, mm/mm; inf: none, or below 0 by noise."""
    return model.work_diameter / (model.wheel_diameter * wear) if wear > 0.0 else inf


def _numbers(cls: type) -> list[str]:
    """Names of the numeric fields of a class."""
    return [name for name, spec in specs(cls).items() if spec.kind == "number"]
