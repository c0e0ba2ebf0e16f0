"""The thread that steps a controller on a remote machine, with a clock and a pulse of the test; nothing waits."""

from math import isnan, nan

import numpy as np
import pytest
from far_end_fakes import PLAIN, FarLink, FarMachine, declared

import hwsim
from hwsim._live.machine import TrippedError
from hwsim.opcua import _live_part
from hwsim.opcua._live_part import RemotePart, Watch
from hwsim.protocols import FOREVER

MS = 1_000_000  # ns
SAFE = {"stop": 1.0}
BEGUN = 5000  # ms on the clock when a part begins


class Turns:
    """A clock that moves by what is waited for; `then`: what happens within the waits, one after the other."""

    def __init__(self):
        self.now, self.waits, self.then, self.notified = BEGUN * MS, [], [], 0

    def monotonic_ns(self):
        return self.now

    def monotonic(self):
        return self.now / 1e9

    def sleep(self, seconds):
        self.waits.append(seconds)
        self.now += round(seconds * 1000 * MS)
        if self.then:
            self.then.pop(0)()

    wait = sleep  # of a condition

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def notify_all(self):
        self.notified += 1

    def at(self, ms):
        self.now = (BEGUN + ms) * MS


class Direct:
    """A loop that does at once what it is told; it is its own thread."""

    def __init__(self):
        self.loop, self.limits = self, []

    def run(self, work, timeout=None):
        self.limits.append(timeout)
        try:
            work.send(None)
        except StopIteration as told:
            return told.value
        raise AssertionError("it waits for something")

    def call_soon_threadsafe(self, call):
        call()


class Prompt:
    """A pulse that takes and serves at once what it is asked for, while `serves`."""

    def __init__(self, part, clock):
        self.part, self.clock = part, clock
        self.seen = self.refusal = None
        self.taken = self.wanted = self.served = self.bad = self.samples = 0
        self.safe_written = self.closed = False
        self.serves, self.next, self.forwarded = True, PLAIN, []

    def wake(self):
        rules = self.part._forwarding
        if not self.serves:
            return
        if command := rules.poll(self.clock.now):
            self.forwarded.append(dict(command))
        self.safe_written = rules.trip is not None
        self.taken = rules.handed
        if self.served != self.wanted:  # else the last sample is good enough
            self.look()
        self.served = self.wanted

    def look(self):
        self.seen = self.next._replace(at=self.clock.now)

    async def sample(self):
        self.samples += 1
        self.look()

    async def close(self):
        self.closed = True


class Stepped(RemotePart):
    async def _begun(self, names):
        return Prompt(self, self._clock)


@pytest.fixture
def clock(monkeypatch):
    clock = Turns()
    monkeypatch.setattr(_live_part, "time", clock)
    return clock


class Still:
    """Pauses that are looked at and do nothing."""

    def __init__(self):
        self.looks = []

    def look(self, *told):
        self.looks.append(told)


def begun(clock, *, period=2, told=None, table=None, **options):
    link = FarLink()
    link.loop = Direct()
    machine = FarMachine(link)
    machine.table = table
    live = hwsim.Live(**{"safe": SAFE, "deadline": 0.1, **options})
    Stepped._clock = clock
    part = Stepped(machine, told or declared(), {"place": ""}, live, period, 1, Still())
    part._news, part.link, part.pulse, part.live = clock, link, part._pulse, live
    return part


def sample(**changes):
    return PLAIN._replace(reading={"place": 2.0}, **changes)


def test_the_first_measurement_is_of_now_and_commands_nothing(clock):
    part = begun(clock)
    assert part.released == part.sampled == BEGUN * MS and part.taken
    clock.at(7)
    part.pulse.next = sample(bad=3)
    assert part.step({}, 0) == {"place": 2.0}
    assert part.released == part.sampled == (BEGUN + 7) * MS and part.taken
    assert part.pulse.forwarded == [] and clock.waits == [] and part.pulse.bad == 3
    assert (part.time, part.done, part.event) == (0, False, False)


def test_a_command_is_handed_over_and_its_release_waited_for(clock):
    part = begun(clock)
    part.step({"velocity": 1.0}, 2)
    assert part.pulse.forwarded == [{"velocity": 1.0}] and part.taken
    assert clock.waits == [pytest.approx(0.02)] and part.released == (BEGUN + 20) * MS
    assert (part.time, part.sampled) == (2, (BEGUN + 20) * MS)
    clock.at(25)
    part.pulse.next = sample()
    assert part.step({}, 2) == {"place": 2.0}  # no command: a sign of life all the same
    assert clock.waits[1:] == [pytest.approx(0.015)] and part.released == (BEGUN + 40) * MS and part.time == 4
    clock.at(60)
    part.step({}, 2)  # at its release it is on time
    assert part.time == 6 and len(clock.waits) == 2 and part.released == (BEGUN + 60) * MS


def test_a_long_wait_is_in_quarters_of_the_deadline_with_signs_of_life(clock):
    part = begun(clock, period=12)
    lives, waits = [], []
    renew = part._forwarding.renew
    part._forwarding.renew = lambda now: lives.append(now // MS - BEGUN) or renew(now)
    clock.then = [lambda: waits.append(part._forwarding.waits)]
    part.step({"velocity": 1.0}, 12)
    assert clock.waits == pytest.approx([0.025] * 4 + [0.02]) and lives == [25, 50, 75, 100, 120]
    assert waits == [True] and not part._forwarding.waits


def test_a_missed_release_is_not_made_up_for(clock):
    part = begun(clock)
    part.step({"velocity": 1.0}, 2)
    clock.at(41)
    part.step({"velocity": 2.0}, 2)
    assert part.time == 6 and part.released == (BEGUN + 60) * MS and part.trip is None


def test_a_missed_release_aborts_where_it_is_to(clock):
    part = begun(clock, overruns="abort")
    part.step({"velocity": 1.0}, 2)
    part.step({"velocity": 1.0}, 2)
    clock.at(61)
    with pytest.raises(TrippedError):
        part.step({"velocity": 2.0}, 2)
        part.step({}, 0)
    assert part.trip.reason == "a release was missed" and part.trip.by == "runner"


def test_time_runs_by_the_speed_of_the_machine(clock):
    part = begun(clock, told=declared(speed=4.0))
    part.step({"velocity": 1.0}, 2)
    assert part.released == (BEGUN + 5) * MS and part.time == 2
    assert part._wall(2) == pytest.approx(0.005) and part._wall(None) == 0.0


@pytest.mark.parametrize(("told", "ticks"), [(0.05, 5), (nan, 3)])
def test_an_event_ends_the_wait_at_the_machine_s_time(clock, told, ticks):
    part = begun(clock, period=None)
    part.step({}, 0)

    def happens():
        part.pulse.next = sample(event=1, time=told)
        part.pulse.look()

    clock.then = [happens]
    part.step({"velocity": 1.0}, FOREVER)
    assert part.event and part.time == ticks and not part.done
    assert clock.waits == pytest.approx([0.025]) and part.released == part.sampled == (BEGUN + 25) * MS
    part.step({}, 0)
    assert not part.event  # it was told


def test_time_never_goes_back_at_an_event(clock):
    part = begun(clock)
    part.step({"velocity": 1.0}, 8)
    part.pulse.next = sample(event=1, time=0.05)
    part.pulse.look()
    part.step({"velocity": 1.0}, 2)
    assert part.time == 8 and part.event


def test_the_end_is_told(clock):
    part = begun(clock)
    clock.then = [lambda: setattr(part.pulse, "next", sample(done=True, time=0.01)) or part.pulse.look()]
    part.step({"velocity": 1.0}, 20)
    assert part.done and part.time == 1 and not part.event
    assert part.released == part.sampled == (BEGUN + 25) * MS  # not at a release that is still to come


def test_an_array_is_measured_as_one(clock):
    part = begun(clock)
    part.pulse.next = PLAIN._replace(reading={"place": [1.0, 2.0], "speed": 3.0})
    read = part.step({}, 0)
    assert isinstance(read["place"], np.ndarray) and read["place"].tolist() == [1.0, 2.0]
    assert read["speed"] == 3.0


def test_a_refused_command_is_raised_and_not_taken(clock):
    part = begun(clock)
    part.pulse.refusal = ValueError("not now")
    with pytest.raises(ValueError, match="not now"):
        part.step({"velocity": 1.0}, 2)
    assert not part.taken


@pytest.mark.parametrize(
    ("command", "kind", "said"),
    [
        ({"velocity": 10.5}, ValueError, r"velocity must be in \[-10, 10\] \(mm/s\); got 10.5"),
        ({"velocity": "fast"}, TypeError, "velocity must be a number"),
        ({"velocity": nan}, ValueError, "velocity must be finite"),
        ({"flaw": 1.0}, KeyError, "flaw"),
    ],
)
def test_a_wrong_command_is_not_handed_over(clock, command, kind, said):
    part = begun(clock)
    with pytest.raises(kind, match=said):
        part.step(command, 2)
    assert part._forwarding.handed == 0 and part.pulse.forwarded == [] and not part.taken


def test_types_of_a_table_are_looked_at_before(clock):
    part = begun(clock, table="nodes")
    part.step({"velocity": 10.0, "stop": 1}, 2)
    assert part._remote.sent == [({"velocity": 10.0, "stop": 1.0}, None)]
    plain = begun(clock)
    plain.step({"velocity": 1.0}, 2)
    assert plain._remote.sent == []


def test_a_hand_over_waits_until_the_machine_has_taken_it(clock):
    part = begun(clock)
    part.pulse.serves = False
    taken = []

    def takes():
        taken.append(part.taken)
        part.pulse.serves = True
        part.pulse.wake()

    clock.then = [lambda: taken.append(part.taken), takes]
    part.step({"velocity": 1.0}, 10)
    assert clock.waits[:2] == pytest.approx([0.025, 0.025]) and part.pulse.forwarded == [{"velocity": 1.0}]
    assert taken == [False, False] and part.taken


def test_a_trip_ends_every_wait(clock):
    part = begun(clock)
    clock.then = [lambda: part._forwarding.told("gone", "machine", clock.now)]
    with pytest.raises(TrippedError):
        part.step({"velocity": 1.0}, 50)
    assert len(clock.waits) == 1 and part.trip.reason == "gone" and not part._forwarding.waits


def test_a_machine_is_made_safe_at_once(clock):
    part = begun(clock)
    part.make_safe("door open")
    assert part.pulse.forwarded == [SAFE] and clock.waits == []


def test_a_machine_is_made_safe_and_that_is_waited_for(clock):
    part = begun(clock)
    part.pulse.serves = False
    clock.then = [lambda: None, lambda: setattr(part.pulse, "serves", True) or part.pulse.wake()]
    part.make_safe("door open")
    assert clock.waits == pytest.approx([0.1, 0.1]) and part.pulse.forwarded == [SAFE]
    assert part.trip[:2] == ("door open", "runner")
    part.make_safe("again")
    assert part.trip.reason == "door open" and len(clock.waits) == 2


@pytest.mark.parametrize("tripped", [False, True])
def test_a_link_that_does_not_answer_is_told(clock, tripped):
    part = begun(clock)
    part.pulse.serves = False
    if tripped:
        part._forwarding.ask("late", "link")
        part._forwarding.poll(clock.now)
    part.make_safe("door open")
    assert sum(clock.waits) == pytest.approx(2.0, abs=0.11)
    assert part.trip[:2] == ("late; the link does not answer" if tripped else "door open", "")


def test_an_outcome_has_what_the_machine_tells_and_nan_for_the_rest(clock):
    told = declared(outcomes={"place": "mm", "wear": "mm", "trace": ("mm", "point")})
    part = begun(clock, told=told)
    part.pulse.bad = 4
    found = part.outcome()
    assert found["place"] == 3.0 and isnan(found["wear"]) and found["bad_quality"] == 4.0
    assert set(found) == {"place", "wear", "bad_quality"} and part.pulse.samples == 0
    assert clock.waits == [] and part.link.loop.limits[-1] == 2.0
    assert part.watchdog == 0.2


def test_an_outcome_is_waited_for_as_long_as_the_watchdog_may_take(clock):
    part = begun(clock)
    told, part._remote.told = part._remote.told, {}
    clock.then = [lambda: None, lambda: setattr(part._remote, "told", told)]
    assert part.outcome()["place"] == 3.0 and clock.waits == pytest.approx([0.025] * 2)
    part._remote.told, before = {}, clock.now
    assert isnan(part.outcome()["place"]) and (clock.now - before) / 1e9 == pytest.approx(2.2, abs=0.03)


@pytest.mark.parametrize("error", [ConnectionError("cut"), TimeoutError()])
def test_a_machine_that_was_cut_off_tells_no_outcome(clock, error):
    async def gone(part):
        raise error

    part = begun(clock)
    part._remote.outcome = gone
    found = part.outcome()
    assert isnan(found["place"]) and found["bad_quality"] == 0.0 and clock.waits == []


@pytest.mark.parametrize(("by", "looks"), [("", 1), ("runner", 0), ("machine", 0)])
def test_a_machine_of_which_nobody_knows_is_looked_at_again(clock, by, looks):
    part = begun(clock)
    part.step({}, 0)
    part._heard()
    part._forwarding.told("the link was cut", by, clock.now)
    part.pulse.next = sample(aborts=1, aborted="no heartbeat")
    part.outcome()
    assert part.pulse.samples == looks
    assert (part.trip.by == "machine") == (by != "runner")


def test_a_look_that_fails_is_no_fault(clock):
    async def gone():
        raise ConnectionError("cut")

    part = begun(clock)
    part.pulse.sample = gone
    part._forwarding.told("the link was cut", "", clock.now)
    assert part.outcome()["place"] == 3.0 and part.trip.by == ""


def test_what_the_link_hears(clock):
    part = begun(clock)
    part._heard()
    assert not part.live.tripped and part._watch._pauses.looks == [] and clock.notified == 1
    part.pulse.next = sample(paused=True, stops=2, aborted="x")
    part.pulse.look()
    part._heard()
    assert part._watch._pauses.looks == [(True, 2, "x")]
    part.live.abort("door open")
    part._heard()
    assert not part.live.tripped
    part.pulse.wake()
    part._heard()
    assert part.live.tripped and part.trip[:2] == ("door open", "link")


def test_a_last_sample_that_grows_old_is_heard(clock):
    part = begun(clock, stale=0.2)
    part.step({}, 0)
    part._heard()
    clock.at(200)
    part._forwarding.renew(clock.now)
    part._heard()
    assert part._forwarding.poll(clock.now) == {}
    clock.at(201)
    part._heard()
    assert part._forwarding.poll(clock.now) == SAFE


def test_stuck_readings_are_counted_at_each_step(clock):
    part = begun(clock, stuck={"place": 3})
    part.pulse.next = sample()
    part.step({}, 0)
    part.step({"velocity": 1.0}, 2)
    part.step({"velocity": 1.0}, 2)
    assert asked(part._forwarding) is None
    part.step({"velocity": 1.0}, 2)
    assert asked(part._forwarding) == "place is stuck: 3 equal readings in a row"


def test_the_end_of_a_part_closes_its_pulse(clock):
    part = begun(clock)
    part.close()
    assert part.pulse.closed and part.link.loop.limits[-1] == 4.0


def watching(period=0.02, **options):
    part = begun(Turns(), **options)
    watch = Watch(part.live, period, part._forwarding, Still())
    return watch, part._forwarding


def asked(rules):
    return rules._asked[0] if rules._asked else None


@pytest.mark.parametrize(
    ("period", "options", "stale"), [(0.02, {}, 0.5), (1.0, {}, 2.0), (1.0, {"stale": 0.3}, 0.3)]
)
def test_readings_are_stale_after_two_periods_and_half_a_second_at_least(clock, period, options, stale):
    watch, rules = watching(period, **options)
    watch.look(sample(at=0))
    watch.look(sample(at=round(stale * 1e9)))
    assert asked(rules) is None
    watch.look(sample(at=round(stale * 1e9) + 1))
    assert asked(rules) == f"measurements are stale: no new sample for more than {stale:g} s"


def test_the_age_counts_from_the_last_sample_that_moved(clock):
    watch, rules = watching(stale=0.3)
    for at, sequence in ((0, 5), (200, 6), (400, 6), (500, 6)):
        watch.look(sample(at=at * MS, sequence=sequence))
    assert asked(rules) is None
    watch.age(500 * MS)
    assert asked(rules) is None
    watch.age(501 * MS)
    assert asked(rules).startswith("measurements are stale")


def test_a_finished_part_grows_no_older(clock):
    watch, rules = watching(stale=0.3)
    watch.look(sample(at=0))
    watch.look(sample(at=200 * MS, done=True))
    watch.look(sample(at=450 * MS, done=True))
    watch.age(900 * MS)
    assert asked(rules) is None


def test_a_restart_is_told_by_a_sequence_below_the_last_one_not_the_first(clock):
    watch, rules = watching()
    for sequence in (5, 9, 7):
        watch.look(sample(sequence=sequence))
    assert asked(rules) == "the machine was restarted: the sequence of its samples went back"
    assert rules._asked[1] == "runner"


def test_values_of_one_list_that_are_far_apart_are_stale(clock):
    watch, rules = watching(stale=0.3)
    watch.look(sample(spread=0.3))
    assert asked(rules) is None
    watch.look(sample(sequence=6, spread=0.31))
    assert asked(rules) == "measurements are stale: those of one list are 0.31 s apart"


def test_what_the_machine_did_itself_is_told_once_it_is_not_known_otherwise(clock):
    for by, told in (("", "machine"), ("runner", "runner"), (None, "machine")):
        watch, rules = watching()
        watch.look(sample())
        if by is not None:
            rules.told("late", by, 0)
        watch.look(sample(aborts=1, sequence=1))
        assert rules.trip.by == told and asked(rules) is None  # and no word of the sequence


@pytest.mark.parametrize("shadow", [False, True])
def test_another_part_ends_this_one_but_in_shadow(clock, shadow):
    options = {"safe": None, "shadow": True} if shadow else {}
    watch, rules = watching(**options)
    watch.look(sample())
    watch.look(sample(part=2, sequence=6))
    said = "the machine made itself safe: part 2 was begun on it"
    assert (rules.trip.reason if rules.trip else None) == (None if shadow else said)


def test_only_equal_readings_of_a_commanded_machine_in_a_row_are_stuck(clock):
    watch, rules = watching(stuck={"place": 3})
    command, still, moved = {"velocity": 1.0}, {"place": 1.0}, {"place": 2.0}
    for reading, given in (
        (still, command), (still, command), (moved, command), (moved, command), (moved, {}),
        (moved, command), (still, command), (still, command),
    ):  # fmt: skip
        watch.stuck(reading, given)
        assert asked(rules) is None
    watch.stuck(still, command)
    assert asked(rules) == "place is stuck: 3 equal readings in a row" and rules._asked[1] == "runner"
