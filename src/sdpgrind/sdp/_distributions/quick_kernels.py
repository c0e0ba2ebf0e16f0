"""Compiled kernels of `quick`: partial moments of many laws on a line, and weights of hat functions."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import REORDER, compiled

NARROWEST = 1e-100  # chosen: sd of the logarithm below which a log-normal law is a point mass


class UnitTable(NamedTuple):
    """E((u - U)+) and E((U - u)+) of a unit law U by cells of u.

    `under[cell, n]`, `over[cell, n]`: series in powers of the distance from the cell's centre. Distances are
    in cells, of which there are `cells` a unit, from `low` on. `mean` is that of U.
    """

    under: Any
    over: Any
    low: float
    cells: float
    mean: float


@compiled(fastmath=REORDER)
def _moment(t, series):
    """Value at the position t, cells, which is in the table."""
    cell = int(t)
    d = t - cell - 0.5
    total = series[cell, 6]
    for n in range(5, -1, -1):
        total = total * d + series[cell, n]
    return total


@compiled(fastmath=REORDER)
def _slope(t, series):
    """Derivative, a cell, at the position t, cells, which is in the table."""
    cell = int(t)
    d = t - cell - 0.5
    total = 6.0 * series[cell, 6]
    for n in range(5, 0, -1):
        total = total * d + n * series[cell, n]
    return total


@compiled(fastmath=REORDER)
def _below(t, table):
    """P(U <= u) at the position t, cells."""
    if not t > 0.0:
        return 0.0
    return 1.0 if t >= table.under.shape[0] else _slope(t, table.under) * table.cells


@compiled(fastmath=REORDER)
def _above(t, table):
    """P(U > u) at the position t, cells."""
    if not t > 0.0:
        return 1.0
    return 0.0 if t >= table.over.shape[0] else -_slope(t, table.over) * table.cells


@compiled(fastmath=REORDER)
def _placed_position(y, location, scale, table):
    """Position, cells, of y for ``location + scale U``; of a point mass: before or behind the table."""
    if scale > 0.0:
        return (y - location) * (table.cells / scale) - table.low * table.cells
    return np.inf if y >= location else -1.0


@compiled(fastmath=REORDER)
def _placed_moment(y, mean, scale, t, table, over):
    """E((y - D)+), or with `over` E((D - y)+), at the position t."""
    if not t > 0.0:
        return mean - y if over else 0.0
    if t >= table.under.shape[0]:
        return 0.0 if over else y - mean
    return scale * _moment(t, table.over if over else table.under)


@compiled(fastmath=REORDER)
def placed(y, location, scale, table, probability, over, out):
    """Fill out[law, k] for laws ``location + scale U`` with E((y - D)+) or P(D <= y), or those of `over`."""
    for law in range(location.size):
        q, mean = scale[law], location[law] + scale[law] * table.mean
        for k in range(y.size):
            t = _placed_position(y[k], location[law], q, table)
            if probability:
                out[law, k] = _above(t, table) if over else _below(t, table)
            else:
                out[law, k] = _placed_moment(y[k], mean, q, t, table, over)


@compiled(fastmath=REORDER)
def _log_position(y, log_y, mean, log_mean, s, table):
    """Position, cells, of y for a log-normal law; of a point mass: before or behind the table."""
    if s > NARROWEST:
        return (log_y - log_mean) * (table.cells / s) + (0.5 * s - table.low) * table.cells
    return np.inf if y >= mean else -1.0


@compiled(fastmath=REORDER)
def _log_moment(y, mean, s, t, table, over):
    """E((y - D)+), or with `over` E((D - y)+), of a log-normal law at the position t."""
    if not y > 0.0:
        return mean - y if over else 0.0
    if over:
        return max(mean * _above(t - s * table.cells, table) - y * _above(t, table), 0.0)
    return max(y * _below(t, table) - mean * _below(t - s * table.cells, table), 0.0)


@compiled(fastmath=REORDER)
def log_normal(y, logs, mean, sigma, table, probability, over, out):
    """Fill out[law, k] as `placed` does, for log-normal laws; `logs`: of y, -inf where y <= 0."""
    for law in range(mean.size):
        s, m = sigma[law], mean[law]
        log_m = np.log(m) if m > 0.0 else -np.inf
        for k in range(y.size):
            t = _log_position(y[k], logs[k], m, log_m, s, table)
            if probability:
                out[law, k] = _above(t, table) if over else _below(t, table)
            else:
                out[law, k] = _log_moment(y[k], m, s, t, table, over)


@compiled(fastmath=REORDER)
def _reached(x, place, low, high):
    """First node that an amount from low to high reaches from x, and the one after the last."""
    nodes = place.size - 2
    first = np.searchsorted(place, x - high) - 2
    last = np.searchsorted(place, x - low) + 1
    return min(max(first, 0), nodes), min(max(last, 0), nodes)


@compiled(fastmath=REORDER)
def _differences(under, over, x, place, mean, begin, end, out):
    """Fill the weights of nodes from second differences: of `under` below the mean, of `over` above it."""
    for node in range(begin, end):
        c = under if x - place[node + 1] <= mean else over
        right = (c[node + 2] - c[node + 1]) / (place[node + 2] - place[node + 1])
        out[node] = right - (c[node + 1] - c[node]) / (place[node + 1] - place[node])


@compiled(fastmath=REORDER)
def placed_hats(x, place, location, scale, table, out):
    """Fill out[p, node] with weights of hat functions after the fall of x[p] by its law; zeros elsewhere."""
    under, over = np.empty(place.size), np.empty(place.size)
    for p in range(x.size):
        q, mean = scale[p], location[p] + scale[p] * table.mean
        low = location[p] + q * table.low
        begin, end = _reached(x[p], place, low, low + q * table.under.shape[0] / table.cells)
        for k in range(begin, end + 2):
            y = x[p] - place[k]
            t = _placed_position(y, location[p], q, table)
            if x[p] - place[min(k + 1, end + 1)] <= mean:
                under[k] = _placed_moment(y, mean, q, t, table, False)
            if x[p] - place[max(k - 1, begin)] > mean:
                over[k] = _placed_moment(y, mean, q, t, table, True)
        _differences(under, over, x[p], place, mean, begin, end, out[p])


@compiled(fastmath=REORDER)
def log_normal_hats(x, place, mean, sigma, table, out):
    """Fill out[p, node] as `placed_hats` does, for log-normal laws."""
    under, over = np.empty(place.size), np.empty(place.size)
    for p in range(x.size):
        s, m = sigma[p], mean[p]
        log_m = np.log(m) if m > 0.0 else -np.inf
        reach, shift = s * table.under.shape[0] / (2.0 * table.cells), 0.5 * s * s
        begin, end = _reached(x[p], place, m * np.exp(-reach - shift), m * np.exp(reach - shift))
        for k in range(begin, end + 2):
            y = x[p] - place[k]
            t = _log_position(y, np.log(y) if y > 0.0 else -np.inf, m, log_m, s, table)
            if x[p] - place[min(k + 1, end + 1)] <= m:
                under[k] = _log_moment(y, m, s, t, table, False)
            if x[p] - place[max(k - 1, begin)] > m:
                over[k] = _log_moment(y, m, s, t, table, True)
        _differences(under, over, x[p], place, m, begin, end, out[p])
