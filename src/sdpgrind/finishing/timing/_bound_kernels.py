"""Greatest squared feed that any course can have at points of a run, from those before and behind it."""

from sdpgrind.base.compiling.compiled import compiled


@compiled
def _reach(slopes, ways, most, x, here, there):
    """Lower x[there] to what joints reach from x[here]: the square of a speed grows by 2 A times the way."""
    for j in range(most.size):
        reached = slopes[here, j] ** 2 * x[here] + 2.0 * most[j] * ways[j]
        own = slopes[there, j] ** 2
        if reached < own * x[there]:
            x[there] = reached / own


@compiled
def highest(slopes, ways, most, x):
    """Lower x (m,) from its caps: slopes q' (m, r) of joints, ways (m - 1, r), accelerations most (r,)."""
    last = x.size - 1
    x[0] = x[last] = 0.0
    for i in range(last):
        _reach(slopes, ways[i], most, x, i, i + 1)
    for i in range(last, 0, -1):
        _reach(slopes, ways[i - 1], most, x, i, i - 1)
    for i in range(last):  # again: starts are lower now
        _reach(slopes, ways[i], most, x, i, i + 1)
