"""Least squares circle on true distances, by Newton's method."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_STEPS = 50  # chosen: steps at most; four suffice for a form error of a hundredth of the radius


@compiled
def algebraic_centre(x, y):
    """Centre (mm) of the circle fitted to squared distances; infinite for points on a line."""
    mx, my = np.mean(x), np.mean(y)
    uu = uv = vv = pu = pv = 0.0
    for k in range(x.size):
        u, v = x[k] - mx, y[k] - my
        square = u * u + v * v
        uu, uv, vv, pu, pv = uu + u * u, uv + u * v, vv + v * v, pu + square * u, pv + square * v
    det = uu * vv - uv * uv
    if det <= 1e-12 * (uu + vv) * (uu + vv):
        return np.inf, np.inf
    return mx + 0.5 * (vv * pu - uv * pv) / det, my + 0.5 * (uu * pv - uv * pu) / det


@compiled
def least_squares_circle(x, y, cx, cy):
    """Centre and mean distance (mm) from a start nearby, and whether the sum of squares is convex there."""
    for _ in range(_STEPS):
        step_x, step_y, radius, _ = _newton_step(x, y, cx, cy)
        cx, cy = cx + step_x, cy + step_y
        if np.hypot(step_x, step_y) <= 1e-15 * radius:
            break
    _, _, radius, bends = _newton_step(x, y, cx, cy)
    return cx, cy, radius, bends


@compiled
def _newton_step(x, y, cx, cy):
    """Newton step of the centre, mean distance, convexity; the Gauss-Newton step where not convex."""
    n = x.size
    radius = su = sv = uu = uv = vv = 0.0
    pu = pv = wuu = wuv = wvv = 0.0
    for k in range(n):
        radius += np.sqrt((x[k] - cx) * (x[k] - cx) + (y[k] - cy) * (y[k] - cy))
    radius /= n
    for k in range(n):
        dx, dy = x[k] - cx, y[k] - cy
        away = max(np.sqrt(dx * dx + dy * dy), 1e-300)
        u, v, e = dx / away, dy / away, away - radius
        su, sv, uu, uv, vv = su + u, sv + v, uu + u * u, uv + u * v, vv + v * v
        pu, pv = pu + e * u, pv + e * v
        bend = e / away
        wuu, wuv, wvv = wuu + bend * v * v, wuv - bend * u * v, wvv + bend * u * u
    uu, uv, vv = uu - su * su / n, uv - su * sv / n, vv - sv * sv / n
    a, b, c = uu + wuu, uv + wuv, vv + wvv
    bends = a > 0.0 and a * c - b * b > 1e-6 * a * c
    if not bends:
        a, b, c = uu, uv, vv
    det = a * c - b * b
    return (c * pu - b * pv) / det, (a * pv - b * pu) / det, radius, bends
