"""Integration of the dynamics over planned or recorded commands, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._model.kernels import DeflectionLaw, _deflected, rate

COLUMNS = 5  # derived: time (s), stock, deflection beyond ploughing (mm), rate (mm/s), wear flat area


@compiled(inline="always")
def _speed(y, area, law, wear):
    return rate(y, DeflectionLaw(law[0], law[1] * area / wear[0], law[2]))


@compiled(inline="always")
def _slopes(y, area, command, law, wear):
    """Slopes of deflection, stock, area.

    Wear: reference area, growth (1/mm), exponent, reference rate, radius of the wheel over that of the work.
    """
    v = _speed(y, area, law, wear)
    return command - (1.0 + wear[4]) * v, -v, wear[1] * (v / wear[3]) ** wear[2] * v


@compiled(inline="always")
def _step(state, h, command, law, wear):
    y, left, area = state
    a = _slopes(y, area, command, law, wear)
    b = _slopes(y + h / 2 * a[0], area + h / 2 * a[2], command, law, wear)
    c = _slopes(y + h / 2 * b[0], area + h / 2 * b[2], command, law, wear)
    d = _slopes(y + h * c[0], area + h * c[2], command, law, wear)
    return (
        y + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]),
        left + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]),
        area + h / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2]),
    )


@compiled
def play(stock, commands, durations, laws, wear, steps, spare, out, interval):
    """Replay commands from first touch until the stock is removed, at most `spare` times more of the last.

    `laws[k]` holds during command k. Fills `out` (`COLUMNS`) and the index of the command; returns the rows.
    """
    state, now, row = (0.0, stock, wear[0]), 0.0, 0
    for k in range(commands.size + spare):
        i = min(k, commands.size - 1)
        law = laws[i]
        h = durations[i] / steps
        for j in range(steps + 1):
            if j > 0:
                after = _step(state, h, commands[i], law, wear)
                if after[1] <= 0.0:  # size is reached in this step: bisect
                    low, high = 0.0, h
                    for _ in range(50):
                        middle = 0.5 * (low + high)
                        if _step(state, middle, commands[i], law, wear)[1] > 0.0:
                            low = middle
                        else:
                            high = middle
                    after = _step(state, high, commands[i], law, wear)
                    now += high
                else:
                    now += h
                state = after
            out[row, 0], out[row, 1], out[row, 2], out[row, 4] = now, state[1], state[0], state[2]
            out[row, 3] = _speed(state[0], state[2], law, wear)
            interval[row] = i
            row += 1
            if state[1] <= 0.0:
                return row
    return row


@compiled
def play_by_stock(stock, commands, ends, laws, wear, step, out, interval):
    """Replay commands, each until the stock (mm) is down to its end; return the rows, at most those of `out`.

    The wheel first touches at the first row; `out` and `interval` as in `play`.
    """
    state, now, row = (0.0, stock, wear[0]), 0.0, 0
    for k in range(commands.size):
        law, switched = laws[k], state[1] <= ends[k]
        while row < out.shape[0]:
            out[row, 0], out[row, 1], out[row, 2], out[row, 4] = now, state[1], state[0], state[2]
            out[row, 3] = _speed(state[0], state[2], law, wear)
            interval[row] = k
            row += 1
            if switched:
                break
            h, after = step, _step(state, step, commands[k], law, wear)
            switched = after[1] <= ends[k]
            if switched:
                h = _until_stock(state, step, commands[k], ends[k], law, wear)
                after = _step(state, h, commands[k], law, wear)
            state, now = after, now + h
    return row


@compiled
def _until_stock(state, step, command, end, law, wear):
    """Time (s) within a step after which the stock is down to `end` (mm): bisection."""
    low, high = 0.0, step
    for _ in range(50):
        middle = 0.5 * (low + high)
        if _step(state, middle, command, law, wear)[1] > end:
            low = middle
        else:
            high = middle
    return high


@compiled
def deflections(first, command_rate, step, substeps, core):
    """Deflection beyond ploughing (mm) and rate (mm/s) at each reading; commands hold for a `step` (s)."""
    out = np.empty((step.size + 1, 2))
    y, v = first, rate(first, core)
    out[0, 0], out[0, 1] = y, v
    for k in range(step.size):
        y, v = _deflected(y, v, command_rate[k], step[k], substeps, core)
        out[k + 1, 0], out[k + 1, 1] = y, v
    return out


@compiled
def lags(first, pole, given):
    """Deflection of a linear lag (mm) at each reading: x+ = pole x + given."""
    out = np.empty(pole.size + 1)
    out[0] = first
    for k in range(pole.size):
        out[k + 1] = pole[k] * out[k] + given[k]
    return out
