"""Places along a path: by leg, or at even distances in each run, with both sides of a sharp corner."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._arc_length import ArcLength
from sdpgrind.finishing.path._samples import Ints


def by_legs(run: Ints, per_leg: int) -> tuple[Ints, Floats]:
    """Piece and t of `per_leg` parts of each piece; the end of a piece is the start of the next one."""
    count = per_leg + np.append(np.diff(run) > 0, True)
    piece = np.repeat(np.arange(len(run)), count)
    return piece, np.asarray((np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)) / per_leg)


def by_length(run: Ints, arc: ArcLength, step: float) -> tuple[Ints, Floats]:
    """Piece and t at even distances of at most `step` mm in each run, its ends included."""
    first = np.searchsorted(run, np.arange(run[-1] + 2))
    ends = np.concatenate([[0.0], np.cumsum(arc.pieces(len(run)))])[first]
    parts = np.maximum(np.ceil(np.diff(ends) / step * (1 - 1e-12)), 1).astype(np.intp)
    of = np.repeat(np.arange(len(parts)), parts + 1)
    number = np.arange(len(of)) - (np.cumsum(parts + 1) - parts - 1)[of]
    piece, t = arc.places(ends[of] + number / parts[of] * np.diff(ends)[of])
    start, end = number == 0, number == parts[of]
    piece = np.where(start, first[of], np.where(end, first[of + 1] - 1, piece))
    return piece, np.where(start, 0.0, np.where(end, 1.0, t))
