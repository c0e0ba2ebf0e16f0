"""What a first program does with a weld bead: `sdpgrind.warm` compiles what it needs."""

import warnings

from sdpgrind.weldbead.sequence._controller import SequenceController
from sdpgrind.weldbead.sequence._plan import plan
from sdpgrind.weldbead.sequence._presets import preset


def first_use() -> None:
    """Plan a sequence and ask its controller for a pass."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # how exact the policy is does not matter here
        SequenceController(plan(preset("P1"))).step(height=1.0, time_left=10.0)
