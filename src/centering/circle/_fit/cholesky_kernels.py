"""Cholesky factor of normal equations."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_TELLS = 0.05  # chosen: least independent share of a column; less makes the solution uncertain


@compiled(error_model="numpy")
def _cholesky(array, size):
    """Write the Cholesky factor of the first columns and the last, in place; return whether it is regular."""
    last = array.shape[1] - 1
    for i in range(size):
        whole = array[i, i]
        for k in range(i):
            array[i, i] -= array[k, i] ** 2
        if not array[i, i] > _TELLS * whole:
            return False
        array[i, i] = np.sqrt(array[i, i])
        for j in range(i + 1, size + 1):
            column = j if j < size else last
            for k in range(i):
                array[i, column] -= array[k, i] * array[k, column]
            array[i, column] /= array[i, i]
    return True
