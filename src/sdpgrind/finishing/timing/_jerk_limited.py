"""Fastest law of a run within limits of jerk.

A short run is one program over time, on up to 256 points (`_short_run`). Where that is not enough, the
squared feed is found over arc length, by interior points on thousands of nodes: first coarse, from the law
without limits of jerk averaged over the time that its jumps of acceleration need; then at equal times of the
law found, denser where a limit was exceeded between nodes; then with the limits narrowed where they still
are. What is left slows the whole law.
"""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.timing._first_guess import averaged, longest_brake
from sdpgrind.finishing.timing._interior import improved, rows_of
from sdpgrind.finishing.timing._limits import LawError, LimitedRun
from sdpgrind.finishing.timing._min_time import fastest_law
from sdpgrind.finishing.timing._short_run import short_run_law
from sdpgrind.finishing.timing._squared_feed import coefficients, greville, squared_feed
from sdpgrind.finishing.timing._three_pieces import PIECES, law_of
from sdpgrind.finishing.timing._time_law import TimeLaw
from sdpgrind.finishing.timing._violations import closest, shares, slowing

SIZES = (32, 64, 128, 256)  # chosen: intervals of the program of a short run
# chosen: its interval over the time in which a joint's acceleration goes from its greatest to its least
SHARE = 0.25
BRAKE = 64  # chosen: most of its intervals in the longest brake
# of the duration, chosen: loss to limits exceeded between points up to which its law is taken
SLOWER = 3e-3
# of the duration, chosen: gain of a finer grid for the law without jerk, which only places points
COARSE = 5e-3
# chosen: interval between nodes over the same time, and least number of nodes on a run;
# half of both saves 0.03 to 0.2 % of the time and takes twice as long
FINE, LEAST = 0.035, 2500
# chosen: most nodes at equal times on a run of few samples, and a sample of the others
MOST, EACH = 4096, 4
FIRST = 3  # chosen: interval of the first mesh over that of the second
ROUGH, GAP = 1e-2, 1e-4  # of the time, chosen: duality gap on the first and the second mesh
# chosen: nodes are sqrt(x/CHANGES) times denser, at most DENSER times, where a limit is exceeded between them
# by a share x (it falls with the square of the interval), and where the feed changes by a share x over an
# interval (jerk is then at its limit at one end only)
CHANGES, DENSER = (0.01, 0.005), (3.0, 6.0)
ROUNDS = 2  # chosen: of narrowed limits; a third saves less than 0.01 %
ENOUGH = 2e-4  # of the duration, chosen: rest for slowing the whole law
CHECKS, LAST = 8, 40  # chosen: places in a piece for limits between rounds, and at the end
# of a run, chosen: nodes nearer to each other are dropped; averaged places coincide at the ends
NEAR = 1e-12


def jerk_limited_law(given: LimitedRun) -> TimeLaw:
    """Return the fastest law of a run within limits of jerk, too."""
    first = fastest_law(given, gain=COARSE)
    turn = 2 * float(np.max(given.limits.table[1] / given.limits.table[2]))
    laws, message = [], ""
    for make in (_by_program, _by_nodes):
        try:
            law = make(given, first, turn)
        except LawError as error:
            message = str(error)
            continue
        laws.append(within(given, law))
        if laws[-1].duration <= (1 + SLOWER) * law.duration:
            break
    if not laws:
        raise LawError(f"no jerk-limited law was found ({message})")
    return min(laws, key=lambda each: each.duration)


def within(given: LimitedRun, law: TimeLaw) -> TimeLaw:
    """Slow a law to all its limits, also between its knots."""
    run, limits, feed_rate, _ = given
    return law.slower(slowing(closest(run, law, limits, feed_rate, LAST)[:, 0]))


def _by_program(given: LimitedRun, first: TimeLaw, turn: float) -> TimeLaw:
    """Law by one program, where its greatest size is enough for the law and the path."""
    turn = min(turn, first.duration)
    step = max(SHARE * turn, longest_brake(first) / BRAKE)
    least = (first.duration + turn) / step
    sizes = [size for size in SIZES if size >= least]
    if not sizes or given.run.pieces.breaks.size > SIZES[-1]:
        raise LawError("the run is too long for one program")
    return short_run_law(given, averaged(first, turn, sizes[0]))


def _by_nodes(given: LimitedRun, first: TimeLaw, turn: float) -> TimeLaw:
    """Law by interior points on two meshes."""
    spread, start = min(turn, first.duration), float(given.run.length[0])
    step = FIRST * time_step(given, first.duration, turn)
    guess = averaged(first, spread, int(np.ceil((first.duration + spread) / step)))
    kept = distinct(guess.length)
    nodes = guess.length[kept] - start
    mesh, places = squared_feed(nodes), greville(nodes)
    rows = rows_of(given, mesh, np.ones((3, nodes.size - 1)))
    c = improved(mesh, rows, coefficients(np.interp(places, nodes, guess.feed[kept])), ROUGH)
    law = law_of(start, mesh, c)
    nodes = _nodes(law, _used(given, law), time_step(given, law.duration, turn))
    return _narrowed(given, nodes, law.at(law.time_at(start + greville(nodes))).feed)


def time_step(given: LimitedRun, duration: float, turn: float) -> float:
    """Time between nodes, s, before they are set denser where that is needed."""
    most = max(MOST, EACH * given.run.pieces.breaks.size)
    return max(min(FINE * turn, duration / LEAST), duration / most)


def _narrowed(given: LimitedRun, nodes: Floats, feed: Floats) -> TimeLaw:
    """Fastest law on nodes over rounds of narrowing limits in the intervals in which they are exceeded."""
    mesh, c, narrow = squared_feed(nodes), coefficients(feed), np.ones((3, nodes.size - 1))
    laws = []
    for _ in range(1 + ROUNDS):
        c = improved(mesh, rows_of(given, mesh, narrow), c, GAP)
        law = law_of(float(given.run.length[0]), mesh, c)
        used = _used(given, law)
        laws.append(law.slower(slowing(used.max(axis=1))))
        if laws[-1].duration <= (1 + ENOUGH) * law.duration:
            break
        narrow *= np.maximum(used[:3], 1.0)
    return min(laws, key=lambda each: each.duration)


def _used(given: LimitedRun, law: TimeLaw) -> Floats:
    """Greatest share of each limit in every interval, (4, N)."""
    each = shares(given.run, law, given.limits, given.feed_rate, CHECKS)
    return np.asarray(each.reshape(-1, PIECES, each.shape[1]).max(axis=1).T)


def _nodes(law: TimeLaw, used: Floats, step: float) -> Floats:
    """Nodes (mm from the start) at equal times of a law, denser by `CHANGES`."""
    knots, feed = law.knots[::PIECES], np.append(law.feed[::PIECES], 0.0)
    bent = 2 * np.abs(np.diff(feed)) / (feed[1:] + feed[:-1]) * step / np.diff(knots)
    changes = np.maximum(used[1:3].max(axis=0) - 1, 0.0), bent
    density = np.ones(bent.size)
    for change, each, most in zip(changes, CHANGES, DENSER, strict=True):
        density = np.maximum(density, np.minimum(np.sqrt(change / each), most))
    count = np.concatenate([[0.0], np.cumsum(np.diff(knots) * density / step)])
    whole = int(np.ceil(count[-1]))
    nodes = law.at(np.interp(np.arange(whole + 1) * count[-1] / whole, count, knots)).length - law.length[0]
    # On a coarse mesh the feed may fall below 0 within an interval, and places go back.
    nodes = np.clip(np.maximum.accumulate(nodes), 0.0, law.end - law.length[0])
    nodes[0], nodes[-1] = 0.0, law.end - law.length[0]
    kept: Floats = nodes[distinct(nodes)]
    return kept


def distinct(nodes: Floats) -> Bools:
    """Which nodes to keep: both ends, and others that are not too near to one before or to an end."""
    near = NEAR * (nodes[-1] - nodes[0])
    inner = (np.diff(nodes)[:-1] > near) & (nodes[1:-1] - nodes[0] > near) & (nodes[-1] - nodes[1:-1] > near)
    kept: Bools = np.concatenate([[True], inner, [True]])
    return kept
