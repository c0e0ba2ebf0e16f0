"""The bottom tier of weld-bead grinding: a force loop on a motor-driven table (Brown 1988, chapter 7 and Appendix B)."""

from sdpgrind.weldbead.force._constrained import PredictiveController
from sdpgrind.weldbead.force._controller import ForceController
from sdpgrind.weldbead.force._designs import DesignLimits, DisturbanceObserver, q_loop, tuned_pi
from sdpgrind.weldbead.force._drive import TableDrive, servo_drive, table_drive
from sdpgrind.weldbead.force._feedback import PI, ForceLoop, ForcePlant
from sdpgrind.weldbead.force._limits import Limits
from sdpgrind.weldbead.force._margins import margins, runout_response
from sdpgrind.weldbead.force._predictive import Predictive
from sdpgrind.weldbead.force._sensor import SensorChain
from sdpgrind.weldbead.force._servo import ServoTable
from sdpgrind.weldbead.force._simulate import LoopRecord, simulate_loop
from sdpgrind.weldbead.force._table import design_table, designs

__all__ = [
    "PI",
    "DesignLimits",
    "DisturbanceObserver",
    "ForceController",
    "ForceLoop",
    "ForcePlant",
    "Limits",
    "LoopRecord",
    "Predictive",
    "PredictiveController",
    "SensorChain",
    "ServoTable",
    "TableDrive",
    "design_table",
    "designs",
    "margins",
    "q_loop",
    "runout_response",
    "servo_drive",
    "simulate_loop",
    "table_drive",
    "tuned_pi",
]
