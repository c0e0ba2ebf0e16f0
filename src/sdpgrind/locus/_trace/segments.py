"""Tables with kinks: joints of pieces have two points, with the slopes of either side."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from sdpgrind.base.checks import Floats

SAME = 1e-12  # chosen: share of the range up to which two points are one
APART = 1e-9  # chosen: share of the range by which the points of a joint are separated


def apart(
    k: int, columns: tuple[Floats, Floats, Floats], tangents: tuple[Floats, ...]
) -> tuple[Floats, Floats, Floats]:
    """Return controls, hidden state and limit, the second point of joints moved along its tangent.

    The gap is in control `k`, or in the hidden state if `k` is the number of controls.
    """
    controls, hidden, limit = (np.asarray(column, dtype=float) for column in columns)
    again = np.flatnonzero(np.abs(np.diff(hidden)) <= SAME * np.ptp(hidden)) + 1
    speed = np.column_stack([tangents[0], tangents[1]])[:, k]
    step = np.zeros(hidden.size)
    with np.errstate(divide="ignore"):
        room = APART * np.ptp(np.column_stack([controls, hidden])[:, k]) / np.abs(speed[again])
    # tangents may point against the order of the points
    onward = np.sign(tangents[1][again]) * np.sign(hidden[-1] - hidden[0])
    step[again] = np.where(np.isfinite(room), room, 0.0) * onward
    return controls + step[:, None] * tangents[0], hidden + step * tangents[1], limit + step * tangents[2]


def bends(coordinate: Floats, values: Floats) -> Floats:
    """Return the slopes (K, ...) of columns by splines between kinks."""
    cuts = [0, *(np.flatnonzero(np.diff(coordinate) < 10 * APART * np.ptp(coordinate)) + 1), coordinate.size]
    parts = [_bend(coordinate[a:b], values[a:b]) for a, b in pairwise(cuts)]
    return np.concatenate(parts)


def _bend(s: Floats, values: Floats) -> Floats:
    return np.zeros_like(values) if s.size < 2 else np.asarray(CubicSpline(s, values).derivative()(s))
