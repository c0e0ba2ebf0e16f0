"""Slow, obvious ways to push a part: small steps of the 4-mode model, and the tip's position in plain Python."""

import numpy as np
from numba import njit


@njit
def stepped_push(parameters, segments, start, step, steps_after):
    """Small-step twin: semi-implicit Euler with a complementary friction and a contact that only pushes.

    Gives final position, longest free slide, peak force, breakaway time.
    """
    mass, k, b, static, coulomb, viscous = parameters
    tip, x, u, slide, left_at, flying, peak, broke = start, 0.0, 0.0, 0.0, 0.0, False, 0.0, np.nan
    time = 0.0
    for s in range(segments.shape[0] + 1):
        if s < segments.shape[0]:
            duration, v, a = segments[s]
            n = int(np.ceil(duration / step))
            h = duration / n
        else:
            v, a, n, h = v + a * duration, 0.0, steps_after, step
        for i in range(n):
            t = (i + 1) * h
            y = tip + v * t + 0.5 * a * t * t
            gap, rate = y - x, v + a * t - u
            force = max(0.0, k * gap + b * rate) if gap > 0.0 else 0.0
            peak = max(peak, force)
            if u > 0.0 or force > static:
                if np.isnan(broke):
                    broke = time + t
                free = u + h * (force - coulomb - viscous * u) / mass
                u = max(0.0, free)  # friction stops a part and does not turn it
                x += h * u
            if u > 0.0 and force == 0.0:
                if not flying:
                    left_at = x
                flying = True
                slide = max(slide, x - left_at)
            else:
                flying = False
        tip += (v + 0.5 * a * n * h) * n * h
        time += n * h
    return np.array((x, slide, peak, broke))


def tip_at(segments, start, t):
    """Position and speed of a tip, segment by segment."""
    y = start
    for duration, v, a in segments:
        if t <= duration:
            return y + v * t + 0.5 * a * t * t, v + a * t
        y += v * duration + 0.5 * a * duration**2
        t -= duration
    duration, v, a = segments[-1]
    return y + (v + a * duration) * t, v + a * duration
