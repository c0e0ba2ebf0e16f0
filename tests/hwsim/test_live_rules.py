"""Release grid and forwarding of commands, worked out by hand; times in ms."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwsim._live.forwarding import Forwarding
from hwsim._live.releases import Releases

MS = 1_000_000  # ns
SAFE = {"stop": 1.0}


def starts(releases, durations):
    """Starts of steps (ms) of these durations, and how many releases each missed."""
    due, found, missed = 0, [], []
    for duration in durations:
        found.append((releases.instant(due) - releases.start) // MS)
        following = releases.following(due + 1, releases.instant(due) + duration * MS)
        missed.append(following - due - 1)
        due = following
    return found, missed


def test_releases_inside_a_step_are_missed_and_one_at_its_end_is_on_time():
    grid = Releases(start=123_456_789, tick=Fraction(1, 100), period=1)
    found, missed = starts(grid, [4, 12, 9, 35, 3, 10, 3])
    assert found == [0, 10, 30, 40, 80, 90, 100]
    assert sum(missed) == 4
    assert sum(each > 0 for each in missed) == 2


@given(
    st.integers(0, 10**18),
    st.fractions(Fraction(1, 10**6), 10),
    st.integers(1, 50),
    st.integers(0, 10**6),
    st.integers(0, 10**12),
)
def test_the_next_release_is_the_first_on_the_grid_that_is_not_past(start, tick, period, step, later):
    grid = Releases(start, tick.limit_denominator(10**6), period)
    due = step * period
    now = grid.instant(due) + later
    found = grid.following(due, now)
    assert found % period == 0
    assert grid.instant(found) >= now
    assert found == due or grid.instant(found - period) < now


def test_commands_are_forwarded_while_they_are_young_then_the_safe_one_then_nothing():
    rule = Forwarding(SAFE, 50 * MS, 0)
    handed, written = {0: "a", 10: "b", 20: "c", 61: "d", 113: "e"}, []
    for now in range(200):
        if now in handed:
            rule.hand({"rate": float(ord(handed[now]))}, now * MS)
        if now % 2 == 0 and (values := rule.poll(now * MS)):
            written.append((now, chr(int(values["rate"])) if "rate" in values else values))
    assert written == [(0, "a"), (10, "b"), (20, "c"), (62, "d"), (112, SAFE)]
    assert rule.trip.by == "link"
    assert rule.trip.delay == pytest.approx(0.051)


def test_after_a_cut_link_nobody_knows_until_the_machine_is_seen():
    one = Forwarding({"stop": 1.0}, 50 * MS, 0)
    one.ask("door open", "link")
    assert one.poll(5 * MS) == {"stop": 1.0}
    one.lost("the link was cut", 6 * MS)
    assert one.trip[:2] == ("door open; the link was cut", "") and math.isnan(one.trip.delay)
    same = Forwarding({"stop": 1.0}, 50 * MS, 0)
    same.ask("the link was cut", "gate")  # that of the reader
    assert same.poll(5 * MS) == {"stop": 1.0}
    same.lost("the link was cut", 6 * MS)
    assert same.trip[:2] == ("the link was cut", "")
    other = Forwarding({"stop": 1.0}, 50 * MS, 0)
    other.lost("the link was cut", 6 * MS)
    other.lost("the link was cut", 7 * MS)
    assert other.trip[:2] == ("the link was cut", "") and math.isnan(other.trip.delay)
    assert other.poll(7 * MS) == {}
    other.helped_itself("no heartbeat", 506 * MS)
    said = "the link was cut; the machine made itself safe: no heartbeat"
    assert other.trip == (said, "machine", 0.506)


def test_waiting_is_life():
    rule = Forwarding(SAFE, 50 * MS, 0)
    for now in range(0, 400, 40):
        rule.renew(now * MS)
        assert not rule.poll((now + 50) * MS)  # at the deadline is not yet late
        assert rule.alive((now + 50) * MS)
    assert rule.poll(411 * MS) == SAFE
    assert not rule.alive(411 * MS)


def test_a_slow_computer_is_told_from_a_slow_step():
    for waits, said in ((False, ""), (True, ", which waited: not its step but this computer was slow")):
        rule = Forwarding(SAFE, 50 * MS, 0)
        rule.waits = waits
        assert rule.poll(51 * MS) == SAFE
        assert rule.trip.reason == f"no sign of the controller for more than 50 ms{said}"


def test_changes_handed_between_two_polls_are_joined():
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({"rate": 1.0, "speed": 5.0}, MS)
    rule.hand({"rate": 2.0}, MS)
    assert rule.poll(2 * MS) == {"rate": 2.0, "speed": 5.0}
    assert rule.poll(3 * MS) == {}


def test_a_command_that_the_link_held_up_is_not_forwarded_however_alive_the_controller_is():
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({"rate": 1.0}, 10 * MS)
    rule.renew(60 * MS)  # it waits until its command is taken
    assert rule.poll(60 * MS) == {"rate": 1.0}  # as old as the deadline
    rule.hand({"rate": 2.0}, 70 * MS)
    rule.hand({"speed": 3.0}, 120 * MS)
    assert rule.poll(121 * MS) == SAFE
    limit = "longer than the deadline of 50 ms"
    assert rule.trip == (f"a command waited 51 ms for the link, {limit}", "link", pytest.approx(0.001))


def test_a_command_of_a_step_beyond_the_deadline_is_not_forwarded_though_nobody_polled_meanwhile():
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({"rate": 1.0}, 50 * MS)  # at the deadline is not yet late
    assert rule.poll(50 * MS) == {"rate": 1.0}
    rule.hand({"rate": 2.0}, 101 * MS)
    assert not rule.alive(101 * MS)
    assert rule.poll(102 * MS) == SAFE
    assert rule.trip == ("no sign of the controller for more than 50 ms", "link", pytest.approx(0.052))


def test_a_sign_of_life_is_never_too_old():
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({}, 10 * MS)
    rule.renew(300 * MS)
    assert rule.poll(310 * MS) == {} and rule.trip is None


@pytest.mark.parametrize("value", [float("nan"), float("inf"), [1.0, float("nan")], "0.01", None, 1j])
def test_what_is_no_finite_number_is_never_forwarded(value):
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({"rate": value}, MS)
    assert rule.poll(2 * MS) == SAFE
    assert "rate must be a finite number" in rule.trip.reason


def test_a_request_goes_before_what_is_waiting_and_the_first_reason_counts():
    rule = Forwarding(SAFE, 50 * MS, 0)
    rule.hand({"rate": 1.0}, MS)
    rule.ask("door open", "runner")
    rule.ask("late", "link")
    assert rule.poll(2 * MS) == SAFE
    assert (rule.trip.reason, rule.trip.by) == ("door open", "runner")


@given(
    st.lists(st.tuples(st.sampled_from(["hand", "renew", "ask", "poll"]), st.integers(0, 60)), max_size=40)
)
def test_nothing_follows_the_safe_command(acts):
    rule, now, written = Forwarding(SAFE, 50 * MS, 0), 0, []
    for act, later in acts:
        now += later * MS
        if act == "hand":
            rule.hand({"rate": 1.0}, now)
        elif act == "renew":
            rule.renew(now)
        elif act == "ask":
            rule.ask("asked", "runner")
        elif values := rule.poll(now):
            written.append(values)
    assert written.count(SAFE) <= 1
    assert SAFE not in written[:-1]
    assert (rule.trip is not None) == (SAFE in written)


def test_commands_are_counted_and_no_heartbeat_follows_what_the_machine_did_itself():
    rule = Forwarding(SAFE, 50 * MS, 0)
    for number in range(3):
        assert rule.handed == number
        rule.hand({"rate": 1.0}, number * MS)
    assert rule.alive(3 * MS) and rule.by == "link"
    rule.told("the machine made itself safe", "machine", 3 * MS)
    rule.told("another reason", "gate", 9 * MS)
    assert not rule.alive(3 * MS) and rule.poll(3 * MS) == {}
    assert rule.trip == ("the machine made itself safe", "machine", pytest.approx(0.001))
