"""Parts of a long program: cut where the tool rests in the air, behind a lift."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Bools
from sdpgrind.finishing._program.blocks import Blocks, joined
from sdpgrind.finishing._program.course import PlannedMotion


def rests_in_air(motion: PlannedMotion) -> Bools:
    """Whether the tool is at the top of a lift at the end of each run but the last, (r - 1,)."""
    cuts = np.flatnonzero(np.diff(motion.time) <= 0) + 1
    if not cuts.size:
        return np.zeros(0, dtype=bool)
    height = motion.problem.path.at(motion.length[cuts]).clearance
    around = np.concatenate([[0.0], height, [0.0]])  # before its arc a lift rests, too, lower
    top = height >= np.maximum(around[:-2], around[2:]) * (1 - 1e-9)
    return np.asarray(~motion.contact[cuts - 1] & ~motion.contact[cuts] & top)


def parts_of(runs: Sequence[Blocks], air: Sequence[bool], most: int) -> list[Blocks]:
    """Join runs to parts of at most `most` points each, where they can be cut so; `air`: behind which."""
    pieces: list[list[Blocks]] = [[]]
    for run, cut in zip(runs, [*air, False], strict=True):
        pieces[-1].append(run)
        if cut:
            pieces.append([])
    parts: list[list[Blocks]] = [[]]
    for piece in pieces:
        if parts[-1] and _points(parts[-1]) + _points(piece) > most:
            parts.append([])
        parts[-1] += piece
    return [joined(part) for part in parts]


def _points(runs: Sequence[Blocks]) -> int:
    return sum(len(run.feeds) for run in runs)
