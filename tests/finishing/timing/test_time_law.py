"""Joint paths and time laws: splines against scipy, laws against their own derivatives, files."""

import numpy as np
import pytest
from finishing_inside import double_s_law
from scipy.interpolate import make_interp_spline
from timing_paths import ARM, line, wavy

from sdpgrind.base import stored
from sdpgrind.finishing.timing import JointLimits, JointPath, TimeLaw, Trapezoid, time_laws


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 6, 7, 40])
@pytest.mark.parametrize("derivative", range(4))
def test_spline_is_scipys(samples, derivative):
    rng = np.random.default_rng(samples)
    length = 3.0 + np.cumsum(rng.uniform(0.5, 1.0, samples))
    run = JointPath(length, rng.normal(size=(samples, 3)))
    spline = make_interp_spline(length, run.joints, k=min(5, samples - 1))
    where = rng.uniform(length[0], length[-1], 200)
    # each derivative of numbers of order 1 over spans of order 1 loses a few digits
    scale = np.max(np.abs(spline(where, derivative))) + 1
    assert np.allclose(run.at(where, derivative), spline(where, derivative), rtol=0, atol=1e-9 * scale)


def test_polynomials_of_degree_five_are_met_exactly():
    s = np.linspace(0.0, 2.0, 9)
    run = JointPath(s, np.column_stack([s**5, 1 - s**3]))
    x = np.linspace(0.0, 2.0, 57)
    exact = [
        np.column_stack(pair)
        for pair in ((x**5, 1 - x**3), (5 * x**4, -3 * x**2), (20 * x**3, -6 * x), (60 * x**2, x * 0 - 6))
    ]
    for derivative in range(4):
        assert np.allclose(run.at(x, derivative), exact[derivative], atol=1e-9)


def test_three_derivatives_are_continuous_at_samples():
    run = wavy(3)
    inside = run.length[3:-3]
    for derivative in range(4):
        jump = run.at(inside - 1e-9, derivative) - run.at(inside + 1e-9, derivative)
        assert np.max(np.abs(jump)) <= 1e-7 * (1 + np.max(np.abs(run.at(inside, derivative))))


def test_shapes():
    run = wavy(0)
    assert run.at(1.0).shape == (7,)
    assert run.at(np.ones((2, 3)), 1).shape == (2, 3, 7)
    assert run.span == 30.0


def law_of_seven():
    return double_s_law(5.0, Trapezoid(10.0, 25.0, 500.0), 2e4)


def test_a_law_is_its_own_derivative():
    law = law_of_seven()
    inside = np.linspace(0.01, 0.99, 300) * law.duration
    inside = inside[np.min(np.abs(inside[:, None] - law.knots), axis=1) > 2e-5]
    step = 1e-5
    before, now, after = law.at(inside - step), law.at(inside), law.at(inside + step)
    assert np.allclose((after.length - before.length) / (2 * step), now.feed, atol=1e-5)
    assert np.allclose((after.feed - before.feed) / (2 * step), now.acceleration, atol=1e-4)
    assert np.allclose(
        (after.acceleration - before.acceleration) / (2 * step), now.jerk, rtol=1e-6, atol=1e-3
    )


def test_length_feed_and_acceleration_do_not_jump_at_knots():
    law = law_of_seven()
    before, after = law.at(law.knots[1:-1] - 1e-12), law.at(law.knots[1:-1])
    for name in ("length", "feed", "acceleration"):
        assert np.allclose(getattr(before, name), getattr(after, name), atol=1e-6)


def test_time_at_is_the_inverse():
    law = law_of_seven()
    time = np.linspace(0.0, law.duration, 101)
    assert np.allclose(law.at(law.time_at(law.at(time).length)).length, law.at(time).length, atol=1e-12)
    assert np.allclose(law.time_at(law.at(time).length)[5:-5], time[5:-5], atol=1e-9)


def test_slower_scales_speed_acceleration_and_jerk():
    law = law_of_seven()
    slow, time = law.slower(2.0), 0.37 * law.duration
    now, later = law.at(time), slow.at(2 * time)
    assert slow.duration == pytest.approx(2 * law.duration)
    assert [float(x) for x in later] == pytest.approx([float(now[0]), now[1] / 2, now[2] / 4, now[3] / 8])
    assert slow.slowed == 2.0


@pytest.mark.parametrize("thing", [law_of_seven(), ARM, ARM.replace(jerk_max=(1.0,) * 7)])
def test_what_a_plan_holds_comes_back_from_its_text(thing):
    again = stored.decode(stored.encode(thing))
    assert again == thing
    assert hash(again) == hash(thing)


def test_laws_are_told_apart():
    law = law_of_seven()
    assert law != law.slower(2.0)
    assert law != "a law"


def test_trapezoid_of_the_path_where_no_joint_asks_for_more():
    free = JointLimits(["X"], speed_max=[1e3], acceleration_max=[1e5])
    (law,) = time_laws([line(10.0, begin=4.0)], free, feed_rate=25.0, acceleration=500.0)
    assert law.duration == pytest.approx(0.45, rel=1e-12)
    assert law.slowed == pytest.approx(1.0, rel=1e-12)
    assert law.at([0.0, law.duration]).length == pytest.approx([4.0, 14.0])


def test_trapezoid_is_slowed_by_the_acceleration_of_a_joint():
    """A joint that turns 3 rad/mm has three times the path's acceleration: time grows by sqrt(3 a/limit)
    where no speed binds.
    """
    run = JointPath([0.0, 1.0], [[0.0], [3.0]])
    limits = JointLimits(["q"], speed_max=[1e6], acceleration_max=[1500.0])
    (law,) = time_laws([run], limits, feed_rate=1e5, acceleration=1000.0)
    assert law.slowed == pytest.approx(np.sqrt(2.0), rel=1e-9)


def test_no_joint_moves():
    still = JointPath([0.0, 10.0], [[1.0], [1.0]])
    for method in ("trapezoid", "min_time"):
        limits = JointLimits(["X"], speed_max=[1.0], acceleration_max=[1.0])
        (law,) = time_laws([still], limits, feed_rate=10.0, acceleration=100.0, method=method)
        assert law.duration == pytest.approx(10 / 10 + 10 / 100, rel=1e-3)


def test_progress_is_told():
    told = []
    limits = JointLimits(["X"], speed_max=[1e3], acceleration_max=[1e5])
    time_laws([line(1.0)] * 4, limits, feed_rate=25.0, progress=lambda share, text: told.append(share))
    assert told == [0.25, 0.5, 0.75, 1.0]


def test_a_law_of_one_piece_ends_where_it_should():
    law = TimeLaw([0.0, 2.0], [1.0], [0.0], [3.0], [0.0])
    assert law.end == 7.0
