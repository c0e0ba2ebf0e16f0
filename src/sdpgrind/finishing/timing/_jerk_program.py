"""Nonlinear program of a jerk-limited law on given points of a run, in CasADi.

The points are fixed and the times between them free, so that a joint's derivatives over arc length are
numbers. Written over time, the course has no singularity at rest. All values are scaled by a length and a
time of the run.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing._time_law import advanced

ROWS = 3  # of each joint and interval, derived: jerk at both ends, acceleration at the later one
PLUGINS = ("fatrop", "ipopt")  # solvers, by preference
SHORTEST = 1e-3  # chosen: least duration of an interval over that of the first guess


class JerkProgram(NamedTuple):
    """Solver for a number of intervals, with the constant bounds."""

    solver: Any
    intervals: int
    low: Floats
    high: Floats


class Data(NamedTuple):
    """A run, scaled.

    Jerk of a joint over its limit is (q3 v^3 + 3 q2 v a + q1 j), acceleration (q1 a + q2 v^2) times its
    `weight`.
    """

    rates: Floats  # (N + 1, 3, n): q1, q2, q3
    weight: Floats  # (n,)
    steps: Floats  # (N,)
    feed: Floats  # (N + 1,) greatest feed at the points
    acceleration: float  # greatest along the path
    guess: Floats  # (N + 1, 4): feed, acceleration, duration, jerk


class JerkFound(NamedTuple):
    """Solution, scaled."""

    durations: Floats
    jerks: Floats
    solved: bool
    message: str


@lru_cache(maxsize=16)
def program(intervals: int, joints: int, plugin: str) -> JerkProgram:
    """Build the program for numbers of intervals and joints; cached for all runs."""
    p = [ca.SX.sym(f"q{d}", joints, intervals + 1) for d in (1, 2, 3)]
    weight, steps = ca.SX.sym("weight", joints), ca.SX.sym("steps", intervals)
    unknowns, rows, total = [ca.SX.sym("x0", 2)], [], ca.SX(0)
    for k in range(intervals):
        u, after = ca.SX.sym(f"u{k}", 2), ca.SX.sym(f"x{k + 1}", 2)
        rows.append(_interval(unknowns[-1], u, after, steps[k], [(q[:, k], q[:, k + 1]) for q in p], weight))
        unknowns += [u, after]
        total += u[0]
    known = ca.vertcat(*(ca.vec(q) for q in p), weight, steps)
    what = {"x": ca.vertcat(*unknowns), "f": total, "g": ca.vertcat(*rows), "p": known}
    low = np.tile([0.0, 0.0, 0.0, 0.0, *[-1.0] * (ROWS * joints)], intervals)
    high = np.tile([0.0, 0.0, 0.0, np.inf, *[1.0] * (ROWS * joints)], intervals)
    equal = [True] * 3 + [False] * (1 + ROWS * joints)
    return JerkProgram(_solver(plugin, what, equal * intervals), intervals, low, high)


def _interval(x: Any, u: Any, after: Any, step: Any, ends: list[Any], weight: Any) -> Any:
    """Rows of one interval: continuity (2), length, feed between its ends, and limits of the joints."""
    v, a, t, j = x[0], x[1], u[0], u[1]
    (q1, r1), (q2, r2), (q3, r3) = ends
    way, w, b = advanced(t, -step, v, a, j)  # the solver needs rows in terms of an interval's start
    between = v + t * a / 2  # bounds the parabola together with its ends
    joints = (
        q3 * v**3 + 3 * q2 * v * a + q1 * j,
        r3 * w**3 + 3 * r2 * w * b + r1 * j,
        weight * (r1 * b + r2 * w**2),
    )
    return ca.vertcat(after[0] - w, after[1] - b, way, between, *joints)


def _solver(plugin: str, what: dict[str, Any], equal: list[bool]) -> Any:
    """Interior-point solver: along the chain of intervals ("fatrop"), or on any sparse program ("ipopt")."""
    chain = (
        {"structure_detection": "auto", "equality": equal} if plugin == "fatrop" else {f"{plugin}.sb": "yes"}
    )
    own = {"print_level": 0, "tol": 1e-6, "mu_init": 1e-3, "max_iter": 300}
    options: dict[str, Any] = {"print_time": False, "error_on_fail": False, **chain}
    return ca.nlpsol(
        "law", plugin, what, options | {f"{plugin}.{name}": value for name, value in own.items()}
    )


def solve(data: Data) -> JerkFound:
    """Solve from rest to rest; the second solver where the first one fails or is missing."""
    intervals, _, joints = data.rates.shape
    for plugin in PLUGINS:
        if ca.has_nlpsol(plugin):
            found = _solved(program(intervals - 1, joints, plugin), data)
            if found.solved:
                break
    return found


def _solved(made: JerkProgram, data: Data) -> JerkFound:
    """Solve by one solver."""
    count = made.intervals
    low = np.tile([0.0, -data.acceleration, SHORTEST, -np.inf], count + 1)
    high = np.tile([0.0, data.acceleration, np.inf, np.inf], count + 1)
    high[::4] = data.feed
    low[:2] = high[:2] = 0.0
    low[4 * count : 4 * count + 2] = high[4 * count : 4 * count + 2] = 0.0
    above = made.high.copy()
    above[3 :: made.high.size // count] = np.minimum(data.feed[1:], data.feed[:-1])
    known = np.concatenate([*(data.rates[:, d].ravel() for d in range(3)), data.weight, data.steps])
    size = 4 * count + 2
    bounds = {"lbx": low[:size], "ubx": high[:size], "lbg": made.low, "ubg": above}
    try:
        found = made.solver(x0=data.guess.ravel()[:size], p=known, **bounds)
    except RuntimeError as error:  # unusable numbers
        return JerkFound(np.zeros(count), np.zeros(count), False, str(error).splitlines()[-1])
    stats = made.solver.stats()
    moves = _moves(found["x"], count)
    return JerkFound(moves[:, 0], moves[:, 1], bool(stats["success"]), str(stats["return_status"]))


def _moves(x: Any, count: int) -> Floats:
    """Duration and jerk of every interval, (N, 2)."""
    return np.append(np.asarray(x).ravel(), [0.0, 0.0]).reshape(count + 1, 4)[:-1, 2:]
