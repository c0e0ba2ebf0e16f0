"""Length along intervals whose speed is a Legendre series, and its inverse."""

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _travelled(series, x):
    """Integral of a Legendre series from -1 to x, and the series at x."""
    before, now = 1.0, x
    length, speed = series[0] * (x + 1.0), series[0]
    for i in range(1, len(series)):
        after = ((2 * i + 1) * x * now - i * before) / (i + 1)
        length += series[i] * (after - before) / (2 * i + 1)
        speed += series[i] * now
        before, now = now, after
    return length, speed


@compiled
def travelled(series, interval, x, out):
    """Integral of the series of `interval` (m,) up to `x` (m,) in [-1, 1]."""
    for m in range(len(interval)):
        out[m] = _travelled(series[interval[m]], x[m])[0]


@compiled
def inverted(series, interval, length, out):
    """Places in [-1, 1] at which the integral is `length` (m,): Newton's method within a bracket."""
    for m in range(len(interval)):
        own, low, high = series[interval[m]], -1.0, 1.0
        whole = 2.0 * own[0]  # all other terms integrate to 0
        x = 2.0 * length[m] / whole - 1.0
        for _ in range(60):
            x = min(max(x, low), high)
            reached, speed = _travelled(own, x)
            excess = reached - length[m]
            if abs(excess) <= 1e-15 * whole:
                break
            if excess > 0:
                high = x
            else:
                low = x
            following = x - excess / speed
            x = following if low < following < high else 0.5 * (low + high)
        out[m] = min(max(x, -1.0), 1.0)
