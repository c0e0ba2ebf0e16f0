"""Look up a packed table of values and exact slopes; see `table`."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

INSIDE, BELOW, ABOVE, NO_KEY = range(4)
"""Result of a look-up: key in the table, below or above it (clamped), or NaN."""
# derived: numbers of nodes, columns, guide cells (by their bits); least key; cells per unit of the key
HEAD = 5


@compiled(inline="always")
def _packed_size(n_node, n_column, n_cell):
    """Return the size: head, keys, values and slopes node by node, guide."""
    return HEAD + n_node * (1 + 2 * n_column) + n_cell + 1


@compiled(error_model="numpy")
def pack(key, columns, slopes, n_cell):
    """Pack a table with a rising key; the guide holds, per cell of equal width, the interval at its start."""
    n_node, n_column = columns.shape
    packed = np.empty(_packed_size(n_node, n_column, n_cell))
    whole = packed.view(np.int64)
    whole[0], whole[1], whole[2] = n_node, n_column, n_cell
    scale = n_cell / (key[-1] - key[0])
    packed[3], packed[4] = key[0], scale if scale < np.inf else 0.0  # a range of rounding: one cell
    for k in range(n_node):
        packed[HEAD + k], row = key[k], HEAD + n_node + 2 * n_column * k
        for j in range(n_column):
            packed[row + j], packed[row + n_column + j] = columns[k, j], slopes[k, j]
    guide = whole[HEAD + n_node * (1 + 2 * n_column) :]
    at = 0
    for cell in range(n_cell + 1):
        while at < n_node - 2 and _cell(packed, key[at + 1]) < cell:
            at += 1
        guide[cell] = at
    guide[n_cell] = n_node - 2
    return packed


@compiled(forceinline=True, error_model="numpy")
def _cell(packed, key):
    """Return the cell of a key; equal rounding of nodes and looked-up keys keeps the guide exact."""
    return np.int64((key - packed[3]) * packed[4])


@compiled(error_model="numpy", inline="always")
def _locate(packed, key):
    """Return the interval of a key: guide, then bisection."""
    whole = packed.view(np.int64)
    n_node, n_column = whole[0], whole[1]
    guide = HEAD + n_node * (1 + 2 * n_column)
    cell = min(_cell(packed, key), whole[2] - 1)
    low, high = whole[guide + cell], whole[guide + cell + 1] + 1
    while high - low > 1:  # at most 64
        middle = (low + high) // 2
        if key < packed[HEAD + middle]:
            high = middle
        else:
            low = middle
    return low


@compiled(error_model="numpy")
def look_up(packed, key, out):
    """Fill `out` with the columns at a key, clamped, and return the flag; NaN fills nothing."""
    whole = packed.view(np.int64)
    n_node = whole[0]
    rows = HEAD + n_node
    if packed[HEAD] < key < packed[rows - 1]:
        _interpolate(packed, _locate(packed, key), key, out)
        return INSIDE
    if np.isnan(key):  # guard
        return NO_KEY
    below = key <= packed[HEAD]
    end = 0 if below else n_node - 1
    _take_node(packed, end, out)
    if key == packed[HEAD + end]:
        return INSIDE
    return BELOW if below else ABOVE


@compiled(error_model="numpy")
def look_up_within(packed, key, out):
    """Fill `out` with the columns at a key that lies between the ends of the table, or at one."""
    n_node = packed.view(np.int64)[0]
    if packed[HEAD] < key < packed[HEAD + n_node - 1]:
        _interpolate(packed, _locate(packed, key), key, out)
    else:
        _take_node(packed, 0 if key <= packed[HEAD] else n_node - 1, out)


@compiled(error_model="numpy", inline="always")
def _take_node(packed, k, out):
    """Fill `out` with the columns of node k, bit by bit."""
    whole = packed.view(np.int64)
    n_node, n_column = whole[0], whole[1]
    for j in range(n_column):
        out[j] = packed[HEAD + n_node + 2 * n_column * k + j]


@compiled(error_model="numpy", inline="always")
def _interpolate(packed, k, key, out):
    """Fill `out` with the cubic of interval k."""
    whole = packed.view(np.int64)
    n_node, n_column = whole[0], whole[1]
    width = packed[HEAD + k + 1] - packed[HEAD + k]
    t = (key - packed[HEAD + k]) / width
    at = HEAD + n_node + 2 * n_column * k
    for j in range(n_column):
        value, rise = packed[at + j], packed[at + 2 * n_column + j] - packed[at + j]
        start, end = width * packed[at + n_column + j], width * packed[at + 3 * n_column + j]
        out[j] = value + t * (start + t * (3.0 * rise - 2.0 * start - end + t * (start + end - 2.0 * rise)))


@compiled(error_model="numpy")
def look_up_many(packed, keys, out):
    """Look up keys (k,) into `out` (k, columns); return the index of the first NaN, -1: none."""
    bad = -1
    for k in range(keys.size - 1, -1, -1):
        if look_up(packed, keys[k], out[k]) == NO_KEY:
            bad = k
    return bad


@compiled(error_model="numpy")
def exported_look_up(state, packed, key, out):
    """Fill `out` with the columns at a key; return whether it is inside, below or above; NaN: -1."""
    flag = look_up(packed, key, out)
    return -1 if flag == NO_KEY else flag  # guard
