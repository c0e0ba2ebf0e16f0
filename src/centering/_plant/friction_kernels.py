"""Friction of a ring that slides and spins on a table, with even pressure along its circle.

Friction opposes the local slip. Force and moment depend only on the ratio of both speeds: they are
derivatives of the mean slip speed along the ring, complete elliptic integrals. `v` is the speed of the
centre, `s` that of the rim by the spin, >= 0.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_SMALL = 0.02  # ratio of speeds; chosen: below it the closed form loses digits and the series is exact
_EQUAL = 1e-12  # relative; chosen: the limit for equal speeds is exact to rounding there
_ROUNDING = 1e-15  # relative; chosen: convergence to rounding
_HALVINGS = 60  # derived: an angle to rounding


@compiled
def _shares(v, s):
    """Force over mu M g against the slide, moment over mu M g R against the spin; one speed is not 0."""
    if s == 0.0:
        return 1.0, 0.0
    if v == 0.0:
        return 0.0, 1.0
    if abs(v - s) <= _EQUAL * s:
        return 2.0 / np.pi, 2.0 / np.pi
    # arithmetic-geometric mean for K and E of the parameter 4 v s/(v + s)^2
    total, apart = v + s, abs(v - s)
    one, other, missing, weight = 1.0, apart / total, 4.0 * v * s / (total * total), 0.5
    lost = weight * missing
    while one - other > _ROUNDING * one:
        half = 0.5 * (one - other)
        one, other = 0.5 * (one + other), np.sqrt(one * other)
        weight *= 2.0
        lost += weight * half * half
    mean, inverse = total * (1.0 - lost) / one, 1.0 / (one * total)
    if v <= _SMALL * s:
        force = _series(v / s)
        return force, (mean - v * force) / s
    if s <= _SMALL * v:
        moment = _series(s / v)
        return (mean - s * moment) / v, moment
    turn = (v - s) * total * inverse
    return (mean + turn) / (2.0 * v), (mean - turn) / (2.0 * s)


@compiled
def _series(e):
    square = e * e
    return e * (0.5 + square * (1.0 / 16.0 + square * (3.0 / 128.0 + square * 25.0 / 2048.0)))


@compiled
def _held(moment):
    """Force over its maximum that still holds a ring while `moment` (over its maximum) holds its spin."""
    if moment <= 0.0:
        return 1.0
    if moment >= 1.0:
        return 0.0
    low, high = 0.0, 0.5 * np.pi
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _shares(np.cos(middle), np.sin(middle))[1] < moment:
            low = middle
        else:
            high = middle
    return _shares(np.cos(low), np.sin(low))[0]


@compiled
def _begins(pull, turn, most):
    """Cosine and sine of the initial ratio of sliding and spinning: where the forces left by friction act.

    `pull` on the ring and `turn` at its rim, N, > 0, against a friction of `most`, which cannot hold both.
    """
    low, high = 0.0, 0.5 * np.pi
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        cosine, sine = np.cos(middle), np.sin(middle)
        force, moment = _shares(cosine, sine)
        if (turn - most * moment) * cosine > (pull - most * force) * sine:
            low = middle
        else:
            high = middle
    return np.cos(low), np.sin(low)
