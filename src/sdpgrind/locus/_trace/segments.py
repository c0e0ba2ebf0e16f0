"""Tables with kinks: where pieces of a locus meet, a point stands twice, with the slopes of either side."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from sdpgrind.base.checks import Floats

SAME, APART = 1e-12, 1e-9
"""Shares of a range up to which two points are one, and by which they are set apart."""


def apart(
    k: int, columns: tuple[Floats, Floats, Floats], tangents: tuple[Floats, ...]
) -> tuple[Floats, Floats, Floats]:
    """Controls, hidden state and limit with a little room at kinks: the second point goes on along its own tangent.

    Room is made in control `k`, or in the hidden state where `k` is beyond the controls.
    """
    controls, hidden, limit = (np.asarray(column, dtype=float) for column in columns)
    again = np.flatnonzero(np.abs(np.diff(hidden)) <= SAME * np.ptp(hidden)) + 1
    speed = np.column_stack([tangents[0], tangents[1]])[:, k]
    step = np.zeros(hidden.size)
    with np.errstate(divide="ignore"):
        room = APART * np.ptp(np.column_stack([controls, hidden])[:, k]) / np.abs(speed[again])
    onward = np.sign(tangents[1][again]) * np.sign(
        hidden[-1] - hidden[0]
    )  # tangents may point against the order of the points
    step[again] = np.where(np.isfinite(room), room, 0.0) * onward
    return controls + step[:, None] * tangents[0], hidden + step * tangents[1], limit + step * tangents[2]


def bends(coordinate: Floats, values: Floats) -> Floats:
    """Slopes (K, ...) of columns by splines, from kink to kink."""
    cuts = [0, *(np.flatnonzero(np.diff(coordinate) < 10 * APART * np.ptp(coordinate)) + 1), coordinate.size]
    parts = [_bend(coordinate[a:b], values[a:b]) for a, b in pairwise(cuts)]
    return np.concatenate(parts)


def _bend(s: Floats, values: Floats) -> Floats:
    return np.zeros_like(values) if s.size < 2 else np.asarray(CubicSpline(s, values).derivative()(s))
