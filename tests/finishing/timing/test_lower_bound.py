"""No law is below the bound, and laws without limits of jerk come close to it from above."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from timing_paths import ARM, wavy

from sdpgrind import finishing
from sdpgrind.finishing.timing import JointLimits, JointPath, lower_bound, time_laws
from sdpgrind.finishing.timing._limits import LimitedRun
from sdpgrind.finishing.timing._lower_bound import bound_on

TWO = JointLimits(["q", "X"], speed_max=[1.0, 60.0], acceleration_max=[6.0, 900.0])
JERKY = TWO.replace(jerk_max=[80.0, 2e4])
FEED = 40.0  # mm/s
ROUNDED = finishing.hilbert(finishing.surface.nominal_surface(), order=2).blended(0.6)


def two_joints(q):
    """A run of 100 mm: one joint as told, and X along the path."""
    s = np.linspace(0.0, 100.0, 101)
    return JointPath(s, np.stack([q(s), s], axis=1))


def test_straight_line():
    run = JointPath([0.0, 100.0], [[0.0], [100.0]])
    limits = JointLimits(["X"], speed_max=[50.0], acceleration_max=[2000.0])
    # Way over speed, and speed over acceleration; with the path's own acceleration the lesser counts.
    for along, feed, least in ((None, 40.0, 100 / 40 + 40 / 2000), (500.0, 80.0, 100 / 50 + 50 / 500)):
        bound = lower_bound([run, run], limits, feed_rate=feed, acceleration=along)
        assert (1 - 5e-4) * 2 * least <= bound <= 2 * least  # refined until that gains 5e-4
        # Lost is at most the gain of feed in the two intervals in which full speed is reached.
        fine = bound_on(LimitedRun(run, limits, feed, along), 1 << 13)
        assert fine == pytest.approx(least, rel=1e-6)


def test_short_line_never_reaches_its_speed():
    run = JointPath([0.0, 0.5], [[0.0], [0.5]])
    limits = JointLimits(["X"], speed_max=[50.0], acceleration_max=[200.0])
    # The peak of the feed is at a point of the grid: nothing is lost but the stated rounding.
    assert lower_bound([run], limits, feed_rate=40.0) == pytest.approx(2 * (0.5 / 200) ** 0.5, rel=2e-9)


@pytest.mark.parametrize("turn", [50.0, 50.3], ids=["at a sample", "between samples"])
def test_joint_that_turns_back(turn):
    """Where a joint turns back, its acceleration limits the feed alone: x <= A/|q''|."""
    run = two_joints(lambda s: (s - turn) ** 2 / 50)
    (law,) = time_laws([run], TWO, feed_rate=FEED, method="min_time")
    bound = lower_bound([run], TWO, feed_rate=FEED)
    # The grid of the law is refined until that saves 2e-4, that of the bound until it gains 5e-4.
    assert (1 - 1e-3) * law.duration <= bound <= law.duration
    # Without the turning point among the nodes an interval around it would lower no feed.
    assert bound_on(LimitedRun(run, TWO, FEED), 1) >= 0.99 * law.duration


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), feed=st.floats(5.0, 200.0), parts=st.sampled_from([1, 3, 16]))
def test_never_above_any_law(seed, feed, parts):
    """Coarse grids, too: what lies between their points is counted."""
    run = wavy(seed, span=20.0)
    bound = bound_on(LimitedRun(run, ARM, feed), parts)
    (law,) = time_laws([run], ARM, feed_rate=feed, method="min_time")
    assert bound <= law.duration


@pytest.mark.parametrize("span", [20.0, 21.0, 60.0])
def test_turns_at_samples_let_through(span):
    """Slopes of some 1e-17 at points that coincide but for rounding: their ways are rounded, too."""
    s = np.linspace(0.0, span, 181)
    run = JointPath(s, np.stack([np.cos(2 * np.pi * s / 5), 30 * np.cos(2 * np.pi * s / 10)], axis=1) / 5)
    (law,) = time_laws([run], TWO, feed_rate=FEED, method="min_time")
    assert (1 - 1e-3) * law.duration <= lower_bound([run], TWO, feed_rate=FEED) <= law.duration


def test_rounded_corners_of_a_robot():
    problem = finishing.preset("nominal").replace(path=ROUNDED)
    for method in ("min_time", "toppra"):
        motion = finishing.plan(problem.replace(robot=problem.robot.replace(jerk_max=None)), method=method)
        assert (1 - 2e-3) * motion.duration <= motion.lower_bound <= motion.duration


@pytest.mark.parametrize("seed", [3, 7, 11])
def test_close_to_the_fastest_law(seed):
    run = wavy(seed)
    (law,) = time_laws([run], ARM, feed_rate=25.0, method="min_time")
    assert (1 - 1e-3) * law.duration <= lower_bound([run], ARM, feed_rate=25.0) <= law.duration


def test_holds_with_limits_of_jerk():
    run = two_joints(lambda s: np.sin(s / 15))
    (law,) = time_laws([run], JERKY, feed_rate=FEED, method="min_time")
    assert lower_bound([run], JERKY, feed_rate=FEED) == lower_bound([run], TWO, feed_rate=FEED)
    assert lower_bound([run], JERKY, feed_rate=FEED) < law.duration


def test_refusals():
    run = JointPath([0.0, 100.0], [[0.0], [100.0]])
    with pytest.raises(ValueError, match=r"runs\[0\] must be of the 2 joints q, X; got 1"):
        lower_bound([run], TWO, feed_rate=FEED)
    with pytest.raises(ValueError, match="feed_rate must be"):
        lower_bound([run], TWO, feed_rate=0.0)
