"""Response of a machine to recorded commands: size and power of a part, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._plant.part_kernels import (
    REMAINING,
    STATES,
    _ground,
    _monitored,
    start_part,
    true_power,
)

SIZE, POWER, COLUMNS = range(3)


@compiled
def respond(rig, power_lag, duration, command, steps, shown):
    """Size (mm), and power (W) without the idle one, at the readings of a part that begins unloaded.

    A command (mm/s) acts for its duration (s), in a number of steps; `shown` (0, 1): a reading follows it.
    The monitor has a time constant (s; 0: none).
    """
    state = np.zeros(STATES)
    start_part(state, rig)
    out = np.zeros((1 + int(np.sum(shown)), COLUMNS))
    monitor, row = 0.0, 0
    out[0, POWER] = true_power(state, rig) if power_lag <= 0.0 else 0.0
    for k in range(duration.size):
        h = duration[k] / steps[k]
        log_pole = -h / power_lag if power_lag > 0.0 else -np.inf
        pole = np.exp(log_pole)
        before = true_power(state, rig)
        for _ in range(steps[k]):
            _ground(state, rig, command[k], h)
            now = true_power(state, rig)
            monitor = _monitored(monitor, before, now, pole, log_pole)
            before = now
        if shown[k] > 0:
            row += 1
            out[row, SIZE], out[row, POWER] = -state[REMAINING], monitor
    return out
