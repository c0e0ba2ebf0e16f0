"""The fastest law without limits of jerk: closed form, linear program, toppra, optimality, limits between
points.
"""

import logging

import numpy as np
import pytest
from finishing_inside import LimitedRun, min_time, toppra_law
from scipy.optimize import linprog
from timing_paths import ARM, LINE, TABLE, dense, ellipse, line, part, sine, wavy

from sdpgrind.finishing.timing import JointPath, time_laws, worst_violation

FAST = 1e3  # mm/s: a feed that is seldom the limit


def rows(run, limits, grid):
    """Constraints as printed by Pham: derivatives over limits, greatest squared feed."""
    q1, q2 = run.at(grid, 1), run.at(grid, 2)
    speed, most, _ = limits.table
    cap = np.minimum(FAST**2, 1 / np.maximum(np.max((q1 / speed) ** 2, axis=1), 1e-30))
    return q1 / most, q2 / most, cap


def linear_program(run, limits, grid):
    """The whole course as one linear program: of all courses the one with the greatest sum of squared feeds."""
    p, c, cap = rows(run, limits, grid)
    count, step = grid.size, np.diff(grid)
    lines = []
    for k in range(count - 1):
        for end in (k, k + 1):
            for joint in range(p.shape[1]):
                row = np.zeros(count)
                row[k], row[k + 1] = -p[end, joint] / (2 * step[k]), p[end, joint] / (2 * step[k])
                row[end] += c[end, joint]
                lines += [row, -row]
    bounds = [(0.0, 0.0), *[(0.0, value) for value in cap[1:-1]], (0.0, 0.0)]
    return linprog(-np.ones(count), A_ub=np.array(lines), b_ub=np.ones(len(lines)), bounds=bounds).x


def swept_by_programs(run, limits, grid):
    """The same sweep as the kernel's, each step a linear program in (x, u), solved by scipy: backward, then
    forward.
    """
    p, c, cap = rows(run, limits, grid)
    x = np.zeros(grid.size)

    def best(k, cost, low, high):
        step = grid[k + 1] - grid[k]
        here, there = (
            np.column_stack([c[k], p[k]]),
            np.column_stack([c[k + 1], p[k + 1] + 2 * step * c[k + 1]]),
        )
        end = np.array([[1.0, 2 * step]])
        A = np.vstack([here, -here, there, -there, end, -end])
        b = np.concatenate([np.ones(4 * p.shape[1]), [x[k + 1], 0.0]])
        return linprog(cost, A_ub=A, b_ub=b, bounds=[(low, high), (None, None)]).x

    for k in range(grid.size - 2, 0, -1):
        x[k] = best(k, [-1.0, 0.0], 0.0, cap[k])[0]
    for k in range(grid.size - 1):
        x[k + 1] = min(x[k + 1], x[k] + 2 * (grid[k + 1] - grid[k]) * best(k, [0.0, -1.0], x[k], x[k])[1])
    return x


def duration(grid, x):
    feed = np.sqrt(np.maximum(x, 0.0))
    return float(np.sum(2 * np.diff(grid) / (feed[1:] + feed[:-1])))


COARSE = {"sine": sine(samples=41), "ellipse": ellipse(samples=41), "wavy": wavy(5, samples=41)}


@pytest.mark.parametrize("name", COARSE)
def test_sweep_is_a_sweep_of_linear_programs(name):
    run = COARSE[name]
    limits = ARM if name == "wavy" else TABLE
    swept, by_programs = (
        min_time.swept(LimitedRun(run, limits, FAST), run.length),
        swept_by_programs(run, limits, run.length),
    )
    # the programs are feasible to 1e-7, in rows of order 1
    assert duration(run.length, swept) == pytest.approx(duration(run.length, by_programs), rel=3e-5)
    # where a row has no say in u, its own rounding has: the course may differ there, its time does not
    if name != "sine":
        assert np.allclose(swept, by_programs, atol=1e-4 * np.max(swept))


@pytest.mark.parametrize("name", COARSE)
def test_no_course_of_one_great_program_is_much_faster(name):
    """A sweep is the best course in the limit of small steps only; on forty steps it may lose a little to the
    whole program.
    """
    run = COARSE[name]
    limits = ARM if name == "wavy" else TABLE
    swept, whole = (
        min_time.swept(LimitedRun(run, limits, FAST), run.length),
        linear_program(run, limits, run.length),
    )
    assert duration(run.length, swept) == pytest.approx(duration(run.length, whole), rel=2e-3)


@pytest.mark.parametrize("method", ["min_time", "toppra"])
def test_straight_line_in_closed_form(method):
    """9 mm at 25 mm/s, reached in 0.09 s: 0.36 s + 0.09 s; its corners are points of both grids."""
    limits = LINE.replace(acceleration_max=(25.0 / 0.09,))
    (law,) = time_laws([line(9.0)], limits, feed_rate=100.0, method=method)
    assert law.duration == pytest.approx(0.45, rel=1e-6)


@pytest.mark.parametrize("span", [0.2, 1.25, 7.0])
def test_is_the_trapezoid_where_only_the_path_is_limited(span):
    shape, fastest = (
        time_laws(
            [line(span)],
            LINE.replace(speed_max=(1e4,), acceleration_max=(1e7,)),
            feed_rate=25.0,
            acceleration=500.0,
            method=m,
        )
        for m in ("trapezoid", "min_time")
    )
    # where a trapezoid's corner is between points, one interval of a few hundred is not at a limit
    assert (
        shape[0].duration * (1 - 1e-9) <= fastest[0].duration <= shape[0].duration * (1 + 2 * min_time.GAIN)
    )


def by_toppra(run, limits, parts):
    grid = min_time.grid_of(run, parts)
    return duration(
        grid, toppra_law._solved(grid, min_time.rows_of(LimitedRun(run, limits, FAST), grid)) ** 2
    )


@pytest.mark.parametrize("seed", range(20))
def test_twenty_random_paths_against_toppra_and_between_points(seed):
    run = wavy(seed)
    (law,) = time_laws([run], ARM, feed_rate=FAST, method="min_time")
    coarse, fine = by_toppra(run, ARM, 16), by_toppra(run, ARM, 32)
    # its error falls with the step: twice the finer less the coarser is its limit
    assert law.duration == pytest.approx(2 * fine - coarse, rel=1e-3)
    grid = min_time.grid_of(run, 32)
    assert duration(grid, min_time.swept(LimitedRun(run, ARM, FAST), grid)) == pytest.approx(fine, rel=1e-6)
    assert worst_violation([run], [law], limits=ARM, feed_rate=FAST, refine=20).ratio <= 1 + 1e-6
    speed, acceleration, _, feed = dense(run, law, ARM, FAST)
    assert max(speed, acceleration, feed) <= 1 + 1e-6


@pytest.mark.parametrize("run", [wavy(1), wavy(2), ellipse(samples=101)], ids=["wavy 1", "wavy 2", "ellipse"])
def test_some_limit_is_reached_everywhere(run):
    """Bang-bang: in every interval a row or a speed is at its limit, but for the few in which it changes
    over.
    """
    limits = ARM if run.joints.shape[1] == 7 else TABLE
    grid = min_time.grid_of(run, 10)
    x = min_time.swept(LimitedRun(run, limits, FAST), grid)
    p, c, cap = rows(run, limits, grid)
    u = (np.diff(x) / (2 * np.diff(grid)))[:, None]
    used = np.maximum(
        np.abs(p[:-1] * u + c[:-1] * x[:-1, None]), np.abs(p[1:] * u + c[1:] * x[1:, None])
    ).max(axis=1)
    at_limit = (used >= 1 - 1e-6) | (x[:-1] >= cap[:-1] * (1 - 1e-9)) | (x[1:] >= cap[1:] * (1 - 1e-9))
    assert np.max(used) <= 1 + 1e-9
    assert np.mean(at_limit) >= 0.97


def test_half_the_step_halves_the_error():
    run = wavy(4)
    times = [
        duration(grid, min_time.swept(LimitedRun(run, ARM, FAST), grid))
        for grid in (min_time.grid_of(run, n) for n in (8, 16, 32))
    ]
    assert times[0] > times[1] > times[2]
    assert (times[0] - times[1]) / (times[1] - times[2]) == pytest.approx(2.0, abs=0.8)


def test_a_zero_inertia_point_is_passed():
    """A joint that turns round has no inertia at its turning point; only its curvature limits the feed there."""
    s = np.linspace(-5.0, 5.0, 41)
    run = JointPath(s, np.column_stack([s, 0.05 * s**2]))
    limits = TABLE.replace(acceleration_max=(2000.0, 40.0))
    (law,) = time_laws([run], limits, feed_rate=FAST, method="min_time")
    assert worst_violation([run], [law], limits=limits, feed_rate=FAST).held
    assert law.at(law.time_at(0.0)).feed == pytest.approx(np.sqrt(40.0 / 0.1), rel=1e-3)


def test_many_bends_between_points_of_a_coarse_grid_are_refined():
    """Half a mm resolves a wave of 1.6 mm so badly that the joints could only rest."""
    s = np.linspace(0.0, 400.0, 801)
    run = JointPath(s, np.column_stack([3.0 * np.sin(3.9 * s), s]))
    law = time_laws([run], TABLE, feed_rate=25.0, method="min_time")[0]
    assert np.isfinite(law.duration)
    assert worst_violation([run], [law], limits=TABLE, feed_rate=25.0).held


def test_tighter_limits_take_longer():
    run = part(wavy(7), 5.0, 9.0)
    (free,) = time_laws([run], ARM, feed_rate=FAST, method="min_time")
    for name in ("speed_max", "acceleration_max"):
        tight = ARM.replace(**{name: tuple(0.5 * np.array(getattr(ARM, name)))})
        assert time_laws([run], tight, feed_rate=FAST, method="min_time")[0].duration >= free.duration


def test_backward_is_as_fast_as_forward():
    run = wavy(9)
    back = JointPath(run.length, run.joints[::-1])
    times = [time_laws([each], ARM, feed_rate=FAST, method="min_time")[0].duration for each in (run, back)]
    assert times[0] == pytest.approx(times[1], rel=2 * min_time.GAIN)


def test_toppra_is_quiet(caplog, capsys):
    with caplog.at_level(logging.DEBUG):
        (law,) = time_laws([wavy(0)], ARM, feed_rate=FAST, method="toppra")
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert capsys.readouterr() == ("", "")
    assert worst_violation([wavy(0)], [law], limits=ARM, feed_rate=FAST).held


def test_first_and_last_feeds_are_rest():
    (law,) = time_laws([wavy(3)], ARM, feed_rate=FAST, method="min_time")
    end = law.at([0.0, law.duration])
    assert np.allclose(end.feed, 0.0, atol=1e-6)
    assert end.length == pytest.approx([0.0, 30.0], abs=1e-9)
