"""What the coroutines of a live part write and read, against a far end in memory and a clock of the test."""

import asyncio
from math import isnan

import pytest
from far_end_fakes import BAD, GOOD, FarLink, FarMachine, failing

from hwsim._live.forwarding import Forwarding
from hwsim.opcua import _pulse
from hwsim.opcua._gate_process import Writer
from hwsim.opcua._pulse import Pulse

MS = 1_000_000  # ns
SAFE = {"stop": 1.0}
CUT = ConnectionError("the link was cut")


class Clock:
    def __init__(self):
        self.now = 0

    def monotonic_ns(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(_pulse, "time", clock)
    return clock


class Bench:
    """A pulse with deadline 100 ms on a fake machine."""

    def __init__(self, clock, kind=Pulse, events=False, deadline=0.1):
        self.link = FarLink()
        self.machine = FarMachine(self.link)
        self.rules = Forwarding(SAFE, 100 * MS, 0)
        self.clock, self.heard = clock, 0
        self.pulse = kind(self.machine, {}, self.rules, deadline, events, self.hear)

    def hear(self):
        self.heard += 1

    async def turn(self, now=None):
        """Let the tasks do all that is to be done at a time, ms."""
        if now is not None:
            self.clock.now = now * MS
        self.pulse.wake()
        for _ in range(20):
            await asyncio.sleep(0)

    def hand(self, command, now):
        self.clock.now = now * MS
        self.rules.hand(command, now * MS)

    @property
    def sent(self):
        return self.machine.sent


def played(clock, scene, **options):
    """Play a scene on a bench, and end its tasks."""

    async def play():
        bench = Bench(clock, **options)
        await scene(bench)
        await bench.pulse.close()
        assert all(task.done() for task in bench.pulse._tasks)
        return bench

    return asyncio.run(play())


def test_a_command_goes_out_with_a_heartbeat_and_one_follows_each_quarter_of_the_deadline(clock):
    async def scene(bench):
        await bench.turn(0)
        assert bench.sent == []  # no heartbeat before the first command: the part has not begun
        bench.hand({"rate": 1.0}, 10)
        assert bench.pulse.taken == 0
        await bench.turn()
        assert bench.sent == [({"rate": 1.0}, 1)] and bench.pulse.taken == 1
        await bench.turn(34)
        assert len(bench.sent) == 1
        await bench.turn(35)  # 25 ms later
        assert bench.sent[1:] == [({}, 2)]
        bench.hand({"rate": 2.0}, 40)
        await bench.turn()
        assert bench.sent[2:] == [({"rate": 2.0}, 3)] and bench.pulse.taken == 2
        await bench.turn(64)
        assert len(bench.sent) == 3  # counted from the command
        await bench.turn(65)
        assert bench.sent[3:] == [({}, 4)]

    bench = played(clock, scene)
    assert not bench.pulse.safe_written and bench.rules.trip is None


def test_a_hanging_controller_gets_no_heartbeat_but_the_safe_command_once(clock):
    async def scene(bench):
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        await bench.turn(100)  # at the deadline it is alive
        assert bench.sent[1:] == [({}, 2)] and not bench.pulse.safe_written
        before = bench.heard
        await bench.turn(101)
        assert bench.sent[2:] == [(SAFE, None)] and bench.pulse.safe_written and bench.heard > before
        bench.hand({"rate": 2.0}, 102)
        await bench.turn(150)
        assert len(bench.sent) == 3 and bench.pulse._writer_ended

    assert played(clock, scene).rules.trip[1:] == ("link", 0.101)


def test_nothing_is_written_where_the_machine_is_safe_already(clock):
    async def scene(bench):
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        bench.rules.told("it says so", "machine", 5 * MS)
        bench.hand({"rate": 2.0}, 5)
        await bench.turn(10)
        assert bench.pulse.safe_written and len(bench.sent) == 1 and bench.pulse.taken == 1

    played(clock, scene)


def test_after_the_end_nothing_is_written(clock):
    async def scene(bench):
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        await bench.pulse.close()
        bench.hand({"rate": 2.0}, 1)
        await bench.turn(2)
        assert len(bench.sent) == 1 and not bench.pulse.safe_written
        assert bench.rules.trip is None

    played(clock, scene)


@pytest.mark.parametrize("states", [[BAD], [GOOD, BAD]])
def test_a_list_that_the_machine_refuses_is_told(clock, states):
    async def scene(bench):
        await bench.turn(0)
        bench.link.states, bench.machine.said = states, "velocity is not commanded now"
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        assert str(bench.pulse.refusal) == "velocity is not commanded now" and bench.pulse.taken == 1
        assert type(bench.pulse.refusal) is ValueError
        assert bench.machine.refused == [({"rate": 1.0}, BAD)]

    assert played(clock, scene).rules.trip is None


def test_a_list_that_was_on_its_way_at_the_end_of_the_part_is_no_fault(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.states, bench.machine.said = [BAD], ""
        reads = bench.link.reads
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        assert bench.pulse.refusal is None and bench.pulse.taken == 1
        assert bench.link.reads <= reads + 1  # that of the reader alone

    assert played(clock, scene).rules.trip is None


def test_a_refusal_of_a_machine_that_has_made_itself_safe_says_so(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.states = [BAD]
        bench.link.sample = bench.link.sample._replace(aborts=1, aborted="no heartbeat")
        bench.hand({"rate": 1.0}, 7)
        await bench.turn()
        await bench.turn(8)
        assert bench.pulse.refusal is None and bench.pulse.safe_written

    trip = played(clock, scene).rules.trip
    assert trip[:2] == ("the machine made itself safe: no heartbeat", "machine")


def test_a_safe_command_that_is_refused_leaves_it_unknown(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.states, bench.machine.said = [BAD], "not now"
        bench.rules.ask("door open", "runner")
        await bench.turn(1)
        assert bench.sent == [(SAFE, None)] and bench.pulse.refusal is None

    trip = played(clock, scene).rules.trip
    assert trip[:2] == ("door open; the safe command was refused: not now", "") and isnan(trip.delay)


def test_a_cut_link_is_known_and_nobody_knows_the_machine(clock):
    async def scene(bench):
        bench.link.before_write = failing(CUT)
        bench.hand({"rate": 1.0}, 0)
        before = bench.heard
        await bench.turn()
        assert bench.heard > before and bench.pulse.safe_written  # no use to wait for it
        assert bench.link.written == 1  # and no other try over this link

    assert played(clock, scene).rules.trip[:2] == ("the link was cut", "")


def test_a_link_that_the_reader_loses_ends_the_writer_too(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.before_read = failing(CUT)
        await bench.turn(1)
        bench.hand({"rate": 1.0}, 2)
        await bench.turn(3)
        assert bench.sent == [] and bench.pulse.safe_written

    assert played(clock, scene).rules.trip[:2] == ("the link was cut", "")


def test_a_link_that_is_cut_after_the_safe_command_changes_nothing(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.rules.ask("door open", "runner")
        await bench.turn(1)
        bench.link.before_read = failing(CUT)
        await bench.turn(2)

    assert played(clock, scene).rules.trip[:2] == ("door open", "runner")


def test_the_safe_command_on_a_link_that_is_cut_is_not_claimed(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.before_write = failing(CUT)
        bench.rules.ask("door open", "runner")
        await bench.turn(1)
        assert bench.pulse.safe_written

    assert played(clock, scene).rules.trip[:2] == ("door open; the link was cut", "")


def test_an_error_of_the_reader_lets_the_writer_make_it_safe(clock):
    async def scene(bench):
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        bench.link.before_read = failing(ArithmeticError("odd"))
        await bench.turn(1)
        await bench.turn(2)
        assert bench.sent[-1] == (SAFE, None) and bench.pulse.safe_written

    assert played(clock, scene).rules.trip[:2] == ("ArithmeticError: odd", "link")


def test_an_error_of_the_reader_waits_for_the_list_that_is_on_its_way(clock):
    async def scene(bench):
        gate = asyncio.Event()
        await bench.turn(0)
        bench.link.before_write = gate.wait
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        bench.link.before_read = failing(ArithmeticError("odd"))
        await bench.turn(1)
        assert bench.link.written == 1  # one list at a time: none overtakes another
        gate.set()
        await bench.turn(2)
        assert [command for command, _ in bench.sent] == [{"rate": 1.0}, SAFE]

    played(clock, scene)


def test_each_turn_of_the_writer_is_heard(clock):
    async def scene(bench):
        await bench.turn(0)
        before = bench.heard
        await bench.turn(1)
        assert before > 0 and bench.heard > before and bench.sent == []

    played(clock, scene, kind=Writer)


def test_an_error_of_the_writer_is_answered_by_the_safe_command(clock):
    async def scene(bench):
        await bench.turn(0)
        errors = iter([ArithmeticError("odd")])

        async def once():
            for error in errors:
                raise error

        bench.link.before_write = once
        bench.hand({"rate": 1.0}, 0)
        before = bench.heard
        await bench.turn()
        assert [command for command, _ in bench.sent] == [{"rate": 1.0}, SAFE]
        assert bench.sent[-1] == (SAFE, None)
        assert bench.pulse.safe_written and bench.heard >= before + 2

    assert played(clock, scene).rules.trip[:2] == ("ArithmeticError: odd", "link")


def test_where_the_safe_command_fails_too_nobody_knows(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.before_write = failing(ArithmeticError("odd"))
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        assert bench.pulse.safe_written and len(bench.sent) == 2

    assert played(clock, scene).rules.trip[:2] == ("ArithmeticError: odd", "")


def test_a_safe_command_that_fails_on_its_way_is_not_written_twice(clock):
    async def scene(bench):
        await bench.turn(0)
        bench.link.before_write = failing(ArithmeticError("odd"))
        bench.rules.ask("door open", "runner")
        await bench.turn(1)
        assert bench.sent == [(SAFE, None)] and bench.pulse.safe_written

    assert played(clock, scene).rules.trip[:2] == ("door open; ArithmeticError: odd", "")


def test_an_error_of_the_reader_after_the_end_moves_nothing(clock):
    async def scene(bench):
        bench.hand({"rate": 1.0}, 0)
        await bench.turn()
        await bench.pulse.close()
        assert bench.pulse._writer_ended and not bench.pulse.safe_written
        await bench.pulse._failed("late")
        assert len(bench.sent) == 1

    played(clock, scene)


def test_a_sample_that_is_wanted_is_read_at_once(clock):
    async def scene(bench):
        await bench.turn(3)
        assert bench.pulse.seen.at == 0 or bench.pulse.seen.at == 3 * MS
        bench.pulse.wanted += 1
        assert bench.pulse.served == 0
        heard = bench.heard
        await bench.turn(5)
        assert bench.pulse.served == 1 and bench.pulse.seen.at == 5 * MS and bench.heard > heard
        reads = bench.link.reads
        for _ in range(20):
            await asyncio.sleep(0)
        assert bench.link.reads == reads  # none more for nothing

    played(clock, scene)


def test_a_sample_that_is_wanted_while_one_is_read_is_another(clock):
    async def scene(bench):
        gate = asyncio.Event()
        await bench.turn(0)
        bench.link.before_read = gate.wait
        await bench.turn(1)
        bench.pulse.wanted = 1  # after the one under way was asked for
        gate.set()
        await bench.turn(2)
        assert bench.pulse.served == 1 and bench.pulse.seen.at == 2 * MS

    played(clock, scene)


@pytest.mark.parametrize(
    ("events", "deadline", "every"),
    [(False, 0.001, 0.05), (False, 9.0, 0.05), (True, 0.001, 0.01), (True, 0.06, 0.03), (True, 9.0, 0.05)],
)
def test_how_often_samples_are_read(clock, events, deadline, every):
    async def scene(bench):
        assert bench.pulse._read_every == pytest.approx(every)

    played(clock, scene, events=events, deadline=deadline)


def test_the_first_sample_stays_the_first(clock):
    async def scene(bench):
        await bench.turn(0)
        first = bench.pulse._first
        assert first is not None and first.sequence == 6
        await bench.turn(1)
        assert bench.pulse._first is first and bench.pulse.seen.sequence > first.sequence

    played(clock, scene)


def test_a_writer_without_a_reader_reads_only_when_asked(clock):
    async def scene(bench):
        await bench.turn(0)
        assert bench.link.reads == 0
        bench.hand({"rate": 1.0}, 0)
        await bench.turn(1)
        await bench.pulse.sample()
        assert bench.link.reads == 1 and bench.sent == [({"rate": 1.0}, 1)]

    played(clock, scene, kind=Writer)


def test_what_was_handed_over_elsewhere_is_looked_at_before_each_poll(clock):
    async def scene(bench):
        waiting = [{"rate": 3.0}]
        bench.rules.look = lambda: [bench.rules.hand(waiting.pop(), 0) for _ in waiting[:]]
        await bench.turn(0)
        assert bench.sent == [({"rate": 3.0}, 1)] and bench.pulse.taken == 1

    played(clock, scene)
