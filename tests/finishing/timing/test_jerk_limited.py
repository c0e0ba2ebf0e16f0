"""The fastest law with limits of jerk: closed form, a second solver, limits between points, windows."""

import numpy as np
import pytest
from finishing_inside import LimitedRun, double_s_law, jerk_limited, jerk_program
from timing_paths import SMOOTH, dense, line, part, wavy

from sdpgrind.finishing.timing import JointLimits, Trapezoid, time_laws, worst_violation

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


def test_windows_are_as_good_as_the_whole(monkeypatch):
    run = part(wavy(6), 4.0, 16.0)
    whole = fastest(run, SMOOTH)
    monkeypatch.setattr(jerk_limited, "SIZES", (16, 32))
    cut = fastest(run, SMOOTH)
    assert whole.length.size == 64
    assert cut.length.size in (64, 80)
    assert worst_violation([run], [cut], limits=SMOOTH, feed_rate=25.0).held
    assert cut.duration == pytest.approx(whole.duration, rel=5e-3)


def test_a_window_that_is_not_solved_is_left_by_the_way_to_rest_of_the_one_before(monkeypatch):
    """Slower, but within every limit, and at rest where the window before had meant to end."""
    run = part(wavy(6), 4.0, 16.0)
    monkeypatch.setattr(jerk_limited, "SIZES", (16,))
    whole = fastest(run, SMOOTH)
    solved, calls = jerk_limited._window, []

    def second_fails(*given):
        calls.append(given)
        if len(calls) % 3 == 2:
            raise jerk_limited.LawError
        return solved(*given)

    monkeypatch.setattr(jerk_limited, "_window", second_fails)
    law = jerk_limited.jerk_limited_law(LimitedRun(run, SMOOTH, 25.0))
    assert len(calls) >= 4, "it takes no windows"
    assert worst_violation([run], [law], limits=SMOOTH, feed_rate=25.0, refine=20).ratio <= 1 + 1e-6
    assert law.duration > whole.duration and law.end == pytest.approx(16.0, abs=1e-9)
    assert np.min(law.feed[1:-1]) < 1e-6 * 25.0


def test_a_limit_of_the_paths_own_acceleration():
    run = SHORT[1]
    (law,) = time_laws([run], SMOOTH, feed_rate=25.0, acceleration=150.0, method="min_time")
    assert np.max(np.abs(law.acceleration)) <= 150.0 * (1 + 1e-6)


def test_a_program_that_fails_is_told(monkeypatch):
    def failed(data):
        return jerk_program.JerkFound(np.zeros(32), np.zeros(32), False, "no step was found")

    monkeypatch.setattr(jerk_program, "solve", failed)
    with pytest.raises(
        ValueError, match=r"run 0: no jerk-limited law was found between 8 and 8\.2 mm \(no step was found\)"
    ):
        fastest(SHORT[0], SMOOTH)
