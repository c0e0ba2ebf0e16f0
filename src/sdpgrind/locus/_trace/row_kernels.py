"""Operations on rows by loops: numba compiles array expressions and their shape checks for seconds."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _copied(row, out):
    """Copy a row into the beginning of `out`."""
    for k in range(row.size):
        out[k] = row[k]


@compiled(error_model="numpy")
def _ahead(start, length, direction, out):
    """Fill `out` with start + length * direction."""
    for k in range(out.size):
        out[k] = start[k] + length * direction[k]


@compiled(inline="always")
def _hermite(u, span):
    """Return the cubic Hermite basis at the share `u` of an interval: value and slope at each end."""
    return (1 + 2 * u) * (1 - u) ** 2, u * (1 - u) ** 2 * span, u * u * (3 - 2 * u), u * u * (u - 1) * span


@compiled(error_model="numpy")
def _dot(a, b):
    """Return the scalar product."""
    total = 0.0
    for k in range(a.size):
        total += a[k] * b[k]
    return total


@compiled(error_model="numpy")
def _farthest(a, b):
    """Return the greatest absolute difference; NaN if a difference is NaN."""
    most = 0.0
    for k in range(a.size):
        gap = abs(a[k] - b[k])
        if np.isnan(gap):
            return gap
        most = max(most, gap)
    return most


@compiled(error_model="numpy")
def _made_unit(row):
    """Scale a row to length 1."""
    length = np.sqrt(_dot(row, row))
    for k in range(row.size):
        row[k] /= length
