"""Private names that tests of weld beads use."""

from sdpgrind.sdp._plan.look_up_error import between_nodes
from sdpgrind.weldbead._doubts.passes import checks_of
from sdpgrind.weldbead.force._feedback import CONTACT_STIFFNESS
from sdpgrind.weldbead.force._kernels import _backlash_step, _play_step, plant_sample
from sdpgrind.weldbead.force._margins import parametrised
from sdpgrind.weldbead.passes._relaxation import statement
from sdpgrind.weldbead.sequence._plan import default_tolerance
from sdpgrind.weldbead.sequence._risk import LARGEST

__all__ = [
    "CONTACT_STIFFNESS",
    "LARGEST",
    "_backlash_step",
    "_play_step",
    "between_nodes",
    "checks_of",
    "default_tolerance",
    "parametrised",
    "plant_sample",
    "statement",
]
