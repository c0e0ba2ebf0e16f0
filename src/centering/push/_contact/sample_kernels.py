"""Tip, part and force at any time of a push, from its log of phases."""

from centering.push._contact.phase_kernels import FREE, SLIP, STICK
from centering.push._contact.swing_kernels import _flight, _gap_at, _swing
from sdpgrind.base.compiling.compiled import compiled


@compiled
def sample(parameters, log, times, out):
    """Write tip and part position (mm), part speed (mm/s), contact force (N) at rising times (s), (n, 4)."""
    law = (parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5])
    row, last = 0, log.shape[0] - 1
    for i in range(times.size):
        while row < last and log[row + 1, 0] <= times[i]:
            row += 1
        _write_state(law, log[row], times[i] - log[row, 0], out[i])


@compiled
def _write_state(law, begun, t, out):
    """Write the four values of `sample` at a time `t` (s) after the beginning of a phase."""
    mode, tip, tip_speed = int(begun[1]), begun[2], begun[3]
    acceleration, gap, speed = begun[4], begun[5], begun[6]
    mass, k, b, _, coulomb, viscous = law
    if mode == SLIP:
        motion = _swing(gap, tip_speed - speed, tip_speed, acceleration, law)
    elif mode == FREE:
        motion = _flight(gap, tip_speed - speed, speed, acceleration, coulomb / mass, viscous / mass)
    else:
        motion = _flight(gap, tip_speed, 0.0, acceleration, 0.0, 0.0)
    here, closing, _ = _gap_at(t, motion)
    position = tip + (tip_speed + 0.5 * acceleration * t) * t
    moving = max(tip_speed + acceleration * t - closing, 0.0) if mode in (SLIP, FREE) else 0.0
    force = max(k * here + b * closing, 0.0) if mode in (SLIP, STICK) else 0.0
    out[0], out[1], out[2], out[3] = position, position - here, moving, force
