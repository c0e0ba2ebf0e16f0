"""The hidden state that explains a reading, and the place whose slack is a given one; for many at once."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._stretch.stretch import Stretch, Values

ROUNDS = 100
CLOSE = 4e-16
"""Change of a root, relative, that is rounding."""


def root(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Roots (N,) of a function that changes sign once in each bracket; the end of smaller value where it does not.

    Illinois' rule. What has been found is left alone, so that each root is the same whatever stands beside it.
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
    """Hidden states (N,) for which the model responds to controls (N, n) as was read (N,), within a range."""
    ends = [np.full(reading.shape, end) for end in x]
    return root(lambda state: values(controls, state)[0] - reading, *ends)


def balanced(stretch: Stretch, x: Floats, slack: float) -> Floats:
    """Places (N,) at which hidden states (N,) leave so much slack; the end of the stretch where they nowhere do.

    The root next to the optimum is meant: from there it lies on the side of more slack, or of less where `slack` is negative.
    """
    best = np.asarray(stretch.coordinate_of(x, clamp=True))
    if slack == 0:
        return best
    far = stretch.low if (stretch.loop_slope[0] < 0) == (slack > 0) else stretch.high
    return root(lambda s: np.asarray(stretch.slack(s, x)) - slack, np.full(x.shape, far), best)
