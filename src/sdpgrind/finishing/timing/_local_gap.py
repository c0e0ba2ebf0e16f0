"""How far a law with limits of jerk may be from the fastest near it: an estimate, not a bound.

On nodes at equal times of the law the squared feed is improved by interior points, with the limits held at
the places of the nodes alone, neither narrowed nor slowed. The gap adds up

- what the law is slower than this one: narrowing, slowing, and its own nodes,
- the duality gap at which the last convex program ends,
- the change from half the nodes, three times: as much as all finer ones together where the change falls by a
  third at each halving of the intervals.
"""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing._interior import improved, rows_of
from sdpgrind.finishing.timing._jerk_limited import GAP, distinct, time_step
from sdpgrind.finishing.timing._limits import LimitedRun
from sdpgrind.finishing.timing._squared_feed import coefficients, greville, squared_feed
from sdpgrind.finishing.timing._time_law import TimeLaw

FINER = 3.0  # derived: 1 + 2/3 + 4/9 + ...; twice was up to 11 % short of what six times the nodes save


def local_gap(given: LimitedRun, law: TimeLaw) -> float:
    """Return the share of its duration that a law near a given one may save, unit 1; an estimate."""
    turn = 2 * float(np.max(given.limits.table[1] / given.limits.table[2]))
    count = 2 * int(np.ceil(law.duration / time_step(given, law.duration, turn) / 2))
    nodes = law.at(np.linspace(0.0, law.duration, count + 1)).length - law.length[0]
    whole, half = (_duration(given, law, each) for each in (nodes, nodes[::2]))
    saved = max(law.duration - whole, 0.0) + GAP * whole + FINER * abs(whole - half)
    return float(saved / law.duration)


def _duration(given: LimitedRun, law: TimeLaw, nodes: Floats) -> float:
    """Duration of the fastest law on nodes (mm from the start) near a given one, s."""
    nodes = nodes[distinct(nodes)]
    mesh, start = squared_feed(nodes), float(law.length[0])
    feed = law.at(law.time_at(start + greville(nodes))).feed
    c = improved(mesh, rows_of(given, mesh, np.ones((3, nodes.size - 1))), coefficients(feed), GAP)
    return float(mesh.duration(c))
