"""Squared feed as a spline: rows, ends from rest, the way back to a law in time, and the solver on it."""

import itertools

import numpy as np
import pytest
from finishing_inside import FROM_REST, LimitedRun, coefficients, greville, interior, law_of, squared_feed
from scipy.interpolate import BSpline
from scipy.optimize import minimize
from timing_paths import line

from sdpgrind.finishing.timing import JointLimits

NODES = np.array([0.0, 0.2, 0.7, 1.1, 1.2, 1.9, 2.5, 2.8])
RNG = np.random.default_rng(4)


def free(count):
    """Coefficients, > 0, of `count` intervals; the tied ones are nonsense that must not count."""
    c = RNG.uniform(50.0, 100.0, count + 2)
    c[[0, 1, -2, -1]] = np.nan
    return np.nan_to_num(c, nan=-1e9)


def spline_of(feed, c):
    """The same spline by scipy."""
    inner = feed.nodes[1:-1]
    knots = np.concatenate([[inner[0]] * 2, inner, [inner[-1]] * 2])
    tied = feed.ties * c[[2, -3]]
    return BSpline(knots, np.concatenate([tied[:1], c[2:-2], tied[1:]]), 2)


def test_rows_are_those_of_a_b_spline():
    feed = squared_feed(NODES)
    c = free(7)
    spline, values = spline_of(feed, c), feed.values(c)
    for i in range(1, 6):
        inside = feed.places[i] + np.array([1e-9, 0.0, -1e-9])  # x'' jumps at nodes
        for order in range(3):
            assert np.allclose(values[i, :, order], spline(inside, order), rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize(("end", "sign"), [(0, 1.0), (-1, -1.0)])
def test_ends_have_constant_jerk_and_join_without_a_jump(end, sign):
    feed = squared_feed(NODES)
    c = free(7)
    spline, values = spline_of(feed, c), feed.values(c)
    h, node = abs(np.diff(NODES)[end]), NODES[1 if end == 0 else -2]
    assert values[end, -1, 0] == pytest.approx(float(spline(node)), rel=1e-12)
    assert values[end, -1, 1] == pytest.approx(float(spline(node, 1)), rel=1e-9)
    jerk = values[end, :, 2] * np.sqrt(values[end, :, 0]) / 2
    assert np.allclose(jerk, 2 / 9 * float(spline(node)) ** 1.5 / h**2, rtol=1e-12)
    assert np.allclose(np.abs(feed.places[end] - NODES[end]), h * np.array(FROM_REST) ** 3, rtol=1e-12)
    assert np.allclose(values[end, :, 1] * sign > 0, True)


def test_time_is_the_integral_of_one_over_the_feed():
    """Against 2000 midpoints an interval, and 3 s/v in the outer two."""
    feed = squared_feed(NODES)
    c = free(7)
    spline, total = spline_of(feed, c), 0.0
    for begin, end in itertools.pairwise(NODES[1:-1]):
        places = begin + (end - begin) * (np.arange(2000) + 0.5) / 2000
        total += np.mean(1 / np.sqrt(spline(places))) * (end - begin)
    total += 3 * 0.2 / np.sqrt(spline(0.2)) + 3 * 0.3 / np.sqrt(spline(2.5))
    assert law_of(8.0, feed, c).duration == pytest.approx(float(total), rel=1e-6)
    # three points in an interval over which x changes by half
    assert feed.duration(c) == pytest.approx(float(total), rel=1e-3)


def test_three_pieces_of_a_quadratic():
    """x = 100 + 20 s + 3 s^2 over 0..0.5 mm: blossoms give the coefficients of an interval in the middle."""
    nodes = np.array([-2.0, -1.0, -0.4, 0.0, 0.5, 1.0, 1.7, 2.6])
    feed = squared_feed(nodes + 2.0)
    c = np.full(9, 100.0)
    for k, (a, b) in enumerate([(nodes[2], nodes[3]), (nodes[3], nodes[4]), (nodes[4], nodes[5])]):
        c[3 + k] = 100.0 + 20.0 * (a + b) / 2 + 3.0 * a * b
    law = law_of(-2.0, feed, c)
    begin, end = law.at(law.knots[[9, 12]] + np.array([1e-15, -1e-15])), law.at(law.knots[12])
    assert np.allclose(begin.length, [0.0, 0.5], rtol=0, atol=1e-12)
    assert begin.feed[0] == pytest.approx(10.0, rel=1e-12)
    assert end.feed == pytest.approx(10.5237826, rel=1e-8)
    assert np.allclose(begin.acceleration, [10.0, 11.5], rtol=1e-6)
    assert law.knots[12] - law.knots[9] == pytest.approx(0.0487529, rel=1e-6)


def test_nothing_drifts():
    feed = squared_feed(NODES)
    law = law_of(5.0, feed, free(7))
    assert np.allclose(law.length[::3], 5.0 + NODES[:-1], rtol=0, atol=1e-12)
    assert law.end == pytest.approx(7.8, abs=1e-12)
    last = law.at(law.duration)
    assert abs(last.feed) < 1e-9 and abs(last.acceleration) < 1e-6


def test_interior_points_find_what_another_solver_finds():
    """SLSQP on the same few nodes, with all rows one by one."""
    limits = JointLimits(["X"], speed_max=[30.0], acceleration_max=[300.0], jerk_max=[5e3])
    feed = squared_feed(np.array([0.0, 0.1, 0.5, 1.2, 2.2, 3.0, 3.6, 3.9, 4.0]))
    rows = interior.rows_of(LimitedRun(line(4.0), limits, 25.0), feed, np.ones((3, 8)))
    start = interior.slowed_start(feed, rows, coefficients(np.full(8, 20.0)))

    def whole(u):
        return np.concatenate([[1.0, 1.0], u, [1.0, 1.0]])

    def rooms(u):
        values = feed.values(whole(u))
        x = np.maximum(values[..., 0], 1e-6)
        push = rows.joints[:, :, 0, 0] * x + rows.joints[:, :, 0, 1] * values[..., 1]
        snatch = np.einsum("itd,itd->it", rows.joints[:, :, 0, 2:], values) * np.sqrt(x)
        return np.stack([1 - push, 1 + push, 1 - snatch, 1 + snatch, 1 - x / rows.cap]).ravel()

    found = interior.improved(feed, rows, start, 1e-7)
    slow = minimize(
        lambda u: feed.duration(whole(u)),
        start[2:-2],
        constraints={"type": "ineq", "fun": rooms},
        bounds=[(1e-3, None)] * 6,
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert slow.success
    assert rooms(found[2:-2]).min() >= 0
    assert feed.duration(found) == pytest.approx(slow.fun, rel=1e-6)


def test_a_start_that_is_no_number_is_told():
    limits = JointLimits(["X"], speed_max=[30.0], acceleration_max=[300.0], jerk_max=[5e3])
    feed = squared_feed(NODES)
    rows = interior.rows_of(LimitedRun(line(2.8), limits, 25.0), feed, np.ones((3, 7)))
    with pytest.raises(interior.LawError, match="interior points met a number that is not finite"):
        interior.improved(feed, rows, coefficients(np.full(7, np.nan)), 1e-4)


def test_greville_places_of_a_straight_line_give_a_straight_line():
    feed = squared_feed(NODES)
    c = coefficients(np.sqrt(10.0 + 4.0 * greville(NODES)))
    inner = feed.values(c)[2:-2, :, 0]
    assert np.allclose(inner, 10.0 + 4.0 * feed.places[2:-2], rtol=1e-12)
