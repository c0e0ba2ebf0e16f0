"""What evaluating a bundle of moves finds."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats


@dataclass(frozen=True)
class Found:
    """Best of each move: least expectation, control and entry of the lists, each [move, mode or 0, node]."""

    q: Floats
    control: Floats
    entry: npt.NDArray[np.int32]
