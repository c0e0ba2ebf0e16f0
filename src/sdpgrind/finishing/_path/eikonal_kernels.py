"""Distance from a border in the metric of a surface: |grad d|^2 with the inverse metric = 1, on a grid, by sweeps."""

import numpy as np
from numba import njit

_NEIGHBOURS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
"""Around a node, in order: each with the next spans one of eight triangles."""


@njit(cache=True, nogil=True)
def sweep(E, F, G, d, most):
    """First order, into `d` (n, m), whose finite entries are given: sweeps from all four corners until nothing changes.

    E, F, G (n, m): metric for steps of the grid. Returns how many rounds were needed; `most` + 1: it has not settled.
    """
    n, m = d.shape
    for rounds in range(1, most + 1):
        change = 0.0
        for corner in range(4):
            for a in range(n):
                i = a if corner & 1 == 0 else n - 1 - a
                for b in range(m):
                    j = b if corner & 2 == 0 else m - 1 - b
                    found = nearest(E, F, G, d, i, j, False)
                    if found < d[i, j]:
                        change = max(change, min(d[i, j] - found, 1e300))
                        d[i, j] = found
        if change <= 1e-13:
            return rounds
    return most + 1


@njit(cache=True, nogil=True)
def refine(E, F, G, d, order, fixed, rounds):
    """Second order: nodes once more in the `order` of their distance, from neighbours that are upwind."""
    m = d.shape[1]
    for _ in range(rounds):
        for k in order:
            if not fixed[k]:
                i, j = k // m, k % m
                found = nearest(E, F, G, d, i, j, True)
                if found < np.inf:
                    d[i, j] = found


@njit(cache=True, nogil=True)
def nearest(E, F, G, d, i, j, second):
    """Least distance of a node by way of one of its eight triangles, or along one of its eight edges."""
    n, m = d.shape
    e, f, g = E[i, j], F[i, j], G[i, j]
    own, best = d[i, j], np.inf
    for k in range(8):
        a0, a1 = _NEIGHBOURS[k]
        if not (0 <= i + a0 < n and 0 <= j + a1 < m):
            continue
        wa, ra = _one_sided(d, i, j, a0, a1, own, second)
        if ra == np.inf:
            continue
        along = np.sqrt(e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1)
        best = min(best, (along + ra) / wa)
        b0, b1 = _NEIGHBOURS[(k + 1) % 8]
        if 0 <= i + b0 < n and 0 <= j + b1 < m:
            wb, rb = _one_sided(d, i, j, b0, b1, own, second)
            if rb < np.inf:
                best = min(best, _through(e, f, g, a0, a1, b0, b1, wa, ra, wb, rb))
    return best


@njit(cache=True, nogil=True)
def _one_sided(d, i, j, a0, a1, own, second):
    """Weight w and rest r of the slope towards a neighbour, w d - r: (3 d - 4 d1 + d2)/2 where d2 is upwind, else d - d1."""
    near = d[i + a0, j + a1]
    if second:
        if near >= own:
            return 1.0, np.inf  # downwind of what is known already
        p, q = i + 2 * a0, j + 2 * a1
        if 0 <= p < d.shape[0] and 0 <= q < d.shape[1] and d[p, q] < near:
            return 1.5, 2.0 * near - 0.5 * d[p, q]
    return 1.0, near


@njit(cache=True, nogil=True)
def _through(e, f, g, a0, a1, b0, b1, wa, ra, wb, rb):
    """Distance d whose slopes towards two neighbours fit a gradient of length 1 that comes from between them; else inf.

    With the steps x_a, x_b towards the node and slopes s = w d - r, the gradient p has p.x = s, and p.M^-1.p = s.N^-1.s = 1
    with N the products of the steps in the metric. N^-1 s are the shares of the steps in the way that it comes.
    """
    aa = e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1
    ab = e * a0 * b0 + f * (a0 * b1 + a1 * b0) + g * a1 * b1
    bb = e * b0 * b0 + 2.0 * f * b0 * b1 + g * b1 * b1
    det = aa * bb - ab * ab
    square = bb * wa * wa - 2.0 * ab * wa * wb + aa * wb * wb
    mixed = bb * wa * ra - ab * (wa * rb + wb * ra) + aa * wb * rb
    rest = bb * ra * ra - 2.0 * ab * ra * rb + aa * rb * rb - det
    inside = mixed * mixed - square * rest
    if inside < 0.0:
        return np.inf
    found = (mixed + np.sqrt(inside)) / square
    sa, sb = wa * found - ra, wb * found - rb
    if bb * sa - ab * sb < 0.0 or aa * sb - ab * sa < 0.0:
        return np.inf
    return found
