"""Butterworth low-passes; `scipy.signal.butter` gives the same bits, and takes half a second to import."""

from math import pi
from typing import Any

import numpy as np

from sdpgrind.base.checks import Complex, Floats


def analogue(order: int, cutoff: float) -> tuple[Floats, Floats]:
    """Return numerator and denominator in powers of s (rad/s), gain 1 at 0, of a `cutoff` in rad/s."""
    return np.array([cutoff**order]), _with_roots(cutoff * _poles(order))


def digital(order: int, cutoff: float, sample_time: float) -> tuple[Floats, Floats]:
    """Return numerator and denominator in powers of 1/z: bilinear, exact at the `cutoff` (rad/s)."""
    warped = 4.0 * np.tan(pi * (cutoff / (pi / sample_time)) / 2.0)  # as of a filter of two samples a second
    poles = warped * _poles(order)
    gain = warped**order * np.real(1.0 / np.prod(4.0 - poles))
    return gain * _with_roots(-np.ones(order)), _with_roots((4.0 + poles) / (4.0 - poles))


def _poles(order: int) -> Complex:
    """Poles of a cutoff of 1 rad/s."""
    poles: Complex = -np.exp(1j * pi * np.arange(1 - order, order, 2) / (2 * order))
    return poles


def _with_roots(roots: Any) -> Floats:
    """Real coefficients of the polynomial with some roots, the highest power first."""
    return np.asarray(np.poly(roots), dtype=float)
