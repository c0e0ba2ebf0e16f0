"""Likelihood of the readings of a push over a fine grid of frictions, from predictions at a few nodes."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled
def log_likelihood(found, doubt, nodes, cells, read, noise_sd, error, farthest, out):
    """Write the log-likelihood at each place of the grid, (p, r); return the least misfit, squared sds.

    `found`, `doubt`, (n, m, 3): peak force (N), free slide, final position (mm) at the nodes, and their
    standard deviations between nodes. `nodes`, `cells`, (2, 2): first place and step of scale and ratio, of
    nodes and grid; step 0: one node. `read`, `noise_sd`, (3,): readings (NaN: none) and their standard
    deviations. `error`: relative error of predictions; of the final position only beyond `farthest` (mm), the
    travel of the tip.
    """
    nearest = np.inf
    for i in range(out.shape[0]):
        a, along = _cell(cells[0, 0] + i * cells[0, 1], nodes[0], found.shape[0])
        for j in range(out.shape[1]):
            b, across = _cell(cells[1, 0] + j * cells[1, 1], nodes[1], found.shape[1])
            miss, spread = 0.0, 0.0
            for q in range(3):
                if np.isnan(read[q]):
                    continue
                value, rise, slant = _patch(found, a, b, q, along, across)
                vague = _patch(doubt, a, b, q, along, across)[0]
                slid = value - farthest if q == 2 else value
                inside = (
                    _step(cells[0, 1], nodes[0, 1], rise) ** 2 + _step(cells[1, 1], nodes[1, 1], slant) ** 2
                )
                variance = noise_sd[q] ** 2 + (error * slid) ** 2 + vague**2 + inside / 12.0
                miss += (read[q] - value) ** 2 / variance
                spread += np.log(variance)
            out[i, j] = -0.5 * (miss + spread)
            nearest = min(nearest, miss)
    return nearest


@compiled
def _cell(place, axis, count):
    """Node to the left, and the share of the way to the next one; held at the ends."""
    if count == 1 or axis[1] == 0.0:
        return 0, 0.0
    at = min(max((place - axis[0]) / axis[1], 0.0), count - 1.0)
    left = min(int(at), count - 2)
    return left, at - left


@compiled
def _patch(values, a, b, q, along, across):
    """Value within four nodes, and its changes from node to node in both directions."""
    c, d = min(a + 1, values.shape[0] - 1), min(b + 1, values.shape[1] - 1)
    low = values[a, b, q] + along * (values[c, b, q] - values[a, b, q])
    high = values[a, d, q] + along * (values[c, d, q] - values[a, d, q])
    near = values[a, b, q] + across * (values[a, d, q] - values[a, b, q])
    far = values[c, b, q] + across * (values[c, d, q] - values[c, b, q])
    return low + across * (high - low), far - near, high - low


@compiled
def _step(cell, node, change):
    """Change over a cell of the grid."""
    return change * cell / node if node > 0.0 else 0.0
