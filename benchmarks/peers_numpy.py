"""The weld-bead problem in plain numpy, the strongest simple rival: what one would write instead of the library.

It takes the laws and the charges from the problem; weights and induction are its own. The fall of a bead does
not depend on its height, so that a stage is one product of weights with sliding windows of the values.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sdpgrind import weldbead


class Passes(NamedTuple):
    """Passes by duration and force level, and what stopping costs."""

    fall: np.ndarray  # weights of falling by n - 1 to 0 cells, [cells, duration, level]
    bottom: np.ndarray  # weights of ending in the lowest cell, at its node 0, [node, duration, level]
    charge: np.ndarray  # of the pass and of grinding below 0, $, [node, duration, level]
    gone: np.ndarray  # probability of grinding below 0, [node, duration, level]
    late: np.ndarray  # $, [stage], from the latest one on
    stop: np.ndarray  # $, [stage, node]
    stages: np.ndarray  # durations in stages, rising


def assemble(problem: weldbead.SequenceProblem, nodes: int, levels: int) -> Passes:
    """Weights from the laws: second differences of E (y - D)+, beyond the mean of E (D - y)+."""
    x, h = np.linspace(0.0, problem.height_max, nodes, retstep=True)
    y, z = np.arange(-1, nodes + 1)[:, None] * h, x[:, None]
    stages = np.round(np.array(problem.durations) / problem.stage).astype(int)
    window, horizon = (
        round((problem.late_window or 0) / problem.stage),
        round(problem.horizon / problem.stage),
    )
    behind = np.maximum(-np.arange(-window, horizon + 1), 0.0) * problem.stage
    late = (problem.lateness_charge or np.zeros_like)(behind)
    fall, bottom, charge, gone = [], [], [], []
    for seconds in problem.durations:
        force = np.linspace(*problem.force_interval(seconds), levels)
        law = problem.cut(seconds, np.union1d(force, problem.force_breaks(seconds)))
        under, over = law.under(y), law.over(y)
        curve = np.where(y[1:-1] <= law.mean, np.diff(under, 2, axis=0), np.diff(over, 2, axis=0))
        fall.append(curve[::-1] / h)
        gone.append(law.over(z, 0))
        bottom.append((over[:-2] - over[1:-1]) / h - gone[-1])
        charge.append(problem.pass_charge + problem.height_charge.over.expected_over(law, z))
    each = (np.stack(rows, axis=1) for rows in (fall, bottom, charge, gone))
    return Passes(*each, late, problem.height_charge(x) + late[:, None], stages)


def solve(passes: Passes) -> tuple[np.ndarray, np.ndarray]:
    """Values, $, and actions, [stage, node], by backward induction; action 0 stops."""
    fall, bottom, charge, gone, late, stop, stages = passes
    rows, n = stop.shape
    levels, to = bottom.shape[2], np.arange(stages.size) + 1
    cost = np.full((rows + stages[-1], n, stages.size + 1), np.inf)  # of stopping, and of each duration
    action, value = np.zeros(cost.shape, int), np.empty(stop.shape)
    cost[:rows, :, 0] = stop
    above = np.zeros(2 * n - 1)  # nothing lies below node 0, whose weight is `bottom`
    windows, flat = sliding_window_view(above, n), fall.reshape(n, -1)
    for stage in range(rows):  # all passes that end with so much time left, in one product
        value[stage] = cost[stage].min(axis=1)
        above[n:] = value[stage, 1:]
        each = (windows @ flat).reshape(bottom.shape) + (bottom * value[stage, 0] + charge)
        if late[stage]:
            each += gone * late[stage]
        cost[stage + stages, :, to] = each.min(axis=2).T
        action[stage + stages, :, to] = each.argmin(axis=2).T + 1 + (to[:, None] - 1) * levels
    best = cost[:rows].argmin(axis=2)
    return value, np.take_along_axis(action[:rows], best[..., None], axis=2)[..., 0]
