"""A simulated machine in wall time, against a clock of the test: no thread of it runs, and nothing waits."""

import copy
import math
import time
from fractions import Fraction

import numpy as np
import pytest

import hwsim
from hwsim._live import wall
from hwsim._live.machine import TrippedError
from hwsim._live.wall import WallMachine, samples_of, take_safe
from hwsim.protocols import FOREVER
from sdpgrind import weldbead

MS = 1_000_000  # ns
SAFE = {"stop": 1.0}


class Hand:
    """A clock that a test sets, and the waits that it passes."""

    def __init__(self):
        self.now, self.waits, self.on_wait = 1000 * MS, [], None

    def monotonic_ns(self):
        return self.now

    def wait(self, seconds):
        self.waits.append(seconds)
        self.now += math.ceil(seconds * 1000 * MS)
        if self.on_wait is not None:
            self.on_wait()
        return False

    def at(self, ms):
        self.now = (1000 + ms) * MS


class Lathe:
    """A machine with ticks of 10 ms that keeps its calls; it stops at an event and at its end."""

    def __init__(self, end=1000, events=(), refuses=False):
        self.time, self.done, self.event = 0, False, False
        self.end, self.events, self.refuses, self.calls = end, events, refuses, []

    def step(self, command, ticks):
        if self.refuses and command == SAFE:
            raise ValueError("it cannot stop")
        self.calls.append((dict(command), ticks))
        ahead = [at for at in self.events if at > self.time]
        until = min(self.time + ticks, self.end, *ahead[:1])
        self.event, moved = until in self.events and until > self.time, until - self.time
        self.time, self.done = until, until == self.end
        return {"time": self.time, "moved": moved}

    def outcome(self):
        return {"calls": len(self.calls)}


@pytest.fixture
def hand(monkeypatch):
    hand = Hand()
    monkeypatch.setattr(wall, "time", hand)
    monkeypatch.setattr(WallMachine, "_watch", lambda self: None)
    return hand


def walled(hand, machine=None, *, period=2, samples=1, **options):
    live = hwsim.Live(**{"safe": SAFE, "deadline": 0.1, **options})
    found = WallMachine(machine or Lathe(), Fraction(1, 100), period, live, samples)
    found._over.wait = hand.wait
    found.live = live
    return found


def test_a_step_on_time_is_simulated_at_once_and_waited_for(hand):
    machine = Lathe()
    part = walled(hand, machine)
    assert part.released == part.sampled == 1000 * MS and part.taken
    hand.at(1)
    assert part.step({"rate": 1.0}, 2) == {"time": 2, "moved": 2}
    assert machine.calls == [({"rate": 1.0}, 2)]
    assert hand.waits == [pytest.approx(0.019)]
    assert part.released == 1020 * MS and part.sampled == hand.now >= 1020 * MS and part.taken
    assert (part.time, part.done, part.event, part.trip) == (2, False, False, None)
    assert part.outcome() == {"calls": 1} and part._before is None


def test_a_long_wait_is_in_quarters_of_the_deadline_and_each_is_a_sign_of_life(hand):
    part = walled(hand, period=20)
    lives = []
    part._forwarding.renew = lambda now: lives.append(now - 1000 * MS)
    part.step({}, 20)
    assert hand.waits == [pytest.approx(0.025)] * 8
    assert [round(life / MS) for life in lives] == [0, 25, 50, 75, 100, 125, 150, 175, 200]


def test_a_step_that_ends_at_its_release_does_not_wait_and_is_not_late(hand):
    machine = Lathe()
    part = walled(hand, machine)
    hand.at(20)
    part.step({"rate": 1.0}, 2)
    assert machine.calls == [({"rate": 1.0}, 2)] and hand.waits == []


def test_a_late_command_takes_effect_when_it_came_and_the_next_release_is_on_the_grid(hand):
    machine = Lathe()
    part = walled(hand, machine)
    hand.at(21)
    assert part.step({"rate": 1.0}, 2)["time"] == 4
    assert machine.calls == [({}, 3), ({"rate": 1.0}, 1)] and part.released == 1040 * MS
    hand.at(95)
    assert part.step({"rate": 2.0}, 2)["time"] == 10
    assert machine.calls[2:] == [({}, 6), ({"rate": 2.0}, 0)] and part.released == 1100 * MS


def test_a_machine_with_a_computer_of_its_own_is_late_by_whole_samples(hand):
    machine = Lathe()
    part = walled(hand, machine, period=4, samples=4)
    hand.at(41)
    assert part.step({"rate": 1.0}, 4)["time"] == 8
    assert machine.calls == [({}, 8), ({"rate": 1.0}, 0)]


@pytest.mark.parametrize(
    ("machine", "calls", "time"),
    [
        (Lathe(end=2), [({}, 3), ({}, 0)], 2),  # it ended before the command came
        (Lathe(events=(2,)), [({}, 3), ({"rate": 1.0}, 0)], 2),  # an event is told when it was
    ],
)
def test_what_happens_before_a_late_command_is_told(hand, machine, calls, time):
    part = walled(hand, machine)
    hand.at(21)
    part.step({"rate": 1.0}, 2)
    assert machine.calls == calls and part.time == time


def test_a_missed_release_aborts_where_it_is_to(hand):
    machine = Lathe()
    part = walled(hand, machine, overruns="abort")
    hand.at(20)
    part.step({"rate": 1.0}, 2)
    hand.at(41)
    with pytest.raises(TrippedError):
        part.step({"rate": 2.0}, 2)
    assert part.trip == ("a release was missed", "runner", 0.0) and part.live.tripped and not part.taken
    assert machine.calls[1:] == [({}, 3), (SAFE, 0)]  # 2 + 3 ticks: where it is by now


def test_without_a_period_time_stands_still_while_the_controller_decides(hand):
    machine = Lathe(events=(5, 9))
    part = walled(hand, machine, period=None)
    hand.at(300)
    assert part.step({"rate": 1.0}, FOREVER)["time"] == 5
    assert part.event and part.released == 1350 * MS
    hand.at(1000)
    part.step({}, FOREVER)
    assert part.time == 9 and part.released == 2040 * MS
    assert machine.calls == [({"rate": 1.0}, FOREVER), ({}, FOREVER)]


def test_a_machine_is_made_safe_where_it_is_in_the_middle_of_a_long_step(hand):
    machine = Lathe(events=(50,))
    part = walled(hand, machine, period=None)

    def door():
        if len(hand.waits) == 5:
            part.make_safe("door open")

    hand.on_wait = door
    with pytest.raises(TrippedError):
        part.step({"rate": 1.0}, FOREVER)
    assert part.time == 13 and part.live.tripped  # 125 ms after the begin, in ticks that have begun
    assert part._machine.calls == [({"rate": 1.0}, 13), (SAFE, 0)]
    assert part.trip[:2] == ("door open", "runner")


@pytest.mark.parametrize(("ticks", "kept"), [(1, True), (0, False), (FOREVER, True)])
def test_a_copy_is_kept_of_a_machine_that_steps_long(hand, ticks, kept):
    part = walled(hand, Lathe(events=(3,)))
    seen = []
    hand.on_wait = lambda: seen.append(part._before is not None)
    part.step({}, ticks)
    assert (seen[:1] == [True]) == kept
    assert part._before is None


def test_a_short_step_needs_no_copy(hand, monkeypatch):
    part = walled(hand)
    part._releases = part._releases._replace(tick=Fraction(5, 1000))  # at the limit it is short
    seen = []
    hand.on_wait = lambda: seen.append(part._before)
    part.step({}, 1)
    assert seen == [None]


def test_the_time_of_the_plant_is_not_that_of_the_controller(hand):
    class Slow(Lathe):
        def step(self, command, ticks):
            hand.now += 90 * MS
            return super().step(command, ticks)

    part = walled(hand, Slow(), period=10)
    hand.at(20)
    part.step({"rate": 1.0}, 10)
    hand.now += 100 * MS  # after the wait: at the deadline
    part._make_safe()
    assert part.trip is None
    hand.now += MS
    part._make_safe()
    assert part.trip.reason.startswith("no sign of the controller for more than 100 ms")
    assert part.trip[1:] == ("link", 0.101)


def test_a_tripped_machine_takes_no_step(hand):
    machine = Lathe()
    part = walled(hand, machine)
    part.make_safe("door open")
    part.make_safe("again")
    assert machine.calls == [(SAFE, 0)] and part.trip[:2] == ("door open", "runner")
    with pytest.raises(TrippedError):
        part.step({"rate": 1.0}, 2)
    assert machine.calls == [(SAFE, 0)] and not part.taken


def test_a_machine_that_refuses_the_safe_command_is_not_called_safe(hand):
    part = walled(hand, Lathe(refuses=True))
    part.make_safe("door open")
    assert part.trip[:2] == ("door open; the safe command was refused: it cannot stop", "")


def test_a_machine_that_has_ended_is_not_moved_by_the_safe_command(hand):
    machine = Lathe(end=2)
    part = walled(hand, machine)
    part.step({}, 2)
    hand.at(500)
    part.make_safe("late")
    assert machine.calls == [({}, 2)] and part.trip[:2] == ("late", "runner")


def test_the_guard_passes_on_what_the_operator_wants(hand, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(wall, "time", hand)
    machine = Lathe()
    live = hwsim.Live(safe=SAFE, deadline=10.0)
    part = WallMachine(machine, Fraction(1, 100), 2, live)
    assert part._guard.daemon and part._guard.is_alive() and part._samples == 1
    live.abort("door open")
    while part.trip is None:
        time.sleep(0.001)
    assert part.trip[:2] == ("door open", "link") and machine.calls == [(SAFE, 0)]
    part.close()
    assert not part._guard.is_alive() and part._over.is_set()


def test_the_safe_command_of_machines_with_samples_of_their_own():
    machine = Lathe()
    take_safe(machine, SAFE, 1)
    assert machine.calls == [(SAFE, 0)]
    sampled = Lathe()
    take_safe(sampled, SAFE, 4)
    assert sampled.calls == [(SAFE, 0), ({}, 4)]
    ended = Lathe()
    ended.done = True
    take_safe(ended, SAFE, 4)
    assert ended.calls == []

    class Ending(Lathe):
        def step(self, command, ticks):
            super().step(command, ticks)
            self.done = True

    ending = Ending()
    take_safe(ending, SAFE, 4)
    assert ending.calls == [(SAFE, 0)]


def test_a_machine_behind_a_cut_link_takes_its_own_safe_command():
    cut = hwsim.faults.LinkCut(hwsim.WeldBeadStand(weldbead.preset("P1")), at=0.0, duration=5.0)
    machine = cut.start(np.random.default_rng(0))
    machine.step({}, 0)
    take_safe(machine, {"stop": 1.0}, 1)
    assert machine.done


def test_ticks_between_samples():
    assert samples_of(Lathe()) == 1
    sampled = copy.copy(Lathe())
    sampled.sample_ticks = 4.0
    assert samples_of(sampled) == 4
