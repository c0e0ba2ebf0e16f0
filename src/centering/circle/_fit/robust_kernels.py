"""Kernels of the robust fit: least-median circle through three readings, outliers removed, rest weighted."""

import numpy as np

from centering.circle._fit import fit_kernels as fit
from sdpgrind.base.compiling.compiled import compiled

HUBER, SOFT_L1 = range(1, 3)
BEND = 1.345  # source: Huber; residual over scale from which weights fall, 95 % efficient for normal noise
NORMAL = 1.4826022185056018  # derived: normal sd over the median absolute value
FAR = 6.0  # chosen: scales beyond which a reading is left out; dust only adds, and would bias the radius
FEW = 20  # chosen: below it none is left out: the circle through three would make the others outliers
LEAST, CHANGING = 4, 15  # chosen: least steps; steps in which scale and selection may change


@compiled(error_model="numpy")
def _through(data, triple, circle):
    """Write the circle through three readings; return whether it exists and contains the axis."""
    a, b, c = triple[0], triple[1], triple[2]
    ax, ay = data[2, a] * data[0, a], data[2, a] * data[1, a]
    bx, by = data[2, b] * data[0, b] - ax, data[2, b] * data[1, b] - ay
    cx, cy = data[2, c] * data[0, c] - ax, data[2, c] * data[1, c] - ay
    area = 2.0 * (bx * cy - by * cx)
    if area == 0.0:
        return False
    bb, cc = bx * bx + by * by, cx * cx + cy * cy
    x, y = (cy * bb - by * cc) / area, (bx * cc - cx * bb) / area
    circle[0], circle[1], circle[2] = np.hypot(x, y), ax + x, ay + y
    return fit._holds_axis(circle)


@compiled(error_model="numpy")
def _least_median(data, triples, circle):
    """Write the circle through one of the triples of least median residual; return that, inf for none."""
    m, best = data.shape[1], np.inf
    trial, left = np.empty(3), np.empty(m)
    half = min(m // 2 + 1, m - 1)  # three readings lie on the circle itself
    for k in range(triples.shape[0]):
        if not (_through(data, triples[k], trial) and fit._residuals(data, trial, left)):
            continue
        nearer = 0
        for i in range(m):
            left[i] = abs(left[i])
            nearer += left[i] < best
        if nearer > half:
            best = fit._ranked(left, half)
            circle[0], circle[1], circle[2] = trial[0], trial[1], trial[2]
    return best


@compiled(error_model="numpy")
def _sifted(left, scale, kept):
    """Mark the readings within `FAR` scales, or all if few; return the sd from their median residual."""
    m, near, count = kept.size, np.empty(kept.size), 0
    for i in range(m):
        kept[i] = m < FEW or abs(left[i]) <= FAR * scale
        if kept[i]:
            near[count] = abs(left[i])
            count += 1
    if count < m // 2 + 3:
        kept[:] = True
        return scale
    return NORMAL * fit._ranked(near[:count], count // 2) * np.sqrt(count / (count - 3.0))


@compiled(error_model="numpy")
def _weigh(left, scale, loss, kept, weight, result):
    """Write root weights, covariance sd and degrees of freedom; return the mean slope of the score."""
    slope, square, count, away = 0.0, 0.0, 0, 0
    for i in range(kept.size):
        z, share, own = abs(left[i]) / scale, 0.0, 0.0
        if kept[i] and loss == HUBER:
            share, own = (1.0, 1.0) if z <= BEND else (BEND / z, 0.0)
        elif kept[i]:
            share = 1.0 / np.sqrt(1.0 + (z / BEND) ** 2)
            own = share**3
        slope += own
        square += (z * share) ** 2
        count += kept[i]
        away += share < 0.5
        weight[i] = np.sqrt(share)
    mean = max(slope / count, 1e-3)
    more = 1.0 + 3.0 / count * (1.0 - mean) / mean  # Huber's small-sample correction, for slopes 0 or 1
    result[fit.SEEN] = more * scale * np.sqrt(square / max(count - 3.0, 1.0)) / mean
    result[fit.FREEDOM], result[fit.AWAY] = max(slope - 3.0, 1.0), away
    return mean


@compiled(error_model="numpy")
def _advanced(data, circle, step, left):
    """Apply a step, halved until the curve exists; return whether it does."""
    trial, share = np.empty(3), 1.0
    for _ in range(fit.HALVINGS):
        for k in range(3):
            trial[k] = circle[k] + share * step[k]
        if fit._residuals(data, trial, left):
            circle[0], circle[1], circle[2] = trial[0], trial[1], trial[2]
            return True
        share *= 0.5
    return False


@compiled(error_model="numpy")
def _reweighted(data, scale, loss, kept, prior_mean, prior_sd, noise_sd, rows, left, weight, result):
    """Take one step of the weighted problem; return `FITTED` when settled, `ENDLESS` otherwise."""
    m, step = data.shape[1], np.empty(3)
    mean = _weigh(left, scale, loss, kept, weight, result)
    result[fit.UNIT] = max(result[fit.SEEN], noise_sd)
    left[m] = prior_mean - result[fit.RADIUS]
    held = np.sqrt(mean) * result[fit.UNIT] / prior_sd
    gain = fit._direction(data, result, weight, left, held, rows, step, result)
    if gain < 0.0:
        return fit.SINGULAR
    if not _advanced(data, result, step, left):
        return fit.OUTSIDE
    settled = gain <= fit.SETTLED * scale**2 + m * (fit.ROUNDING * result[fit.RADIUS]) ** 2
    return fit.FITTED if settled else fit.ENDLESS


@compiled(error_model="numpy")
def fit_robust(angle, reading, form, prior_mean, prior_sd, noise_sd, loss, triples, left, result):
    """Fit the exact curve with a loss that grows slower than the square; write slots, return the outcome.

    `left` receives the weighted residuals (m + 1), NaN for readings left out. The covariance is Huber's:
    scale^2 times mean squared score over squared mean slope of the score, times (J'J)^-1.
    """
    m, data = angle.size, fit._prepared(angle, reading, form)
    rows, weight, kept = np.empty((4, m + 1)), np.empty(m), np.empty(m, dtype=np.bool_)
    near = _least_median(data, triples, result)
    if near == np.inf and fit._started(data, rows, result) != fit.FITTED:
        return fit.SINGULAR
    fit._residuals(data, result, left)
    width = NORMAL * (1.0 + 5.0 / (m - 3.0)) * near  # if infinite, no reading is left out
    ended, result[fit.TAKEN] = fit.ENDLESS, 0.0
    while result[fit.TAKEN] < LEAST or (ended == fit.ENDLESS and result[fit.TAKEN] < fit.STEPS):
        result[fit.TAKEN] += 1.0
        if result[fit.TAKEN] <= CHANGING:
            least = fit.ROUNDING * result[fit.RADIUS]
            width = max(_sifted(left, max(width, least), kept), least)
            scale = max(width, noise_sd)
        ended = _reweighted(
            data, scale, loss, kept, prior_mean, prior_sd, noise_sd, rows, left, weight, result
        )
        if ended == fit.SINGULAR or ended == fit.OUTSIDE:
            return ended
    _weigh(left, scale, loss, kept, weight, result)
    result[fit.UNIT] = max(result[fit.SEEN], noise_sd)
    counted = np.empty(m)
    for i in range(m):
        counted[i] = weight[i] ** 2 * left[i] if kept[i] else np.nan
        weight[i] = 1.0 if kept[i] else 0.0
    fit._direction(data, result, weight, left, result[fit.UNIT] / prior_sd, rows, np.empty(3), result)
    for i in range(m):
        left[i] = counted[i]
    result[fit.NOISE] = scale
    return ended
