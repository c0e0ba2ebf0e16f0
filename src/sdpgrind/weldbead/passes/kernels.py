"""Compiled steps of the cut for compiled code of other packages: arrays in place, serial."""

from sdpgrind.weldbead.passes._kernels import (
    DONE,
    RATE,
    STATES,
    TIP_X,
    TIP_Z,
    WEAR,
    WIND,
    Bead,
    CutCore,
    Step,
    cut_of,
    cut_step,
)

__all__ = [
    "DONE",
    "RATE",
    "STATES",
    "TIP_X",
    "TIP_Z",
    "WEAR",
    "WIND",
    "Bead",
    "CutCore",
    "Step",
    "cut_of",
    "cut_step",
]
