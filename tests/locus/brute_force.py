"""Constrained minimisation by brute force, and conditions of a best point by finite differences: nothing of
the tracer in it.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import minimize

TICKS = {1: 2001, 2: 161, 3: 41, 4: 17}
"""Of the grid, for each control."""
STEP = 2.0**-26  # of differences, in places: the root of rounding


def named(keys, values):
    return SimpleNamespace(**dict(zip(keys, values, strict=True)))


def evaluated(problem, controls, hidden):
    """Cost (...) and response - limit (m, ...) at controls (n, ...) and hidden states (h,), in the user's
    units, by numpy.
    """
    s, c = named(problem.hidden_names, hidden), named(problem.names, controls)
    shape = np.broadcast_shapes(*(np.shape(value) for value in controls))
    parts = [problem.objective(s, c), *(one.response(s, c) - one.limit(s, c) for one in problem.varying)]
    cost, *excess = (np.broadcast_to(np.asarray(part, dtype=float), shape) for part in parts)
    return cost, np.array(excess).reshape(-1, *shape)


def spans(problem):
    return np.array(list(problem.controls.values()), dtype=float).T


def grid(problem, ticks=None):
    """Places 0..1 (n, k) of a grid, and its shape."""
    n = len(problem.names)
    ticks = TICKS[n] if ticks is None else ticks
    axes = np.meshgrid(*[np.linspace(0.0, 1.0, ticks)] * n, indexing="ij")
    return np.array([axis.ravel() for axis in axes]), (ticks,) * n


def value_of(problem, places):
    """Controls of places; ranges that are positive and wide are taken by their logarithms."""
    return valued(problem, np.ndim(places))(places)


def valued(problem, ndim):
    """`value_of` for places of so many dimensions."""
    low, high = spans(problem)
    shape = (-1,) + (1,) * (ndim - 1)
    low, high = low.reshape(shape), high.reshape(shape)
    wide = (low > 0) & (high > 20 * np.abs(low))
    ratio = np.where(wide, high / np.where(wide, low, 1.0), 1.0)
    return lambda places: np.where(wide, low * ratio**places, low + places * (high - low))


def local_minima(values):
    """Indices (flat) of finite values of a grid that are no greater than any neighbour's, best first."""
    padded = np.pad(values, 1, constant_values=np.inf)
    inner = tuple(slice(1, -1) for _ in values.shape)
    best = np.isfinite(values)
    for axis in range(values.ndim):
        for step in (-1, 1):
            best &= values <= np.roll(padded, step, axis)[inner]
    found = np.flatnonzero(best)
    return found[np.argsort(values.ravel()[found], kind="stable")]


def kept_last(function):
    """The minimiser asks for a cost and for limits at each of its points, one after the other: found once."""
    known = {}

    def found(q):
        key = q.tobytes()
        if key not in known:
            known.clear()
            known[key] = function(q)
        return known[key]

    return found


def least(problem, *hidden, starts=6, ticks=None, tolerance=1e-8):
    """Least cost and its controls for hidden states: a grid, polished from its best places; (inf, None):
    nothing is feasible.
    """
    places, shape = grid(problem, ticks)
    with np.errstate(all="ignore"):
        cost, excess = evaluated(problem, value_of(problem, places), hidden)
    scales = np.array([np.ptp(e[np.isfinite(e)]) or 1.0 for e in excess]) if len(excess) else np.ones(0)
    size = np.ptp(cost[np.isfinite(cost)]) or 1.0
    feasible = np.isfinite(cost) & np.all(excess <= 0, axis=0)
    worst = np.max(np.maximum(excess, 0) / scales[:, None], axis=0, initial=0.0)
    chosen = local_minima(np.where(feasible, cost, np.inf).reshape(shape))[:starts]
    chosen = [*chosen, *local_minima(np.where(np.isfinite(cost), worst, np.inf).reshape(shape))[:2]]
    best, where = np.inf, None
    if np.any(feasible):
        k = int(np.argmin(np.where(feasible, cost, np.inf)))
        best, where = float(cost[k]), value_of(problem, places[:, k])

    s, values, many = named(problem.hidden_names, hidden), valued(problem, 1), valued(problem, 2)

    @kept_last
    def scaled(q):
        """Cost and excess."""
        c = named(problem.names, values(q))
        over = [float(one.response(s, c) - one.limit(s, c)) for one in problem.varying]
        return float(problem.objective(s, c)) / size, np.array(over) / scales

    @kept_last
    def slopes(q):
        """Of cost and excess, by forward differences, away from a bound."""
        steps = np.where(q + STEP > 1.0, -STEP, STEP)
        beside = q[:, None] + np.column_stack([np.zeros(len(q)), np.diag(steps)])
        costs, over = evaluated(problem, many(beside), hidden)
        return (costs[1:] - costs[0]) / size / steps, (over[:, 1:] - over[:, :1]) / scales[:, None] / steps

    kept = {"type": "ineq", "fun": lambda q: -scaled(q)[1], "jac": lambda q: -slopes(q)[1]}
    for k in chosen:
        with np.errstate(all="ignore"):
            found = minimize(
                lambda q: scaled(q)[0],
                np.clip(places[:, k], 1e-6, 1 - 1e-6),
                method="SLSQP",
                jac=lambda q: slopes(q)[0],
                bounds=[(0.0, 1.0)] * len(shape),
                constraints=kept if len(scales) else (),
                options={"ftol": 1e-14, "maxiter": 200},
            )
            q = np.clip(found.x, 0.0, 1.0)
            c, e = scaled(q)
        if np.all(e <= tolerance) and c * size < best:
            best, where = c * size, value_of(problem, q)
    return best, where
