"""Many runs of the torque axis under one controller, compiled: the same steps as everywhere else."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.finishing.torque import _slots as at
from sdpgrind.finishing.torque._axis_kernels import axis_tick, encoder_reading
from sdpgrind.finishing.torque._controller_kernels import controller_step, feed_override

SHOWN, CURRENT, TORQUE, ESTIMATE, PATH_TIME, COLUMNS = range(6)
"""Columns: angle (rad), current from then on (A), contact torque (N m), estimate (N m), how far the motion is played (s)."""


@compiled
def batch(law, start, time, torque, axis, resolution, offsets, depth, surface, load, out):
    """Run from each offset (rad) of surface and encoder, pressed in by a depth (rad); rows of `out` are samples."""
    state, motor = np.empty(start.size), np.empty(at.STATES)
    for i in range(offsets.size):
        state[:] = start
        motor[at.ANGLE] = offsets[i] + surface[0] + depth
        motor[at.SPEED], path_time = 0.0, 0.0
        contact = axis[at.STIFFNESS] * max(motor[at.ANGLE] - offsets[i] - surface[0], 0.0)
        for k in range(out.shape[1]):
            shown = encoder_reading(motor[at.ANGLE], resolution)
            current = controller_step(law, state, shown, path_time, time, torque, contact, motor[at.SPEED])
            row = out[i, k]
            row[SHOWN], row[CURRENT], row[TORQUE] = motor[at.ANGLE], current, contact
            row[ESTIMATE], row[PATH_TIME] = state[at.ESTIMATE], path_time
            now, then = offsets[i] + surface[k], offsets[i] + surface[k + 1]
            contact = axis_tick(motor, current, load[k], now, then, axis)
            path_time += feed_override(law, state) * law[at.SAMPLE_TIME]
