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
from hwsim._log.journal import Journal
from hwsim._log.log import Log
from hwsim._loop.check import check
from hwsim._loop.compare import compare, repeat
from hwsim._loop.loop import run

if TYPE_CHECKING:
    from hwsim._link.courier import Courier
    from hwsim._link.links import Link, QueueLink
    from hwsim._link.tcp import TcpLink, TcpListener
    from hwsim._link.watchdog import Watchdog
    from hwsim._processor.schedule import Schedule, TaskReport
    from hwsim._processor.scheduler import Scheduler
    from hwsim._processor.tasks import Task
    from hwsim._replay.recording import Recording
    from hwsim._study.study import FinishingStudy, finishing_study
    from hwsim.plants._adaptive.plant import AdaptiveGrinder
    from hwsim.plants._centering.plant import CenteringMachine
    from hwsim.plants._finishing.plant import FinishingCell
    from hwsim.plants._force_table.plant import ForceTableStand
    from hwsim.plants._plunge.plant import GrinderNoise, PlungeGrinder
    from hwsim.plants._probe.errors import ProbeErrors
    from hwsim.plants._probe.plant import Probe
    from hwsim.plants._probe.ring import Ring
    from hwsim.plants._probe.scan import ProbeScan
    from hwsim.plants._weldbead.plant import WeldBeadStand
    from sdpgrind.finishing.kernels import CellScatter, CellTruth, HeightField
    from sdpgrind.weldbead.kernels import CoefficientScatter, Motor

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
    "Courier": "_link.courier",
    "FinishingStudy": "_study.study",
    "Link": "_link.links",
    "QueueLink": "_link.links",
    "Recording": "_replay.recording",
    "Schedule": "_processor.schedule",
    "Scheduler": "_processor.scheduler",
    "Task": "_processor.tasks",
    "TaskReport": "_processor.schedule",
    "TcpLink": "_link.tcp",
    "TcpListener": "_link.tcp",
    "Watchdog": "_link.watchdog",
    "finishing_study": "_study.study",
}
_PLANTS = {
    "AdaptiveGrinder": "_adaptive.plant",
    "CellScatter": "_finishing_truth",
    "CellTruth": "_finishing_truth",
    "CenteringMachine": "_centering.plant",
    "CoefficientScatter": "_force_table_truth",
    "FinishingCell": "_finishing.plant",
    "ForceTableStand": "_force_table.plant",
    "GrinderNoise": "_plunge.plant",
    "HeightField": "_finishing_height",
    "Motor": "_force_table_truth",
    "PlungeGrinder": "_plunge.plant",
    "Probe": "_probe.plant",
    "ProbeErrors": "_probe.errors",
    "ProbeScan": "_probe.scan",
    "Ring": "_probe.ring",
    "WeldBeadStand": "_weldbead.plant",
}  # plants bring their physics along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _PLANTS:
        return getattr(import_module(f"hwsim.plants.{_PLANTS[name]}"), name)
    if name in _PARTS:
        return getattr(import_module(f"hwsim.{_PARTS[name]}"), name)
    raise AttributeError(f"module 'hwsim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
