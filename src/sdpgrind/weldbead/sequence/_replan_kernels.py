"""Compiled stages of a replan: expected costs of all levels of all durations, and the least of each.

Rows are levels of one duration after another. `weight[row, k]` is the weight of a cut of k cells, to nodes
above the target; `charge[row, node]` what the pass costs and overgrinds. At the target the value is 0.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import REORDER, compiled

TOGETHER = 4  # lags of one sweep over the nodes; measured: four times as fast as one by one
NONE = 1e-14  # chosen: weight of lags that is left out; rounding of the differences that give weights is more


@compiled
def stages(weight, charge, force, steps, count, stop):
    """Return costs ($) and forces (N) of the first pass by each duration, at the last node.

    `force[duration, level]`, N; `steps`: stages of the durations, rising; `count`: stages left; `stop[node]`:
    charge of stopping, $.
    """
    durations, nodes = steps.size, stop.size
    reached = np.full((count + 1, durations, nodes), np.inf)  # [stages left before the pass, ...]
    cost, chosen = np.full(durations, np.inf), np.full(durations, np.nan)
    expected = np.empty(charge.shape)
    for left in range(count + 1 - steps[0]):
        _expect(weight, charge, _value(reached[left], stop), expected)
        for k in range(durations):
            before = left + steps[k]
            if before == count:
                cost[k], chosen[k] = _least(expected, k, force[k], nodes - 1)
            elif before < count:
                for node in range(nodes):
                    reached[before, k, node] = _least(expected, k, force[k], node)[0]
    return cost, chosen


@compiled
def _value(reached, stop):
    """Return the least cost at the nodes: of stopping, or of a pass by any duration."""
    value = stop.copy()
    for k in range(reached.shape[0]):
        for node in range(stop.size):
            value[node] = min(value[node], reached[k, node])
    return value


@compiled(fastmath=REORDER)
def _expect(weight, charge, value, out):
    """Fill out[row, node] with the charge and the expected value after the pass."""
    rows, nodes = charge.shape
    padded = np.zeros(nodes + TOGETHER)
    for node in range(1, nodes):  # loops: an array put into a slice compiles the text of its shape error
        padded[TOGETHER + node] = value[node]
    for row in range(rows):
        for node in range(nodes):
            out[row, node] = charge[row, node]
        for k in range(0, nodes, TOGETHER):
            a, b, c, d = weight[row, k : k + TOGETHER]
            if a + b + c + d <= NONE:
                continue
            here = out[row, k:]  # slices from 0 on vectorise
            v, w, x, y = padded[4:], padded[3:], padded[2:], padded[1:]
            for node in range(here.size):
                here[node] += a * v[node] + b * w[node] + c * x[node] + d * y[node]


@compiled
def _least(expected, duration, force, node):
    """Return the least cost ($) of a duration at a node and its force (N), by a parabola through levels.

    None goes through the first level, which removes nothing: the cost jumps there.
    """
    levels = force.size
    first = duration * levels
    best = 0
    for level in range(1, levels):
        if expected[first + level, node] < expected[first + best, node]:
            best = level
    cost, at = expected[first + best, node], force[best]
    if best < 2 or best == levels - 1:
        return cost, at
    low, high = force[best - 1] - at, force[best + 1] - at
    left = (expected[first + best - 1, node] - cost) / low
    right = (expected[first + best + 1, node] - cost) / high
    curved = (right - left) / (high - low)
    if curved <= 0.0:
        return cost, at
    slope = left - curved * low
    step = min(max(-slope / (2 * curved), low), high)
    return cost + step * (slope + curved * step), at + step
