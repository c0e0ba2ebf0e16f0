"""Roots of many functions at once: hidden states that explain readings, coordinates of a given slack."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._path.stretch import Stretch, Values

ROUNDS = 100  # chosen: more than Illinois steps take to rounding
CLOSE = 4e-16  # derived: relative rounding of two doubles


def root(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Return roots (N,) of a function, one sign change per bracket; without one, the end of smaller value.

    Illinois rule. A converged root stays unchanged, independent of its neighbours.
    """
    a, b = low.copy(), high.copy()
    fa, fb = function(a), function(b)
    found = np.where(np.abs(fa) < np.abs(fb), a, b)
    sought = np.sign(fa) * np.sign(fb) < 0
    for _ in range(ROUNDS):
        if not sought.any():
            break
        c = np.where(sought, b - fb * (b - a) / np.where(sought, fb - fa, 1.0), found)
        fc = function(c)
        done = (fc == 0.0) | (np.abs(c - found) <= CLOSE * np.abs(c))
        found = np.where(sought, c, found)
        across = np.sign(fc) * np.sign(fb) < 0
        a, fa = np.where(sought & across, b, a), np.where(sought, np.where(across, fb, 0.5 * fa), fa)
        b, fb = np.where(sought, c, b), np.where(sought, fc, fb)
        sought &= ~done
    return found


def hidden_of(values: Values, controls: Floats, reading: Floats, x: tuple[float, float]) -> Floats:
    """Return hidden states (N,) that explain readings (N,) at controls (N, n), clamped to the range x."""
    ends = [np.full(reading.shape, end) for end in x]
    return root(lambda state: values(controls, state)[0] - reading, *ends)


def balanced(stretch: Stretch, x: Floats, slack: float) -> Floats:
    """Return coordinates (N,) at which hidden states (N,) leave a given slack, clamped to the stretch.

    Of several roots the one next to the optimum, on its side of more slack (of less for negative `slack`).
    """
    best = np.asarray(stretch.coordinate_of(x, clamp=True))
    if slack == 0:
        return best
    far = stretch.low if (stretch.loop_slope[0] < 0) == (slack > 0) else stretch.high
    return root(lambda s: np.asarray(stretch.slack(s, x)) - slack, np.full(x.shape, far), best)
