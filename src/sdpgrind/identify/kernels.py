"""Recursive least squares and Kalman filter for compiled loops: plain arrays, in place, without allocation.

Square-root form: one array ``[R | Q]`` of shape (p, p + k) holds the triangle R of all rows so far and its
right-hand sides Q; R'R is the information, and R value = Q[:, 0] the least-squares solution. One row is::

    array *= sqrt(forgetting)          # the weight, in (0, 1], that older rows keep
    row[:] = ...                       # regressors, then targets, shape (p + k,)
    variance = spread(array, row, work)         # of the prediction h'value, if the noise's is 1
    rotate(array, row)                          # row[p]**2 adds to the sum of squared residuals
    solve(array, value); inverse(array, inv_info)

Covariance form: `covariance_step`, or for a known noise Kalman's correction `measure`; `walk_step` is one
step of a Kalman filter of random walks.
"""

from math import inf, isnan, nan, sqrt

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def rotate(array, row):
    """Add one row to the triangle, in place, by Givens rotations.

    Parameters
    ----------
    array : array, shape (p, p + k)
        Triangle and right-hand sides, ``[R | Q]``; entries below R's diagonal are not used. All zero: no rows
        yet.
    row : array, shape (p + k,)
        Regressors and targets, times the square root of the weight. Overwritten: ``row[p:]`` becomes the part
        that no value explains; its square adds to the sum of squared residuals.
    """
    size, width = array.shape
    for i in range(size):
        pivot, entry = array[i, i], row[i]
        square = pivot * pivot + entry * entry
        if entry == 0.0 or square == 0.0:  # guard
            continue
        inverse = 1.0 / sqrt(square)
        c, s = pivot * inverse, entry * inverse
        for j in range(i, width):
            above, below = array[i, j], row[j]
            array[i, j] = c * above + s * below
            row[j] = c * below - s * above


@compiled(error_model="numpy")
def solve(array, out):
    """Write the least-squares solution of the first right-hand side into `out` (p,); 0 where a pivot is 0."""
    back_substitute(array, array.shape[0], out)


@compiled(error_model="numpy")
def back_substitute(array, column, out):
    """Write the solution of the triangle for any of its columns into `out` (p,); 0 where a pivot is 0."""
    size = out.shape[0]
    for i in range(size - 1, -1, -1):
        rest = array[i, column]
        for j in range(i + 1, size):
            rest -= array[i, j] * out[j]
        out[i] = rest / array[i, i] if array[i, i] != 0.0 else 0.0  # guard


@compiled(error_model="numpy")
def spread(array, row, work):
    """Return ``h' (R'R)^-1 h``, h = ``row[:p]``: variance of the prediction of a row for noise of variance 1.

    Infinite until the rows determine all values. `work`, shape (p,), is scratch space.
    """
    total = 0.0
    for i in range(array.shape[0]):
        rest = row[i]
        for j in range(i):
            rest -= array[j, i] * work[j]
        if array[i, i] == 0.0:
            return inf
        work[i] = rest / array[i, i]
        total += work[i] * work[i]
    return total


@compiled(error_model="numpy")
def inverse(array, out):
    """Write ``(R'R)^-1`` into `out`, shape (p, p); where R is singular, inf on the diagonal and 0 off it."""
    size = array.shape[0]
    for i in range(size - 1, -1, -1):
        if array[i, i] == 0.0:
            _endless(out)
            return
        out[i, i] = 1.0 / array[i, i]
        for j in range(i + 1, size):
            rest = 0.0
            for k in range(i + 1, j + 1):
                rest -= array[i, k] * out[k, j]
            out[i, j] = rest * out[i, i]
    for i in range(size):  # R^-1 times its transpose, in place: no entry is overwritten before its last use
        for j in range(i, size):
            total = 0.0
            for k in range(j, size):
                total += out[i, k] * out[j, k]
            out[i, j] = total
    for i in range(size):
        for j in range(i):
            out[i, j] = out[j, i]


@compiled
def _endless(out):
    out[:] = 0.0
    for i in range(out.shape[0]):
        out[i, i] = inf


@compiled(error_model="numpy")
def measure(value, covariance, row, target, noise_variance, gain):
    """Correct a value and its covariance by one reading ``target = row @ value + noise``, in place (Kalman).

    Parameters
    ----------
    value, covariance : array, shape (p,) and (p, p)
        Estimate and its covariance, kept exactly symmetric.
    row : array, shape (p,)
        Regressors.
    target : float
        Reading.
    noise_variance : float
        Variance of the noise; it and the variance of the prediction are not both 0.
    gain : array, shape (p,)
        Output: Kalman gain.
    """
    size = value.shape[0]
    variance, error = noise_variance, target
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += covariance[i, j] * row[j]
        gain[i] = total
        variance += total * row[i]
        error -= row[i] * value[i]
    scale = 1.0 / variance
    for i in range(size):
        value[i] += gain[i] * (error * scale)
        for j in range(i, size):
            covariance[i, j] -= gain[i] * (gain[j] * scale)
            covariance[j, i] = covariance[i, j]
    for i in range(size):
        gain[i] *= scale


@compiled(error_model="numpy")
def covariance_step(value, inv_info, row, target, forgetting, gain):
    """Add one row to least squares in covariance form, in place: Mears (4.40), corrected, with forgetting.

    `inv_info` is the inverse information (covariance over noise variance), shape (p, p); `forgetting` the
    weight in (0, 1] that earlier rows keep, unit 1; the rest as in `measure`. Directions without new rows
    wind up; `rotate` does not.
    """
    measure(value, inv_info, row, target, forgetting, gain)
    if forgetting != 1.0:
        scale = 1.0 / forgetting
        for i in range(value.shape[0]):
            for j in range(value.shape[0]):
                inv_info[i, j] *= scale


@compiled(error_model="numpy")
def walk_step(value, covariance, known, walk, readings, rows, noise, innovation, innovation_sd, gain):
    """Let the values walk, then correct them by independent readings, in place (Kalman; unit transition).

    Parameters
    ----------
    value, covariance : array, shape (p,) and (p, p)
        Estimate and its covariance; 0 in rows and columns of unknown values.
    known : array of bool, shape (p,)
        Known values. The first reading of an unknown one (a unit row, row k for value k) starts it.
    walk : array, shape (p,)
        Variances of the step.
    readings : array, shape (q,)
        NaN: none.
    rows, noise : array, shape (q, p) and (q,)
        Regressors, and variances of the noise.
    innovation, innovation_sd : array, shape (q,)
        Output: reading minus prediction before all of them, and its standard deviation; NaN and inf if
        unknown.
    gain : array, shape (p,)
        Scratch space.
    """
    size = value.shape[0]
    for i in range(size):
        if known[i]:
            covariance[i, i] += walk[i]
    for k in range(readings.shape[0]):
        expected, variance, told = 0.0, noise[k], True
        for i in range(size):
            if rows[k, i] != 0.0:
                told = told and known[i]
                expected += rows[k, i] * value[i]
                for j in range(size):
                    variance += rows[k, i] * covariance[i, j] * rows[k, j]
        innovation[k] = readings[k] - expected if told else nan
        innovation_sd[k] = sqrt(variance) if told else inf
    for k in range(readings.shape[0]):
        if isnan(readings[k]):
            continue
        if innovation_sd[k] < inf:
            measure(value, covariance, rows[k], readings[k], noise[k], gain)
        else:
            value[k], covariance[k, k], known[k] = readings[k], noise[k], True
