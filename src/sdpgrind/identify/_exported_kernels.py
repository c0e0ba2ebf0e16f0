"""Steps of the recursive estimators as exports have them: at most `MOST` values, numbers one by one."""

from math import isnan, sqrt

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify._triangle_kernels import triangle_step, triangle_told
from sdpgrind.identify.kernels import measure, walk_step

MOST = 8  # chosen: values of an exported estimator; more are rare


@compiled(error_model="numpy")
def _fill(out, given):
    """Fill `out` by the first of the numbers given."""
    for k in range(out.size):
        out[k] = given[k]


@compiled(error_model="numpy")
def exported_row(state, law, target, keep, a, b, c, d, e, f, g, h, out):
    """Add a row of regressors a, b, ...; fill `out`: values, then their standard deviations.

    `law`: `TriangleLaw`; `keep`: weight that the rows before keep; NaN: that of the law.
    Return 0: determined, 1: not.
    """
    size = law.size
    entry = np.empty(size + 1)
    _fill(entry[:size], (a, b, c, d, e, f, g, h))
    entry[size] = target
    triangle_step(state, size, law.power, entry, law.forgetting if isnan(keep) else keep)
    if triangle_told(state, law, out[:size], out[size:]):
        return 0
    return 1


@compiled(error_model="numpy")
def exported_walk(state, size, walk, noise, unit, a, b, c, d, e, f, g, h, out):
    """Let the values walk, then correct them by the reading of each, a, b, ...; NaN: none.

    Fill `out`: values, then their standard deviations. State: values (p,), covariance (p, p), and 1 where a
    value is known (p,). Return 0: all known, 1: not.
    """
    value, covariance = state[:size], state[size : size + size * size].reshape(size, size)
    kept, known = state[size + size * size :], np.empty(size, dtype=np.bool_)
    readings, innovation, spread, gain = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    _fill(readings, (a, b, c, d, e, f, g, h))
    for k in range(size):
        known[k] = kept[k] != 0.0
    walk_step(value, covariance, known, walk, readings, unit, noise, innovation, spread, gain)
    count = 0
    for k in range(size):
        out[k], out[size + k] = value[k], np.inf
        if known[k]:
            out[size + k], kept[k] = sqrt(max(covariance[k, k], 0.0)), 1.0
            count += 1
    if count < size:
        return 1
    return 0


@compiled(error_model="numpy")
def exported_walk_of_row(state, size, walk, noise, reading, a, b, c, d, e, f, g, h, out):
    """Let the values walk, then correct them by the reading of their combination a, b, ...; NaN: none.

    All are known. State: values (p,), covariance (p, p). What `walk_step` does with one row.
    """
    value, covariance = state[:size], state[size:].reshape(size, size)
    row, gain = np.empty(size), np.empty(size)
    _fill(row, (a, b, c, d, e, f, g, h))
    for k in range(size):
        covariance[k, k] += walk[k]
    if not isnan(reading):
        measure(value, covariance, row, reading, noise, gain)
    for k in range(size):
        out[k], out[size + k] = value[k], sqrt(max(covariance[k, k], 0.0))
    return 0
