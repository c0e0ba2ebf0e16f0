"""Integration of the dynamics over planned or recorded commands, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._model.kernels import DeflectionLaw, _pair_near, rate

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
    """Deflection beyond ploughing (mm) and rate (mm/s) at each reading; commands hold for a `step` (s).

    Then the derivatives of the deflection by the first one, unit 1, and by ln of its law's scale, mm.
    """
    out = np.empty((step.size + 1, 4))
    y, v, by_first, by_scale = first, rate(first, core), 1.0, -core.K0
    for k in range(step.size + 1):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = y, v, by_first, by_scale
        if k < step.size:
            y, v, by_first, by_scale = _swept(
                y, v, by_first, by_scale, command_rate[k], step[k], substeps, core
            )
    return out


@compiled(error_model="numpy")
def _swept(y, near, by_first, by_scale, command_rate, duration, steps, core):
    """`_deflected` with the derivatives of the deflection, which are those of its steps.

    Where the wheel touches, the deflection is 0 whatever it was before, and the rest of the duration varies.
    """
    by_h = 0.0, 0.0
    if y < 0.0:
        reached = y + command_rate * duration
        if reached <= 0.0:
            return reached, 0.0, by_first, by_scale
        duration, y = reached / command_rate, 0.0
        by_h = by_first / (command_rate * steps), by_scale / (command_rate * steps)
        by_first = by_scale = 0.0
    h = duration / steps
    v, w = _pair_near(y, near, near**core.p, core)
    for _ in range(steps):
        a, s = command_rate - v, _slope(v, w, core)
        f, g = -s * by_first, -s * (by_scale - y)
        sums = a, f, g
        for stage in range(1, 4):
            share, weight = (1.0, 1.0) if stage == 3 else (0.5, 2.0)
            at, by_f, by_g = y + share * h * a, share * (h * f + by_h[0] * a), share * (h * g + by_h[1] * a)
            v, w = _pair_near(at, v, w, core)
            a, s = command_rate - v, _slope(v, w, core)
            f, g = -s * (by_first + by_f), -s * (by_scale + by_g - at)
            sums = sums[0] + weight * a, sums[1] + weight * f, sums[2] + weight * g
        y += h / 6.0 * sums[0]
        by_first += h / 6.0 * sums[1] + by_h[0] / 6.0 * sums[0]
        by_scale += h / 6.0 * sums[2] + by_h[1] / 6.0 * sums[0]
        v, w = _pair_near(y, v, w, core)
    return y, v, by_first, by_scale


@compiled(error_model="numpy", inline="always")
def _slope(v, w, core):
    """Derivative dv/dy, 1/s, of a rate with w = v^p; 0 where the wheel only ploughs."""
    return v / (core.K1 * v + core.p * core.K2 * w) if v > 0.0 else 0.0


@compiled
def lags(first, pole, given):
    """Deflection of a linear lag (mm) at each reading: x+ = pole x + given."""
    out = np.empty(pole.size + 1)
    out[0] = first
    for k in range(pole.size):
        out[k + 1] = pole[k] * out[k] + given[k]
    return out


@compiled(error_model="numpy")
def lagged_sizes(infeed, command_rate, step, tau, touch_in):
    """Size (mm) at each reading behind a linear lag (s) that begins after `touch_in` (mm) of command.

    Then its derivatives by ln of the lag, mm, and by the touch-in, unit 1.
    """
    out = np.empty((3, infeed.size))
    x, by_lag, by_touch = max(-touch_in, 0.0), 0.0, -1.0 if touch_in < 0.0 else 0.0
    for k in range(infeed.size):
        fed = infeed[k] - touch_in
        out[0, k], out[1, k] = max(fed, 0.0) - x, -by_lag
        out[2, k] = -by_touch - (1.0 if fed > 0.0 else 0.0)
        if k < step.size:
            after, moves = infeed[k + 1] - touch_in, infeed[k + 1] - infeed[k]
            share = min(max(after / moves, 0.0), 1.0) if moves > 0.0 else 1.0
            power = -share * step[k] / tau
            pole, full = np.exp(power), command_rate[k] * tau
            behind = x - full
            by_lag = pole * (by_lag - power * behind) + full * (1.0 - pole)
            by_touch *= pole
            if fed <= 0.0 < after and moves > 0.0:
                by_touch += pole * behind * step[k] / (tau * moves)
            x = full + pole * behind
    return out
