"""Many runs of the torque axis under one controller, compiled, with the kernels of single runs."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.states import width
from sdpgrind.finishing.torque._axis_kernels import _axis_tick, encoder_reading
from sdpgrind.finishing.torque._controller_kernels import _controller_step, _feed_override
from sdpgrind.finishing.torque._states import AXIS, CONTROLLER, LAW, MOTOR

SHOWN, CURRENT, TORQUE, ESTIMATE, PATH_TIME, COLUMNS = range(6)
"""Columns: angle (rad), current from then on (A), contact torque (N m), estimate (N m), motion's time (s)."""


STATES = width(MOTOR)


@compiled
def batch(law, start, time, torque, axis, resolution, offsets, depth, surface, load, out):
    """Run from each offset (rad) of surface and encoder at a deflection `depth` (rad); `out`: samples."""
    state, axis_state = np.empty(start.size), np.empty(STATES)
    controller, motor = state.view(CONTROLLER)[0], axis_state.view(MOTOR)[0]
    setting, known = law.view(LAW)[0], axis.view(AXIS)[0]
    for i in range(offsets.size):
        for j in range(start.size):
            state[j] = start[j]
        motor.angle = offsets[i] + surface[0] + depth
        motor.speed, path_time = 0.0, 0.0
        contact = known.stiffness * max(motor.angle - offsets[i] - surface[0], 0.0)
        for k in range(out.shape[1]):
            shown = encoder_reading(motor.angle, resolution)
            current = _controller_step(
                setting, controller, shown, path_time, time, torque, contact, motor.speed
            )
            row = out[i, k]
            row[SHOWN], row[CURRENT], row[TORQUE] = motor.angle, current, contact
            row[ESTIMATE], row[PATH_TIME] = controller.estimate, path_time
            now, then = offsets[i] + surface[k], offsets[i] + surface[k + 1]
            contact = _axis_tick(known, motor, current, load[k], now, then)
            path_time += _feed_override(setting, controller) * setting.sample_time
