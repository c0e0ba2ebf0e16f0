"""First use of the weld bead, compiled by `sdpgrind.warm`."""

import warnings

from sdpgrind.weldbead.sequence._controller import SequenceController
from sdpgrind.weldbead.sequence._plan import plan
from sdpgrind.weldbead.sequence._presets import preset
from sdpgrind.weldbead.sequence._replan import next_pass


def first_use() -> None:
    """Plan a sequence coarsely, by the kernels of a fine plan; step its controller; plan a pass anew."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the policy may be inexact
        SequenceController(plan(preset("P1"), tolerance=1e-2)).step(height=1.0, time_left=10.0)
    next_pass(preset("P1"), "cautious", 1.0, 10.0)
