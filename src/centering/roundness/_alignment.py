"""Rotation between two forms of one part, by the correlation of their harmonics."""

from math import pi

import numpy as np
from scipy.fft import next_fast_len

from sdpgrind.base.checks import Complex, Floats

_GRID = 16  # chosen: points for each wave of the highest harmonic; Newton's steps begin at its top
_NEWTON = 4  # derived: steps from a sixteenth of a wave to rounding
_NEARLY = 0.9  # chosen: correlation over the highest of another angle that would fit as well


def likeness(shared: Complex, upr: Floats) -> Floats:
    """Correlation of two forms on a grid of rotations of the second, from 0 on.

    `shared`: products of the first's harmonics with the conjugate ones of the second, for each of `upr`.
    """
    size = next_fast_len(_GRID * int(upr.max()))
    each = np.zeros(size, dtype=complex)
    each[upr.astype(int)] = shared
    return np.asarray(np.fft.fft(each).real)


def tops(alike: Floats) -> int:
    """Number of rotations that fit nearly as well as the best."""
    high = (alike > np.roll(alike, 1)) & (alike >= np.roll(alike, -1)) & (alike > _NEARLY * alike.max())
    return int(np.count_nonzero(high))


def best_turn(alike: Floats, shared: Complex, upr: Floats) -> float:
    """Rotation of the highest correlation, refined by Newton's method, rad, in [-pi, pi)."""
    turn = 2 * pi * float(alike.argmax()) / alike.size
    for _ in range(_NEWTON):
        waves = shared * np.exp(-1j * upr * turn)
        turn += float(np.sum(upr * waves.imag) / np.sum(upr**2 * waves.real))
    return float(np.remainder(turn + pi, 2 * pi)) - pi
