"""Joints and their derivatives along a run, from the polynomials of its spline."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled
def _piece_at(breaks, place, hint):
    """Index of the piece with a place; `hint` is tried first."""
    last = breaks.size - 2
    if breaks[hint] <= place < breaks[hint + 1]:
        return hint
    if hint < last and breaks[hint + 1] <= place < breaks[hint + 2]:
        return hint + 1
    return min(max(np.searchsorted(breaks, place, side="right") - 1, 0), last)


@compiled
def _derivatives(polynomial, x, out):
    """Value and three derivatives of every joint, out (4, n), of polynomials (6, n) at x from their start."""
    c = polynomial
    for i in range(c.shape[1]):
        out[0, i] = c[0, i] + x * (c[1, i] + x * (c[2, i] + x * (c[3, i] + x * (c[4, i] + x * c[5, i]))))
        out[1, i] = c[1, i] + x * (2 * c[2, i] + x * (3 * c[3, i] + x * (4 * c[4, i] + x * 5 * c[5, i])))
        out[2, i] = 2 * c[2, i] + x * (6 * c[3, i] + x * (12 * c[4, i] + x * 20 * c[5, i]))
        out[3, i] = 6 * c[3, i] + x * (24 * c[4, i] + x * 60 * c[5, i])


@compiled
def evaluate(breaks, polynomials, places, out):
    """Fill out (m, 4, n) with values and derivatives at places (m,)."""
    piece = 0
    for k in range(places.size):
        piece = _piece_at(breaks, places[k], piece)
        _derivatives(polynomials[piece], places[k] - breaks[piece], out[k])
