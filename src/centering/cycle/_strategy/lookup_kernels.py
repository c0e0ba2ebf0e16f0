"""Compiled look-up of a push: kind and share of the nearest node, stroke for the exact state."""

import numpy as np

from centering.cycle._strategy.draw_kernels import table_speed
from centering.cycle._strategy.outcome_kernels import stroke_for
from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _place(axes, offset, friction):
    """Cells of an offset (mm) and a friction scale; `axes` = (log low, log step, nodes, low, step, nodes)."""
    i = min(max((np.log(offset) - axes[0]) / axes[1], 0.0), axes[2] - 1.0)
    return i, min(max((friction - axes[3]) / axes[4], 0.0), axes[5] - 1.0)


@compiled(error_model="numpy")
def value_at(value, axes, offset, friction, pushes):
    """Expected time (s), bilinear in log offset and friction scale."""
    i, j = _place(axes, offset, friction)
    a, b = min(int(i), value.shape[1] - 2), min(int(j), value.shape[2] - 2)
    x, y = i - a, j - b
    v = value[pushes]
    return (1 - x) * ((1 - y) * v[a, b] + y * v[a, b + 1]) + x * ((1 - y) * v[a + 1, b] + y * v[a + 1, b + 1])


@compiled(error_model="numpy")
def choose(policy, outcomes, speeds, axes, offset, friction, pushes):
    """Kind, aim (mm), stroke (mm), table speed (rad/s) of the best push; `policy`: kind, share of offset.

    Kind -1: the state is not a number, and no place in a table.
    """
    if np.isnan(offset) or np.isnan(friction):  # guard of exports: their ranges keep it out
        return -1, np.nan, np.nan, np.nan
    i, j = _place(axes, offset, friction)
    a, b = int(np.rint(i)), int(np.rint(j))
    kind, aim = policy[0][pushes, a, b], policy[1][pushes, a, b] * offset
    last, grid = outcomes[2][kind], outcomes[3]
    stroke = min(stroke_for(outcomes[1][kind], grid, last, friction, aim), np.exp(grid[0] + grid[1] * last))
    return kind, aim, stroke, table_speed(speeds, (axes[0], axes[1]), offset)
