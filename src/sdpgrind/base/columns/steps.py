"""Whether steps of time are in seconds: that of common instants, and that from row to row of a size."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.brief import counted
from sdpgrind.base.columns.rows import PartRows
from sdpgrind.base.warned import warn

_STEP = 2.0  # s; chosen: the slowest trace of a control that follows a size
_SHORTEST = 0.3  # s; chosen: a part
_MANY, _FEW = 100, 10  # chosen: rows that tell a course, and instants that do not
_FOLLOWED = frozenset(["size", "removed"])  # quantities that are measured while a part is ground


def refuse_other_resample(step: float | None, rows: int, blocks: Sequence[PartRows], where: str) -> None:
    """Refuse a step (s) of common instants that leaves next to nothing of many rows, as one in ms does."""
    kept = sum(block.time.size for block in blocks)
    if step is None or rows < _MANY * len(blocks) or kept >= _FEW * len(blocks):
        return
    raise ValueError(
        f"{where}: resample must be a tenth of a part or less (s); {step:g} s leaves"
        f" {counted(kept, 'instant')} of {rows} rows: resample={step / 1000:g} if it is in ms"
        " (plausible=False takes it as it is)"
    )


def warn_of_other_time(blocks: Sequence[PartRows], where: str) -> None:
    """Warn of a size whose rows are further apart, or whose parts are shorter, than a machine can mean."""
    if not _FOLLOWED & set(blocks[0].columns):
        return
    steps = [float(np.median(np.diff(block.time))) for block in blocks if block.time.size > 1]
    lasts = [float(np.ptp(block.time)) for block in blocks if block.time.size >= _MANY]
    if steps and np.median(steps) > _STEP:
        told = f"{np.median(steps):.4g} s from row to row; usual are up to {_STEP:g} s"
    elif lasts and np.median(lasts) < _SHORTEST:
        told = f"parts of {np.median(lasts):.4g} s; usual are {_SHORTEST:g} s and more"
    else:
        return
    warn(f"{where}: time has {told}: is its unit, or that of period (s), another one?")
