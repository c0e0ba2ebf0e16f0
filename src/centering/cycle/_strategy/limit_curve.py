"""Friction that a thin ring with even pressure needs to keep its place and its spin at once."""

import numpy as np
from scipy.special import ellipe, ellipk

from sdpgrind.base.checks import Floats

_RATIOS = 401  # chosen: nodes of the curve; the friction between them is exact to 1e-5
_EQUAL = 1.0 - 1e-15  # derived: below 1 by rounding, where slide and spin are equal
_RATIO = np.linspace(0.0, 0.5 * np.pi, _RATIOS)[1:-1]


def _curve() -> tuple[Floats, Floats]:
    """Directions (rad from the force) and distances from zero of the curve of force and moment."""
    slide, spin = np.cos(_RATIO), np.sin(_RATIO)
    total = slide + spin
    module = np.minimum(4.0 * slide * spin / total**2, _EQUAL)
    one, other = total * ellipe(module), (slide - spin) * ellipk(module)
    force, moment = (one + other) / (np.pi * slide), (one - other) / (np.pi * spin)
    at = np.concatenate(([0.0], np.arctan2(moment, force), [0.5 * np.pi]))
    return at, np.concatenate(([1.0], np.hypot(force, moment), [1.0]))


_AT, _AWAY = _curve()


def needed(pull: Floats, turn: Floats) -> Floats:
    """Return the mu g that holds a ring against a pull and a turn of its rim, all accelerations, mm/s^2."""
    return np.asarray(np.hypot(pull, turn) / np.interp(np.arctan2(turn, pull), _AT, _AWAY))
