"""Laws by toppra: straight lines in closed form, spots that are too fast between the points of a grid, what
toppra loses.
"""

import numpy as np
import pytest
from finishing_inside import LimitedRun, min_time, narrowed, toppra_law
from timing_paths import ARM, LINE, TABLE, line, wavy

from sdpgrind import finishing as fin
from sdpgrind.finishing.timing import JointPath, Trapezoid, time_laws, worst_violation

PITCHES = [(6.4, 0.2), (8.0, 0.4), (3.0, 1.7)]


def straight(span, azimuth, seed=0):
    """The table on a straight line, begun far from 0; five joints are at rest but for rounding."""
    noise = np.random.default_rng(seed).uniform(-1, 1, size=(61, 7)) * 1e-15
    s = np.linspace(0.0, span, 61)[:, None]
    way = np.array([0.3, -0.2, 0.5, 0.1, 0.0, np.cos(azimuth), np.sin(azimuth)])
    return JointPath(
        s[:, 0] + 40.0, noise + np.array([0.3, -0.2, 0.5, 0.1, 0.0, 0.0, 0.0]) + s * (np.arange(7) > 4) * way
    )


@pytest.mark.parametrize("feed", [5.0, 20.0, 25.0, 50.0])
@pytest.mark.parametrize("span", [0.2, 0.4, 6.2, 100.0])
@pytest.mark.parametrize("azimuth", [0.0, 0.3, np.pi / 2])
def test_straight_lines_are_the_trapezoid(span, feed, azimuth):
    run = straight(span, azimuth)
    (law,) = time_laws([run], ARM, feed_rate=feed, method="toppra")
    shape = Trapezoid(span, feed, 2000.0 / max(np.cos(azimuth), np.sin(azimuth)))
    # the corners of the trapezoid are points of the grid: what is left are toppra's tolerances
    assert law.duration == pytest.approx(shape.duration, rel=1e-6)


@pytest.mark.parametrize(("side", "pitch"), PITCHES)
def test_zigzags_on_a_flat(side, pitch):
    problem = fin.FinishingProblem(
        fin.zigzag(fin.surface.flat_surface(side), pitch=pitch), feed_rate=20.0, acceleration=2000.0
    )
    motion = fin.plan(problem, method="toppra")
    assert motion.worst_violation.ratio <= 1 + 1e-6
    # every leg is a trapezoid at the acceleration of the table, which that method is told as the path's
    assert motion.duration == pytest.approx(fin.plan(problem, method="trapezoid").duration, rel=1e-6)


def test_joints_at_rest_do_not_limit():
    run = JointPath([0.0, 5.0, 10.0], np.zeros((3, 2)))
    (law,) = time_laws([run], TABLE, feed_rate=10.0, acceleration=500.0, method="toppra")
    assert law.duration == pytest.approx(Trapezoid(10.0, 10.0, 500.0).duration, rel=1e-6)


@pytest.fixture(scope="module")
def rounded():
    """A path through rounded corners, where a limit is exceeded between the points of any coarse grid."""
    path = fin.zigzag(fin.preset("nominal").surface, pitch=4.0).blended(0.1)
    return fin.FinishingProblem(path)


def test_rounded_corners_slow_only_themselves(rounded):
    ours, theirs = (fin.plan(free(rounded), method=method) for method in ("min_time", "toppra"))
    assert theirs.worst_violation.ratio <= 1.001
    assert ours.duration * (1 - 1e-3) <= theirs.duration <= 1.01 * ours.duration
    assert np.max(theirs.feed_rate) == pytest.approx(rounded.feed_rate, rel=2e-3)


def free(problem):
    """Without limits of jerk, which min_time would keep."""
    return problem.replace(robot=problem.robot.replace(jerk_max=None))


def bumpy():
    """A joint that curves sharply at one spot between two points of the grid, in a long run."""
    s = np.linspace(0.0, 60.0, 121)
    return JointPath(s, np.column_stack([s, 0.02 / (1 + ((s - 30.25) / 0.4) ** 2)]))


def test_limits_are_narrowed_about_a_spot_only():
    run, limits = bumpy(), TABLE.replace(acceleration_max=(2000.0, 40.0))
    grid = min_time.grid_of(run, 1)
    plain = min_time.law_of(grid, min_time.swept(LimitedRun(run, limits, 40.0), grid))
    before = worst_violation([run], [plain], limits=limits, feed_rate=40.0)
    law, factors = min_time.kept_on(LimitedRun(run, limits, 40.0), grid)
    assert before.ratio > 1.05
    assert worst_violation([run], [law], limits=limits, feed_rate=40.0).ratio <= 1 + 1e-6
    assert np.all(np.abs(grid[factors.max(axis=0) > 1] - 30.25) < 3.0)
    assert law.at(law.time_at(15.0)).feed == pytest.approx(40.0, rel=1e-3)


def test_what_cannot_be_narrowed_is_slowed():
    """A solver that is deaf to factors gets its own law, played slower as a whole."""
    run, limits = bumpy(), TABLE.replace(acceleration_max=(2000.0, 40.0))
    grid = min_time.grid_of(run, 1)
    plain = min_time.law_of(grid, min_time.swept(LimitedRun(run, limits, 40.0), grid))
    law, factors = narrowed(LimitedRun(run, limits, 40.0), grid.size, lambda _: plain)
    ratio = worst_violation([run], [plain], limits=limits, feed_rate=40.0).ratio
    assert law.duration == pytest.approx(plain.duration * ratio**0.5, rel=1e-6)
    assert np.all(factors == 1)


@pytest.mark.parametrize(
    "first", [None, np.nan, 0.0, 1e-3], ids=["nothing", "not a number", "rest", "stalled"]
)
def test_another_grid_where_toppra_loses_the_law(monkeypatch, first):
    real, sizes = toppra_law._by_toppra, []

    def once(path, cap):
        sizes.append(cap.size)
        if len(sizes) > 1:
            return real(path, cap)
        return (
            None
            if first is None
            else real(path, cap) * np.where(np.arange(cap.size) == cap.size // 2, first, 1.0)
        )

    monkeypatch.setattr(toppra_law, "_by_toppra", once)
    (law,) = time_laws([line(9.0)], LINE, feed_rate=20.0, method="toppra")
    assert law.duration == pytest.approx(Trapezoid(9.0, 20.0, 500.0).duration, rel=1e-6)
    assert len(sizes) == 2
    assert sizes[1] > 1.5 * sizes[0]


@pytest.mark.parametrize("seed", range(4))
def test_as_fast_as_our_own(seed):
    laws = [
        time_laws([wavy(seed)], ARM, feed_rate=50.0, method=method)[0] for method in ("min_time", "toppra")
    ]
    assert laws[1].duration == pytest.approx(laws[0].duration, rel=2 * toppra_law.GAIN)
    assert worst_violation([wavy(seed)], laws[1:], limits=ARM, feed_rate=50.0).ratio <= 1 + 1e-6
