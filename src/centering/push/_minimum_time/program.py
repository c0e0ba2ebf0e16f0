"""Push of minimum time over several frictions as a nonlinear program in CasADi symbols, with exact dynamics.

Units of length F_k/k, time sqrt(M/k), force F_k. A part of friction ratio r, touched by a tip of speed v and
acceleration a, obeys d'' + B d' + d = a + r + kappa v, where d is the closing of the contact. All parts share
the motion of the tip, in segments of constant acceleration. All break away in the first segment and come to
rest in the last, each at its own time.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, sqrt
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats

# chosen: distance of the places with bounds on force and speed, sqrt(M/k); their greatest number in a segment
_WATCHED, _PLACES = 0.2, 12
# chosen: first and last segment, growth from the nearer end, longest one, sqrt(M/k)
_SEGMENT = 1.2, 0.3, 16.0
_SHORTEST, _LONGEST = 0.02, 2.0  # chosen: shortest segment, sqrt(M/k); longest one over its first guess
_CRITICAL = 1e-6  # chosen: frequency below which the swing counts as critically damped
STARTS = ((0.5, 0.8, 0.4), (2.0, 0.9, 1.0))
"""First guesses: start and stop over mu_k g, touch speed over its bound; chosen: local minima lie nearby."""
_ITERATIONS = 200  # chosen: most iterations of the solver; more only prolong a failed search
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "no_nlp_grad": True,  # how the optimum depends on data is not asked
    "error_on_fail": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": _ITERATIONS,
    "ipopt.tol": 1e-7,
    "ipopt.mu_strategy": "adaptive",
    "ipopt.mumps_permuting_scaling": 0,  # measured: a fifth of the time, for the same pushes within 2e-6
}
SOLVED = "Solve_Succeeded"


class PushTask(NamedTuple):
    """Data of the program in its units; `at_once`: all parts break away at touch, by the damper alone."""

    contact: float  # b and kappa over sqrt(k M)
    viscous: float
    breakaway: float  # F_s/F_k
    frictions: tuple[float, ...]
    distance: float
    speed: float
    acceleration: float
    margin: float
    force: float
    error: float
    fineness: float
    at_once: bool


class PushFound(NamedTuple):
    """Durations, speeds and accelerations of the segments; message and iterations of the solver."""

    duration: Floats
    velocity: Floats
    acceleration: Floats
    message: str
    steps: int


class TipState(NamedTuple):
    """State of one part: closing of the contact, speed of the part."""

    closing: Any
    speed: Any


@dataclass(frozen=True)
class Swing:
    """Part on the contact, of natural frequency 1."""

    task: PushTask

    def step(self, state: TipState, v: Any, a: Any, h: Any, r: float) -> TipState:
        """State after a time `h` of slip, exactly."""
        damping = self.task.contact + self.task.viscous
        slope = self.task.viscous * a
        rest = a + r + self.task.viscous * v - damping * slope
        away, moving = state.closing - rest, v - state.speed - slope
        stays, turns = self._turn(h)
        half = damping / 2.0
        later = away * (stays + half * turns) + moving * turns
        faster = moving * (stays - half * turns) - away * turns
        return TipState(later + rest + slope * h, v + a * h - faster - slope)

    def _turn(self, h: Any) -> tuple[Any, Any]:
        """Damped cosine and sine of a time."""
        import casadi

        half = (self.task.contact + self.task.viscous) / 2.0
        square = 1.0 - half * half
        frequency = max(sqrt(abs(square)), _CRITICAL)
        cosine, sine = (casadi.cos, casadi.sin) if square > 0.0 else (casadi.cosh, casadi.sinh)
        fading = casadi.exp(-half * h)
        return fading * cosine(frequency * h), fading * sine(frequency * h) / frequency

    def force(self, state: TipState, v: Any) -> Any:
        """Contact force."""
        return state.closing + self.task.contact * (v - state.speed)


class PushProgram:
    """Unknowns with bounds and start, objective, conditions with bounds."""

    def __init__(self, task: PushTask, start: tuple[float, float, float]) -> None:
        self.task, self.swing, self.begin = task, Swing(task), start
        self.parts: dict[str, Any] = {}
        self.lower: list[float] = []
        self.upper: list[float] = []
        self.start: list[float] = []
        self.conditions: list[Any] = []
        self.low: list[float] = []
        self.high: list[float] = []
        self._tip()
        for k, r in enumerate(task.frictions):
            self._part(k, r)

    @cached_property
    def guess(self) -> tuple[Floats, Floats, Floats]:
        """Durations, speeds (one more) and accelerations of a trapezoidal push, ends finely cut."""
        task = self.task
        gain = min(self.begin[0], task.acceleration)
        brake = min(self.begin[1] * min(task.frictions), task.acceleration)
        begin = self._touch[0] + self.begin[2] * (self._touch[1] - self._touch[0])
        reach = (task.distance + begin * begin * 0.5 / gain) / (0.5 / gain + 0.5 / brake)
        top = max(min(task.speed, sqrt(reach)), begin)
        covered = (top * top - begin * begin) * 0.5 / gain + top * top * 0.5 / brake
        ends = np.cumsum([0.0, (top - begin) / gain, max(task.distance - covered, 0.0) / top, top / brake])
        nodes = _graded(float(ends[-1]), task.fineness)
        speeds = np.interp(nodes, ends, [begin, top, top, 0.0])
        return np.diff(nodes), speeds, np.diff(speeds) / np.diff(nodes)

    @property
    def _touch(self) -> tuple[float, float]:
        """Least and greatest touch speed."""
        task = self.task
        extremes = min(task.frictions), max(task.frictions)
        least, most = (r * task.breakaway / max(task.contact, 1e-9) for r in extremes)
        return (most, task.speed) if task.at_once else (0.0, min(least, task.speed))

    def _unknown(self, name: str, start: Any, low: float, high: Any) -> Any:
        import casadi

        values = np.atleast_1d(start)
        self.parts[name] = casadi.SX.sym(name, values.size)
        self.lower += [low] * values.size
        self.upper += np.broadcast_to(high, values.shape).tolist()
        self.start += np.clip(values, low, high).tolist()
        return self.parts[name]

    def _require(self, what: Any, low: float, high: float) -> None:
        self.conditions.append(what)
        self.low.append(low)
        self.high.append(high)

    def _tip(self) -> None:
        import casadi

        task = self.task
        lasting, speeds, gains = self.guess
        self.h = self._unknown("h", lasting, _SHORTEST, _LONGEST * lasting)
        self.a = self._unknown("a", gains, -task.acceleration, task.acceleration)
        first = self._unknown("touch", speeds[0], *self._touch)
        self.v = casadi.vertcat(first, self._unknown("v", speeds[1:], 0.0, task.speed))
        for k in range(lasting.size):
            self._require(self.v[k + 1] - self.v[k] - self.a[k] * self.h[k], 0.0, 0.0)
        self.travel = casadi.sum1(0.5 * (self.v[:-1] + self.v[1:]) * self.h)

    def _part(self, k: int, r: float) -> None:
        """Add one friction: breakaway, slip from node to node, rest."""
        lasting, speeds, gains = self.guess
        resting = r + gains[1:] + self.task.viscous * speeds[1:-1]
        closing = self._unknown(f"closing{k}", resting, -np.inf, np.inf)
        speed = self._unknown(f"speed{k}", speeds[1:-1], 0.0, np.inf)
        at, begin = self._broken_away(k, r)
        for j in range(lasting.size - 1):
            v = self.v[j] + (self.a[j] * begin if j == 0 else 0.0)
            after = self._slip(at, v, self.a[j], self.h[j] - (begin if j == 0 else 0.0), r, self._places(j))
            at = TipState(closing[j], speed[j])
            self._require(after.closing - at.closing, 0.0, 0.0)
            self._require(after.speed - at.speed, 0.0, 0.0)
        self._rest(k, r, at)

    def _broken_away(self, k: int, r: float) -> tuple[TipState, Any]:
        """State and time of breakaway."""
        if self.task.at_once:
            return TipState(0.0, 0.0), 0.0
        v, a = self.v[0], self.a[0]
        t = self._unknown(f"begin{k}", 0.1 * self.guess[0][0], 0.0, np.inf)
        closing = (v + 0.5 * a * t) * t
        self._require(closing + self.task.contact * (v + a * t) - r * self.task.breakaway, 0.0, 0.0)
        self._require(self.h[0] - t, 0.0, np.inf)
        return TipState(closing, 0.0), t

    def _places(self, j: int) -> int:
        """Number of places with bounds in a segment."""
        return min(ceil(float(self.guess[0][j]) / _WATCHED) + 1, _PLACES)

    def _slip(self, at: TipState, v: Any, a: Any, h: Any, r: float, places: int) -> TipState:
        """State after a segment in which force and speed keep their bounds."""
        import casadi

        t = h * casadi.DM(np.arange(1, places + 1) / places)
        after = self.swing.step(at, v, a, t, r)
        force = self.swing.force(after, v + a * t)
        for j in range(places - 1):
            self._require(force[j], self.task.margin, self.task.force)
            self._require(after.speed[j], 0.0, np.inf)
        self._require(force[-1], self.task.margin, self.task.force)
        return TipState(after.closing[-1], after.speed[-1])

    def _rest(self, k: int, r: float, at: TipState) -> None:
        """Add the last segment: the part stops near enough, and the tip does not move it again."""
        v, a, h = self.v[-2], self.a[-1], self.h[-1]
        t = self._unknown(f"end{k}", 0.9 * self.guess[0][-1], 0.0, np.inf)
        stopped = self._slip(at, v, a, t, r, self._places(-1))
        self._require(stopped.speed, 0.0, 0.0)
        self._require(h - t, 0.0, np.inf)
        left = (self.v[-1] - 0.5 * a * (h - t)) * (h - t)
        place = self.travel - left - stopped.closing
        self._require(place - self.task.distance, -self.task.error, self.task.error)
        held = stopped.closing + left + self.task.contact * self.v[-1]
        self._require(held - r * self.task.breakaway, -np.inf, 0.0)

    def solved(self) -> PushFound:
        """Solve by interior points."""
        import casadi

        x = casadi.vertcat(*self.parts.values())
        what = {"x": x, "f": casadi.sum1(self.h), "g": casadi.vertcat(*self.conditions)}
        solver: Any = casadi.nlpsol("push", "ipopt", what, _OPTIONS)
        found = solver(x0=self.start, lbx=self.lower, ubx=self.upper, lbg=self.low, ubg=self.high)
        values = casadi.Function("tip", [x], [self.h, self.v, self.a])(found["x"])
        h, v, a = (np.asarray(each).ravel() for each in values)
        stats = solver.stats()
        return PushFound(h, v[:-1], a, str(stats["return_status"]), int(stats["iter_count"]))


def _graded(whole: float, fineness: float) -> Floats:
    """Ends of segments that grow toward the middle."""
    first, growth, most = _SEGMENT
    half = [0.0]
    while half[-1] < whole / 2.0:
        half.append(half[-1] + min(max(first, growth * half[-1]), most) / fineness)
    nodes = np.array(half) * (whole / 2.0 / half[-1])
    return np.concatenate((nodes, whole - nodes[-2::-1]))
