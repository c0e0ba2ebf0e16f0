"""The bottom tier of weld-bead grinding: a force loop on a motor-driven table (Brown 1988, chapter 7 and Appendix B)."""

from sdpgrind.weldbead.force._controller import ForceController, Limits
from sdpgrind.weldbead.force._drive import TableDrive, servo_drive, table_drive
from sdpgrind.weldbead.force._feedback import PI, ForceLoop, ForcePlant
from sdpgrind.weldbead.force._margins import margins, runout_response
from sdpgrind.weldbead.force._sensor import SensorChain
from sdpgrind.weldbead.force._servo import ServoTable

__all__ = [
    "PI",
    "ForceController",
    "ForceLoop",
    "ForcePlant",
    "Limits",
    "SensorChain",
    "ServoTable",
    "TableDrive",
    "margins",
    "runout_response",
    "servo_drive",
    "table_drive",
]
