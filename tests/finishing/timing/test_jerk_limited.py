"""The fastest law with limits of jerk: closed form, a second solver, limits between points."""

import numpy as np
import pytest
from finishing_inside import LimitedRun, double_s_law, fastest_law, interior, jerk_limited, jerk_program
from timing_paths import ARM, SMOOTH, dense, line, part, wavy

from sdpgrind.finishing.timing import JointLimits, JointPath, Trapezoid, time_laws, worst_violation
from sdpgrind.finishing.timing._time_law import integrated

SHORT = [part(wavy(seed), 8.0, 8.0 + span) for seed, span in ((0, 0.2), (1, 1.6), (2, 3.2), (3, 5.0))]


def fastest(run, limits, feed_rate=25.0):
    return time_laws([run], limits, feed_rate=feed_rate, method="min_time")[0]


SHAPES = [(25.0, 500.0, 2e4), (25.0, 5e3, 2e4), (1e3, 500.0, 2e4), (1e3, 1e6, 2e4)]


@pytest.mark.parametrize(("speed", "acceleration", "jerk"), SHAPES)
def test_straight_line_is_the_closed_form(speed, acceleration, jerk):
    """All four kinds of seven-piece laws."""
    limits = JointLimits(["X"], speed_max=[speed], acceleration_max=[acceleration], jerk_max=[jerk])
    exact = double_s_law(0.0, Trapezoid(2.0, speed, acceleration), jerk)
    assert fastest(line(2.0), limits, feed_rate=2e3).duration == pytest.approx(exact.duration, rel=1e-9)
    # the program alone: where switching times fall between its points, that costs a few 1e-3 of the time
    alone = jerk_limited.jerk_limited_law(LimitedRun(line(2.0), limits, 2e3))
    assert exact.duration * (1 - 1e-6) <= alone.duration <= exact.duration * 1.005


@pytest.mark.parametrize("run", SHORT)
def test_limits_are_held_everywhere(run):
    law = fastest(run, SMOOTH)
    assert worst_violation([run], [law], limits=SMOOTH, feed_rate=25.0, refine=20).ratio <= 1 + 1e-6
    assert max(dense(run, law, SMOOTH, 25.0)) <= 1 + 1e-6


@pytest.mark.parametrize("run", SHORT)
def test_it_is_slower_than_without_and_faster_than_seven_pieces(run):
    free = fastest(run, SMOOTH.replace(jerk_max=None))
    law = fastest(run, SMOOTH)
    (pieces,) = time_laws([run], SMOOTH, feed_rate=25.0)
    assert free.duration < law.duration < pieces.duration


@pytest.mark.parametrize("run", SHORT)
def test_it_rests_at_both_ends_and_does_not_jump(run):
    law = fastest(run, SMOOTH)
    end = law.at([0.0, law.duration])
    assert np.allclose(end.length, [8.0, run.length[-1]], rtol=0, atol=1e-12)
    assert np.allclose(end.feed, 0.0, atol=1e-9)
    assert np.allclose(end.acceleration, 0.0, atol=1e-7)
    jumps = law.at(np.nextafter(law.knots[1:-1], 0.0)), law.at(law.knots[1:-1])
    for name in ("length", "feed", "acceleration"):
        assert np.allclose(getattr(jumps[0], name), getattr(jumps[1], name), atol=1e-9 * 1e3)


def test_a_second_solver_finds_the_same(monkeypatch):
    law = fastest(SHORT[2], SMOOTH)
    monkeypatch.setattr(jerk_program, "PLUGINS", ("ipopt",))
    assert fastest(SHORT[2], SMOOTH).duration == pytest.approx(law.duration, rel=1e-5)


def test_great_jerk_limits_give_the_law_without():
    run = SHORT[3]
    free = fastest(run, SMOOTH.replace(jerk_max=None))
    great = SMOOTH.replace(jerk_max=tuple(50 * np.array(SMOOTH.jerk_max)))
    assert fastest(run, great).duration == pytest.approx(free.duration, rel=0.01)


def test_a_limit_of_the_paths_own_acceleration():
    run = SHORT[1]
    (law,) = time_laws([run], SMOOTH, feed_rate=25.0, acceleration=150.0, method="min_time")
    assert np.max(np.abs(law.acceleration)) <= 150.0 * (1 + 1e-6)


def by_nodes(given):
    """Law by interior points, also where a run is short enough for one program."""
    first = fastest_law(given, gain=jerk_limited.COARSE)
    turn = 2 * float(np.max(given.limits.table[1] / given.limits.table[2]))
    return jerk_limited.within(given, jerk_limited._by_nodes(given, first, turn))


def test_interior_points_on_a_straight_line():
    """Two ramps at the greatest jerk: 100/25 + 2 sqrt(25/2e4) s; the nodes cost less than 0.3 % more."""
    limits = JointLimits(["X"], speed_max=[200.0], acceleration_max=[2e3], jerk_max=[2e4])
    exact = 100 / 25 + 2 * np.sqrt(25 / 2e4)
    assert fastest(line(100.0), limits).duration == pytest.approx(exact, rel=1e-6)
    law = by_nodes(LimitedRun(line(100.0), limits, 25.0))
    assert exact * (1 - 1e-6) <= law.duration <= exact * 1.003


@pytest.mark.parametrize("run", SHORT[2:])
def test_interior_points_and_the_program_find_the_same(run):
    """Two formulations; nodes cost some 0.1 % where there are few switches, free points where there are many."""
    law = by_nodes(LimitedRun(run, SMOOTH, 25.0))
    assert law.duration == pytest.approx(fastest(run, SMOOTH).duration, rel=5e-3)


def test_interior_points_hold_limits_everywhere_and_rest_at_both_ends():
    run = wavy(6)
    law = by_nodes(LimitedRun(run, SMOOTH, 1e3))
    assert worst_violation([run], [law], limits=SMOOTH, feed_rate=1e3, refine=40).ratio <= 1 + 1e-6
    assert max(dense(run, law, SMOOTH, 1e3)) <= 1 + 1e-6
    end = law.at([0.0, law.duration])
    assert np.allclose(end.length, [0.0, 30.0], rtol=0, atol=1e-12)
    assert np.allclose(end.feed, 0.0, atol=1e-9)
    assert fastest(run, SMOOTH.replace(jerk_max=None), 1e3).duration < law.duration


def test_three_starts_end_at_the_same_law(monkeypatch):
    given, times = LimitedRun(wavy(5), SMOOTH, 200.0), []
    for slower in (1.3, 3.0, 10.0):
        with monkeypatch.context() as patched:
            patched.setattr(
                jerk_limited,
                "improved",
                lambda mesh, rows, c, gap, slow=slower: interior.improved(mesh, rows, c / slow**2, gap),
            )
            times.append(by_nodes(given).duration)
    assert max(times) <= min(times) * (1 + 1e-3)


def test_a_path_with_many_bends_takes_nodes():
    """160 mm through a hundred rounded corners: 10.978 s was the law found in windows."""
    s = np.linspace(0, 160.0, 1001)
    turn = np.cumsum(0.5 * np.pi * np.sin(np.pi * s / 1.5625) ** 9) * (s[1] / 0.4)
    way = np.cumsum(np.column_stack([np.cos(turn), np.sin(turn)]), axis=0) * s[1]
    gains = np.random.default_rng(0).normal(size=(2, 5)) / 400
    run = JointPath(s, np.column_stack([way @ gains, way]))
    limits = ARM.replace(jerk_max=(80.0,) * 5 + (2e4,) * 2)
    law = fastest(run, limits)
    assert law.duration <= 10.85
    assert worst_violation([run], [law], limits=limits, feed_rate=25.0, refine=40).ratio <= 1 + 1e-6


def test_a_limit_of_acceleration_along_the_path_by_nodes():
    law = by_nodes(LimitedRun(wavy(2), SMOOTH, 100.0, 150.0))
    assert np.max(np.abs(law.acceleration)) <= 150.0 * (1 + 1e-3)  # jerk bends it between nodes


def test_nodes_replace_a_program_that_fails(monkeypatch):
    def failed(data):
        return jerk_program.JerkFound(np.zeros(32), np.zeros(32), False, "no step was found")

    law = fastest(SHORT[3], SMOOTH)
    monkeypatch.setattr(jerk_program, "solve", failed)
    other = fastest(SHORT[3], SMOOTH)
    assert other.length.size > 2000 and not other.status
    assert other.duration == pytest.approx(law.duration, rel=5e-3)


def test_where_no_law_is_found_seven_pieces_come_with_a_status(monkeypatch):
    def failed(*given):
        raise interior.LawError("no step was found")

    for name in ("short_run_law", "improved"):
        monkeypatch.setattr(jerk_limited, name, failed)
    run = SHORT[1]
    law = fastest(run, SMOOTH)
    assert law.length.size <= 7 and worst_violation([run], [law], limits=SMOOTH, feed_rate=25.0).held
    assert law.status == "no jerk-limited law was found (no step was found); this law has seven pieces"


def test_nodes_rise_where_a_coarse_law_goes_back():
    """As on passes with corners of a few um: the feed between two nodes fell below 0, and no law was found."""
    feed = np.array([0.0, 1.0, -0.5, 1.0, 0.8, 0.4, 0.0])
    law = integrated(0.0, np.full(6, 0.1), np.diff(feed) / 0.1, np.zeros(6))
    assert np.any(np.diff(law.at(np.linspace(0.0, 0.6, 601)).length) < 0)
    nodes = jerk_limited._nodes(law, np.ones((4, 2)), 0.01)
    assert np.all(np.diff(nodes) > 0) and (nodes[0], nodes[-1]) == (0.0, law.end)
