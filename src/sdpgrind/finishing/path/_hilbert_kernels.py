"""Nodes of a Hilbert curve by their index, two bits at a time."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# States of a curve: from the corner (0, 0) to (1, 0), that mirrored in the diagonal, and both turned by 180
# degrees. By state and quarter: place of the quarter (2 x + y), and state of the curve in it.
_PLACE = np.array([[0, 1, 3, 2], [0, 2, 3, 1], [3, 2, 0, 1], [3, 1, 0, 2]], dtype=np.uint8)
_STATE = np.array([[1, 0, 0, 3], [0, 1, 1, 2], [3, 2, 2, 1], [2, 3, 3, 0]], dtype=np.uint8)


@compiled
def nodes_by_index(order, out):
    """Write the 4^order nodes into `out` (4^order, 2): from (0, 0) to (2^order - 1, 0)."""
    for index in range(out.shape[0]):
        state, x, y = 0, 0, 0
        for level in range(order - 1, -1, -1):
            quarter = (index >> (2 * level)) & 3
            place = _PLACE[state, quarter]
            x, y = 2 * x + (place >> 1), 2 * y + (place & 1)
            state = _STATE[state, quarter]
        out[index, 0], out[index, 1] = x, y
