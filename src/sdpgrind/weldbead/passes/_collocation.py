"""A pass as an optimal control problem, by Radau collocation in CasADi: least distance of tip and path.

While one patch cuts at the tip, the disc's angle theta follows a differential equation. With the front of the
patch at x_f, ``z(x_f) = y + (x_f - x_t) tan(theta)``, and its length l = (x_f - x_t)/cos(theta), the power
balance is ``K1 w l ((R - l/2) theta' + V sin(theta) - H' cos(theta)) + K2 = power(theta)``. Near the ends of
the bead it does not hold: the heights there are those of the inverse plan. Every solution is replayed by the
balance of volumes.

With `Freedom` the feed is a control and the end time free: the distance of the tip is weighed against time.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sdpgrind import physics
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.base.stored import stored
from sdpgrind.weldbead.passes._problem import PassProblem
from sdpgrind.weldbead.passes._simulate import PassRecord, simulate

INTERVALS = 100  # chosen: fewer let the replay exceed the limits by more, more cost time
RADAU = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])  # source: Radau IIA of order 3
PLACES, WEIGHTS = np.array([1 / 3, 1.0]), (0.75, 0.25)  # its stages
# chosen: weight of the squared platform speed (mm^2/s^2) against the squared distance of the tip (mm^2)
MOTION = 1e-4
# measured: replays on waves of 40 mm exceeded the burning force by up to 0.85 % without this reserve
RESERVE = 0.01
REPLAYED = 5e-3  # chosen: mm rms; a replay farther from its solution refutes it
ENGAGED = 3.0  # chosen: mm; the equation is not used nearer to the ends of the bead


@described()
class Freedom(Described):
    """Freedom of the optimal control of a pass: range of the feed, and limits on rates.

    All limits hold in the solution, that of burning at the feed of each place. Where its replay begins and
    ends cutting, force and power overshoot by a few percent. A replay that burns is not used: the plan is
    then that of "inverse", at the feed of the problem.

    Parameters
    ----------
    feed_rate_min, feed_rate_max : float
        Range of the feed, mm/s.
    time_weight : float
        Cost of a second, against the squared distance of the tip over a second, mm^2.
    height_rate_max : float
        Greatest vertical speed of the centre, mm/s.
    force_rate_max : float
        Greatest rate of the normal force, N/s.

    Raises
    ------
    ValueError
        When a value is not positive, or the range of the feed is empty.

    Examples
    --------
    >>> Freedom(feed_rate_min=5.0, feed_rate_max=40.0).time_weight
    0.001
    """

    feed_rate_min: float = quantity("mm/s", above=0, usual=(0.05, 1000.0), typical=10)
    feed_rate_max: float = custom(unit="mm/s")  # may be infinite
    time_weight: float = quantity("mm^2", at_least=0, default=1e-3)
    height_rate_max: float = custom(unit="mm/s", default=np.inf)
    force_rate_max: float = custom(unit="N/s", default=np.inf)

    def _check(self) -> None:
        if not self.feed_rate_max >= self.feed_rate_min:
            raise self._refused("feed_rate_max", f">= feed_rate_min, {self.feed_rate_min:g}")
        for name in ("height_rate_max", "force_rate_max"):
            if not getattr(self, name) > 0:
                raise self._refused(name, "> 0")


@stored("weldbead.collocation")
@dataclasses.dataclass(frozen=True)
class Collocation:
    """Outcome of the optimal control problem.

    Attributes
    ----------
    iterations : int
        Iterations of the interior-point method.
    residual : float
        Largest violation of the optimality conditions, scaled, unit 1.
    replay_error : float
        Distance of the replayed tip from the solution's, mm rms.
    message : str
        Status of the solver, or why there is no solution.
    """

    iterations: int
    residual: float
    replay_error: float
    message: str


class _Window(NamedTuple):
    """Ends of the intervals: time, s, position of the centre, mm, and the inverse plan there (mm, rad)."""

    time: Floats
    center: Floats
    height: Floats
    wind: Floats


class _Transcription(NamedTuple):
    """Optimal control problem: unknowns at ends and stages of its intervals."""

    opti: Any
    problem: PassProblem
    window: _Window
    wind: Any  # rad, at the ends
    height: Any  # mm, at the ends
    speed: Any  # of the height, mm/s, (stages, intervals)
    turn: Any  # of the wind-up, 1/100 rad/s, (stages, intervals)
    front: Any  # distance ahead of the tip, mm, (stages, intervals)


class _Solved(NamedTuple):
    """Solution at the ends of the intervals: wind-up, height, speed of the height, time, and feed."""

    wind: Floats
    height: Floats
    speed: Floats
    time: Floats
    feed: Floats


def collocate(
    problem: PassProblem, start: PassRecord, freedom: Freedom | None = None
) -> tuple[PassRecord | None, Collocation]:
    """Solve from the inverse plan `start`; None, with the reason, where there is no usable solution."""
    if problem.disc.rotational_stiffness is None:
        return None, Collocation(
            0, np.inf, np.inf, "a compliance table has no smooth torque: rotational_stiffness is needed"
        )
    inside = (start.tip_x > problem.bead.x[0] + ENGAGED) & (start.tip_x < problem.bead.x[-1] - ENGAGED)
    if not np.any(inside) or np.any(start.patches[inside] != 1):
        return None, Collocation(0, np.inf, np.inf, "the pass is no cut of one patch all along")
    first, last = np.flatnonzero(inside)[[0, -1]]
    time = np.linspace(float(start.time[first]), float(start.time[last]), INTERVALS + 1)
    columns = (start.center_x, start.fly_height, problem.disc.relaxed_angle - start.disk_angle)
    window = _Window(time, *(np.interp(time, start.time, column) for column in columns))
    solved, iterations, residual, message = _solve(problem, window, freedom)
    if solved is None:
        return None, Collocation(iterations, residual, np.inf, message)
    record, error = _replay(problem, start, window, solved)
    if error > REPLAYED:
        return None, Collocation(
            iterations, residual, error, f"the replay is {1e3 * error:.2g} µm off the solution"
        )
    burns = float(np.max(record.normal_force[1:] - problem.burn_force(np.round(record.feed_rate, 9))))
    if burns > 1e-6:
        return None, Collocation(iterations, residual, error, f"the replay burns, by up to {burns:.3g} N")
    return record, Collocation(iterations, residual, error, message)


def _solve(
    problem: PassProblem, window: _Window, freedom: Freedom | None
) -> tuple[_Solved | None, int, float, str]:
    """Return the solution by IPOPT, iterations, residual of the optimality conditions, message."""
    import casadi

    opti, count = casadi.Opti(), window.time.size - 1
    wind, height = (opti.variable(count + 1) for _ in range(2))
    speed, turn, front = (opti.variable(2, count) for _ in range(3))
    program = _Transcription(opti, problem, window, wind, height, speed, turn, front)
    _guess(program)
    steps, feeds = _pace(opti, problem, window, freedom)
    charges = _constrained(program, _interval(problem, window, _burning(problem, freedom)), steps, feeds)
    opti.subject_to(wind[0] == float(window.wind[0]))
    opti.subject_to(height[0] == float(window.height[0]))
    if freedom is not None:
        _rates(program, freedom)
    time: Any = 0 if freedom is None else freedom.time_weight * casadi.sum1(steps)
    opti.minimize(time + casadi.sum2(charges))
    return _solution(program, steps, feeds)


def _constrained(program: _Transcription, interval: Any, steps: Any, feeds: Any) -> Any:
    """Constrain all intervals, of `steps` s, at `feeds`; return the cost of each."""
    import casadi

    p, opti, count = program, program.opti, program.window.time.size - 1
    starts = casadi.horzcat(p.wind[:-1], p.height[:-1]).T
    places = casadi.DM(p.window.center[:-1]).T
    ends, balances, force, over, charges = interval.map(count)(
        starts, p.speed, p.turn, p.front, casadi.vertcat(places, steps.T, feeds.T)
    )
    opti.subject_to(casadi.vec(balances) == 0)
    opti.subject_to(casadi.vec(p.front) >= 0)
    opti.subject_to(opti.bounded(0, casadi.vec(force) / 100, p.problem.grinder_limit / 100))
    if not over.is_empty():
        opti.subject_to(casadi.vec(over) / 100 <= 0)
    opti.subject_to(p.wind[1:] == ends[0, :].T)
    opti.subject_to(p.height[1:] == ends[1, :].T)
    return charges


def _interval(problem: PassProblem, window: _Window, burn: Any) -> Any:
    """Return the function of one interval; expressions for all take six times as long to solve (measured).

    From wind-up and height (rad, mm), rates and fronts of both stages, and (place, step, feed): wind-up and
    height at the end, balances that must be 0, forces (N), those beyond the burn limit, and the cost.
    """
    import casadi

    start, place = casadi.MX.sym("start", 2), casadi.MX.sym("place", 3)
    speed, turn, front = (casadi.MX.sym(name, 2) for name in ("speed", "turn", "front"))
    splines = _spline("path", problem.tip_path, problem), _spline("bead", problem.bead, problem)
    way, (center, step, feed) = float(window.center[1] - window.center[0]), casadi.vertsplit(place)
    balances, forces, over, charge = [], [], [], 0
    for j in range(2):
        wind = start[0] + step * (RADAU[j, 0] * turn[0] + RADAU[j, 1] * turn[1]) / 100
        height = start[1] + step * (RADAU[j, 0] * speed[0] + RADAU[j, 1] * speed[1])
        stage = wind, height, center + PLACES[j] * way, turn[j] / 100, speed[j], front[j]
        demanded, gap, force = _conditions(problem, splines, stage, feed)
        balances += demanded
        forces.append(force)
        over += [] if burn is None else [force - burn(feed)]
        charge += step * WEIGHTS[j] * (gap**2 + MOTION * speed[j] ** 2)
    results = [casadi.vertcat(*each) for each in ((wind, height), balances, forces, over)]
    return casadi.Function("interval", [start, speed, turn, front, place], [*results, charge])


def _solution(program: _Transcription, steps: Any, feeds: Any) -> tuple[_Solved | None, int, float, str]:
    """Run IPOPT; return as `_solve`."""
    opti = program.opti
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 300})
    try:
        found = opti.solve()
    except RuntimeError:
        stats = opti.stats()
        return None, int(stats["iter_count"]), np.inf, f"the solver stopped: {stats['return_status']}"
    stats = opti.stats()
    residual = max(float(stats["iterations"][name][-1]) for name in ("inf_pr", "inf_du"))
    lasts, fed = (np.atleast_1d(np.array(found.value(each), dtype=float)) for each in (steps, feeds))
    wind, height = np.array(found.value(program.wind)), np.array(found.value(program.height))
    speed = np.asarray(found.value(program.speed))[1]
    time = program.window.time[0] + np.concatenate([[0.0], np.cumsum(lasts)])
    solved = _Solved(wind, height, speed, time, fed)
    return solved, int(stats["iter_count"]), residual, str(stats["return_status"])


def _pace(opti: Any, problem: PassProblem, window: _Window, freedom: Freedom | None) -> tuple[Any, Any]:
    """Return time, s, and feed, mm/s, of each interval: given, or the feed free over equal distances."""
    import casadi

    count, way = window.time.size - 1, float(window.center[1] - window.center[0])
    if freedom is None:
        return casadi.DM.ones(count) * (way / problem.feed_rate), casadi.DM.ones(count) * problem.feed_rate
    feed = opti.variable(count)
    opti.subject_to(opti.bounded(freedom.feed_rate_min, feed, freedom.feed_rate_max))
    opti.set_initial(feed, min(max(problem.feed_rate, freedom.feed_rate_min), freedom.feed_rate_max))
    return way / feed, feed


def _rates(program: _Transcription, freedom: Freedom) -> None:
    """Limit the rates of height and force."""
    import casadi

    opti, disk = program.opti, program.problem.disc
    stiff = float(disk.spring_torque(1e-3)) / 1e-3 / disk.model.disk_radius
    of_height = program.speed, freedom.height_rate_max
    of_force = program.turn * stiff / 100, freedom.force_rate_max
    for rate, most in (of_height, of_force):
        if np.isfinite(most):
            opti.subject_to(opti.bounded(-1, casadi.vec(rate) / most, 1))


def _conditions(
    problem: PassProblem, splines: tuple[Any, Any], stage: tuple[Any, ...], feed: Any
) -> tuple[list[Any], Any, Any]:
    """Return balances of power and front at one point, 0 in a solution; distance of the tip, mm; force, N."""
    import casadi

    wind, height, center, turn, speed, front = stage
    (path, bead), disk, m = splines, problem.disc, problem.disc.model
    angle = disk.relaxed_angle - wind
    torque = float(disk.spring_torque(1e-3)) / 1e-3 * wind
    power = physics.disk_power(m.friction_ratio * torque, m.free_speed, m.speed_droop)
    tip_x, tip_z = center - m.disk_radius * casadi.cos(angle), height - m.disk_radius * casadi.sin(angle)
    length = front / casadi.cos(angle)
    advance = feed * casadi.sin(angle) - speed * casadi.cos(angle)
    into = -(m.disk_radius - length / 2) * turn + advance  # the angle falls as the spring winds up
    of_power = (m.specific_energy * m.bead_width * length * into + m.idle_power - power) / 1000
    of_front = bead(tip_x + front) - (tip_z + front * casadi.tan(angle))
    return [of_power, of_front], tip_z - path(tip_x), torque / m.disk_radius


def _burning(problem: PassProblem, freedom: Freedom | None) -> Any:
    """Return the burning force less the reserve, N, as a smooth function of feed; None: no burn limit."""
    import casadi

    if problem.burn_limit is None:
        return None
    low, high = (
        (problem.feed_rate,) * 2 if freedom is None else (freedom.feed_rate_min, freedom.feed_rate_max)
    )
    feed = np.geomspace(0.999 * low, 1.001 * high, 200)
    most = (1 - RESERVE) * np.minimum(problem.burn_force(feed), 3 * problem.grinder_limit)
    return casadi.interpolant("burn", "bspline", [feed], most)


def _spline(name: str, contour: Any, problem: PassProblem) -> Any:
    """Return a smooth curve through a contour for the solver."""
    import casadi

    x = np.linspace(problem.bead.x[0], problem.bead.x[-1], max(50, round(problem.bead.length / 0.5)) + 1)
    return casadi.interpolant(name, "bspline", [x], contour.at(x))


def _guess(program: _Transcription) -> None:
    """Start from the inverse plan."""
    opti, problem, window = program.opti, program.problem, program.window
    opti.set_initial(program.wind, window.wind)
    opti.set_initial(program.height, window.height)
    angle = problem.disc.relaxed_angle - window.wind
    x = window.center - problem.disc.model.disk_radius * np.cos(angle)
    depth = np.maximum(1e-3, problem.bead.at(x) - problem.tip_path.at(x)) / np.tan(angle)
    opti.set_initial(program.front, np.tile(0.5 * (depth[1:] + depth[:-1]), (2, 1)))


def _replay(
    problem: PassProblem, start: PassRecord, window: _Window, solved: _Solved
) -> tuple[PassRecord, float]:
    """Replay the heights by the balance of volumes, outside the window those of the inverse plan."""
    center = start.center_x
    inside = (center >= window.center[0]) & (center <= window.center[-1])
    feeds = solved.feed[np.clip(np.searchsorted(window.center, center[1:]) - 1, 0, solved.feed.size - 1)]
    time = np.interp(np.clip(center, window.center[0], window.center[-1]), window.center, solved.time)
    first = (solved.height[1] - solved.height[0]) / (solved.time[1] - solved.time[0])
    # the second stage is the end of its interval
    curve = CubicHermiteSpline(solved.time, solved.height, np.append(first, solved.speed))
    played = np.where(inside, curve(time), start.fly_height)
    # Behind the window the plan continues from the end of the solution.
    played[center > window.center[-1]] += solved.height[-1] - window.height[-1]
    disk, spacing = problem.disc, problem.spacing
    record = simulate(
        disk, problem.bead, center_x=center, fly_height=played, feed_rate=feeds, spacing=spacing
    )
    tip_z = solved.height - disk.model.disk_radius * np.sin(disk.relaxed_angle - solved.wind)
    later = solved.time > solved.time[0] + 0.2
    error = np.interp(window.center, record.center_x, record.tip_z) - tip_z
    return record, float(np.sqrt(np.mean(error[later] ** 2)))
