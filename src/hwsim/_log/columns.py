"""Columns of the table of one part, for pictures and films."""

from collections.abc import Sequence
from math import nan

import numpy as np

from hwsim.protocols import PartLog
from sdpgrind.base.checks import Floats


def columns(log: PartLog, names: Sequence[str], part: int = -1) -> dict[str, Floats]:
    """Columns of the first table for one part, -1: the last; NaN where there is no such column."""
    table = log[log.tiers[0]]
    rows = table.part.values == (table.part.values[-1] if part < 0 else part)
    missing = np.full(rows.sum(), nan)
    return {name: table[name].values[rows] if name in table.variables else missing for name in names}
