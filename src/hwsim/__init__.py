"""Hardware simulation: plants, the loop between a controller and a plant, logs that survive, a command line.

Examples
--------
>>> import hwsim
>>> from sdpgrind import weldbead
>>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
>>> sorted(stand.accepts)
['duration', 'feed_rate', 'normal_force', 'stop']
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from hwsim import devices, protocols
from hwsim._check import check
from hwsim._journal import Journal
from hwsim._log import Log
from hwsim._loop import run
from hwsim._side_by_side import compare, repeat

if TYPE_CHECKING:
    from hwsim.plants._adaptive import AdaptiveGrinder
    from hwsim.plants._force_table import ForceTableStand
    from hwsim.plants._force_table_truth import CoefficientScatter, Motor
    from hwsim.plants._plunge import GrinderNoise, PlungeGrinder
    from hwsim.plants._weldbead import WeldBeadStand

__all__ = [
    "AdaptiveGrinder",
    "CoefficientScatter",
    "ForceTableStand",
    "GrinderNoise",
    "Journal",
    "Log",
    "Motor",
    "PlungeGrinder",
    "WeldBeadStand",
    "check",
    "compare",
    "devices",
    "protocols",
    "repeat",
    "run",
]

_PLANTS = {
    "AdaptiveGrinder": "_adaptive",
    "CoefficientScatter": "_force_table_truth",
    "ForceTableStand": "_force_table",
    "GrinderNoise": "_plunge",
    "Motor": "_force_table_truth",
    "PlungeGrinder": "_plunge",
    "WeldBeadStand": "_weldbead",
}  # plants bring their physics along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _PLANTS:
        return getattr(import_module(f"hwsim.plants.{_PLANTS[name]}"), name)
    raise AttributeError(f"module 'hwsim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
