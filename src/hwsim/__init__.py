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
    from hwsim._courier import Courier
    from hwsim._finishing_study import FinishingStudy, finishing_study
    from hwsim._links import Link, QueueLink
    from hwsim._recording import Recording
    from hwsim._schedule import Schedule, TaskReport
    from hwsim._scheduler import Scheduler
    from hwsim._tasks import Task
    from hwsim._tcp import TcpLink, TcpListener
    from hwsim._watchdog import Watchdog
    from hwsim.plants._adaptive import AdaptiveGrinder
    from hwsim.plants._centering import CenteringMachine
    from hwsim.plants._finishing import FinishingCell
    from hwsim.plants._finishing_height import HeightField
    from hwsim.plants._finishing_truth import CellScatter, CellTruth
    from hwsim.plants._force_table import ForceTableStand
    from hwsim.plants._force_table_truth import CoefficientScatter, Motor
    from hwsim.plants._plunge import GrinderNoise, PlungeGrinder
    from hwsim.plants._probe import Probe
    from hwsim.plants._probe_errors import ProbeErrors
    from hwsim.plants._probe_ring import Ring
    from hwsim.plants._probe_scan import ProbeScan
    from hwsim.plants._weldbead import WeldBeadStand

__all__ = [
    "AdaptiveGrinder",
    "CellScatter",
    "CellTruth",
    "CenteringMachine",
    "CoefficientScatter",
    "Courier",
    "FinishingCell",
    "FinishingStudy",
    "ForceTableStand",
    "GrinderNoise",
    "HeightField",
    "Journal",
    "Link",
    "Log",
    "Motor",
    "PlungeGrinder",
    "Probe",
    "ProbeErrors",
    "ProbeScan",
    "QueueLink",
    "Recording",
    "Ring",
    "Schedule",
    "Scheduler",
    "Task",
    "TaskReport",
    "TcpLink",
    "TcpListener",
    "Watchdog",
    "WeldBeadStand",
    "check",
    "compare",
    "devices",
    "finishing_study",
    "protocols",
    "repeat",
    "run",
]

_PARTS = {
    "Courier": "_courier",
    "FinishingStudy": "_finishing_study",
    "Link": "_links",
    "QueueLink": "_links",
    "Recording": "_recording",
    "Schedule": "_schedule",
    "Scheduler": "_scheduler",
    "Task": "_tasks",
    "TaskReport": "_schedule",
    "TcpLink": "_tcp",
    "TcpListener": "_tcp",
    "Watchdog": "_watchdog",
    "finishing_study": "_finishing_study",
}
_PLANTS = {
    "AdaptiveGrinder": "_adaptive",
    "CellScatter": "_finishing_truth",
    "CellTruth": "_finishing_truth",
    "CenteringMachine": "_centering",
    "CoefficientScatter": "_force_table_truth",
    "FinishingCell": "_finishing",
    "ForceTableStand": "_force_table",
    "GrinderNoise": "_plunge",
    "HeightField": "_finishing_height",
    "Motor": "_force_table_truth",
    "PlungeGrinder": "_plunge",
    "Probe": "_probe",
    "ProbeErrors": "_probe_errors",
    "ProbeScan": "_probe_scan",
    "Ring": "_probe_ring",
    "WeldBeadStand": "_weldbead",
}  # plants bring their physics along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _PLANTS:
        return getattr(import_module(f"hwsim.plants.{_PLANTS[name]}"), name)
    if name in _PARTS:
        return getattr(import_module(f"hwsim.{_PARTS[name]}"), name)
    raise AttributeError(f"module 'hwsim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
