"""Work of the contact and of friction over a phase, by quadrature: a check of the closed forms."""

import numpy as np

from centering.push._contact.swing_kernels import _fading, _gap_at
from sdpgrind.base.compiling.compiled import compiled

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_PANEL = 6.0  # rad, chosen: 12 nodes integrate the product of two waves of this phase to 1e-12 of its size
_GONE = 40.0  # derived: time constants after which exp(-t) is below rounding


@compiled
def _swing_energies(motion, tip_speed, tip_acceleration, parameters, duration):
    """Work of the contact on the part and of the part against drag, N mm, over a time (s) in contact."""
    _, _, _, _, _, alpha, square, rate, slow = motion
    fast = np.sqrt(alpha * alpha - square) if rate > 0.0 else alpha - rate
    quick = duration if slow == 0.0 else min(duration, _GONE / (alpha if rate > 0.0 else fast))
    work, drag = _panels(motion, tip_speed, tip_acceleration, parameters, 0.0, quick, fast)
    if quick < duration:
        more, further = _panels(
            motion, tip_speed, tip_acceleration, parameters, quick, duration, slow if rate <= 0.0 else 0.0
        )
        work, drag = work + more, drag + further
    return work, drag


@compiled
def _panels(motion, tip_speed, tip_acceleration, parameters, begin, end, rate):
    """Both works between two times; `rate` (1/s) of the motion sets the number of panels."""
    k, b, viscous = parameters[1], parameters[2], parameters[5]
    n = int(rate * (end - begin) / _PANEL) + 1
    half = 0.5 * (end - begin) / n
    work, drag = 0.0, 0.0
    for i in range(n):
        middle = begin + (2 * i + 1) * half
        for j in range(_NODES.size):
            t = middle + half * _NODES[j]
            gap, closing, _ = _gap_at(t, motion)
            speed = tip_speed + tip_acceleration * t - closing
            work += _WEIGHTS[j] * (k * gap + b * closing) * speed
            drag += _WEIGHTS[j] * speed * speed
    return half * work, half * viscous * drag


@compiled
def _flight_energies(speed, coulomb, viscous_rate, viscous, duration):
    """Work of a flying part against drag, N mm; mm/s, mm/s^2, 1/s, N s/mm, s."""
    n = int(viscous_rate * duration) + 1
    half = 0.5 * duration / n
    drag = 0.0
    for i in range(n):
        for j in range(_NODES.size):
            t = half * (2 * i + 1 + _NODES[j])
            whole, first, _ = _fading(viscous_rate * t)
            now = speed * whole - coulomb * t * first
            drag += _WEIGHTS[j] * now * now
    return half * viscous * drag
