"""The gate: the rules of the link's thread in a process of its own. Nothing is timed; benchmarks/opcua.py does."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hwsim_fakes import Drain, Tank
from hypothesis import given, settings
from hypothesis import strategies as st
from opcua_fakes import Axis, Drive, live, served

import hwsim
from hwsim._live.forwarding import Forwarding, Trip
from hwsim.opcua._foreign import nodes_of, read_nodes
from hwsim.opcua._gate import Gate
from hwsim.opcua._gate_process import RunnerProcess
from hwsim.opcua._gate_rules import GateAnswer, GatedForwarding, GateRules, Handed
from hwsim.opcua._gated import GateReader
from hwsim.opcua._slots import Slots, mapped, shared

pytestmark = pytest.mark.usefixtures("nothing_collected")

MS = 1_000_000  # ns
SAFE = {"stop": 1.0}
NAMES = ("rate", "stop", "path")


def pair(deadline=50, part=1, gone=lambda: False, size=1 << 12):
    """A runner's side and a gate's side over the same memory."""
    memory = memoryview(bytearray(size))
    runner = GatedForwarding(SAFE, deadline * MS, 0, part=1, names=NAMES, slots=Slots(memory))
    rules = GateRules(SAFE, deadline * MS, 0, part=part, names=NAMES, slots=Slots(memory), gone=gone)
    return runner, rules


def polled(rules, now):
    rules.look()
    return rules.poll(now * MS)


def test_the_gate_forwards_young_commands_then_the_safe_one_then_nothing():
    runner, rules = pair()
    handed, written = {0: "a", 10: "b", 20: "c", 61: "d", 113: "e"}, []
    for now in range(200):
        if now in handed:
            runner.hand({"rate": float(ord(handed[now]))}, now * MS)
        if now % 2 == 0 and (values := polled(rules, now)):
            written.append((now, chr(int(values["rate"])) if "rate" in values else values))
    assert written == [(0, "a"), (10, "b"), (20, "c"), (62, "d"), (112, SAFE)]
    assert rules.trip == Trip("no sign of the controller for more than 50 ms", "gate", 0.051)


ACTS = st.lists(
    st.tuples(st.sampled_from(["hand", "renew", "ask", "over", "poll", "poll"]), st.integers(0, 30)),
    max_size=40,
)


@given(ACTS)
def test_gate_and_link_thread_write_the_same(acts):
    """Where each command is polled before the next, as a runner waits until it was taken."""
    runner, rules = pair()
    one, now = Forwarding(SAFE, 50 * MS, 0), 0
    for number, (act, later) in enumerate(acts):
        now += later
        if act == "hand":
            runner.hand({"rate": float(number)}, now * MS)
            one.hand({"rate": float(number)}, now * MS)
        elif act == "renew":
            runner.renew(now * MS)
            one.renew(now * MS)
        elif act == "ask":
            runner.ask("door open", "runner")
            one.ask("door open", "runner")
        elif act == "over":
            runner.over()
            if one._asked is None:  # a safe command that was asked for is written all the same
                one.told("the part is over", "gate", now * MS)
        if act in ("hand", "over", "poll"):
            assert polled(rules, now) == one.poll(now * MS)
            assert rules.alive(now * MS) == one.alive(now * MS)
    assert (rules.trip is None) == (one.trip is None)


def test_a_command_is_written_once_and_arrays_come_whole():
    runner, rules = pair()
    path = np.arange(6.0).reshape(3, 2)
    runner.hand({"rate": -0.0, "path": path}, 0)
    runner.renew(MS)
    told = polled(rules, 2)
    assert np.array_equal(told["path"], path) and np.signbit(told["rate"]) and rules.handed == 1
    runner.renew(3 * MS)
    assert polled(rules, 4) == {}
    runner.hand({"rate": 3.0}, 5 * MS)
    runner.hand({"rate": 4.0}, 5 * MS)  # a runner waits for each; who does not has the newest one
    assert polled(rules, 6) == {"rate": 4.0} and polled(rules, 7) == {} and rules.handed == 3
    runner.hand({"path": [1.0, float("nan")]}, 7 * MS)
    assert polled(rules, 8) == SAFE and "path must be a finite number" in rules.trip.reason


def test_a_command_of_a_step_beyond_the_deadline_is_not_forwarded_though_the_gate_slept():
    runner, rules = pair()
    runner.hand({"rate": 1.0}, 50 * MS)
    assert polled(rules, 50) == {"rate": 1.0}
    runner.hand({"rate": 2.0}, 101 * MS)
    assert polled(rules, 102) == SAFE
    assert rules.trip == Trip("no sign of the controller for more than 50 ms", "gate", 0.052)


def test_a_gate_that_slept_while_the_runner_was_alive_goes_on():
    runner, rules = pair()
    for now in range(0, 200, 40):
        runner.renew(now * MS)
    runner.hand({"rate": 1.0}, 200 * MS)
    assert polled(rules, 201) == {"rate": 1.0} and rules.trip is None


def test_a_command_that_the_gate_reads_late_is_not_forwarded():
    runner, rules = pair()
    runner.hand({"rate": 1.0}, 0)
    runner.renew(50 * MS)
    assert polled(rules, 50) == {"rate": 1.0}
    runner.hand({"rate": 2.0}, 60 * MS)
    runner.renew(111 * MS)  # the runner waits; the gate was held up by a heartbeat on its way
    assert polled(rules, 111) == SAFE and rules.trip.by == "gate"
    assert rules.trip.reason == "a command waited 51 ms for the link, longer than the deadline of 50 ms"


def test_what_a_runner_asks_for_comes_first_and_the_first_reason_counts():
    runner, rules = pair()
    runner.hand({"rate": 1.0}, MS)
    runner.ask("door open", "runner")
    runner.ask("late", "gate")
    assert polled(rules, 2) == SAFE and rules.trip[:2] == ("door open", "runner")
    assert polled(rules, 4) == {}


def test_after_the_end_nothing_is_written():
    runner, rules = pair()
    runner.hand({"rate": 1.0}, 0)
    runner.over()
    assert [polled(rules, now) for now in (2, 100, 1000)] == [{}, {}, {}] and not rules.alive(2 * MS)


def test_a_gate_that_answers_the_end_of_a_part_at_once_breaks_nothing_off():
    """A finished part was told as aborted where that answer was read before the runner had ceased to read."""
    runner, rules = pair()
    runner.over()
    polled(rules, 0)
    reader = GateReader.__new__(GateReader)
    reader._gated = runner
    reader._take_in(GateAnswer(1, 0, True, rules.trip, None))
    assert runner.trip is None and rules.trip is not None


def test_a_machine_that_made_itself_safe_stops_the_gate():
    runner, rules = pair()
    runner.hand({"rate": 1.0}, 0)
    polled(rules, 0)
    runner.told("the machine made itself safe", "machine", 3 * MS)
    runner.ask("late", "runner")
    assert polled(rules, 200) == {} and rules.trip.by == "machine"
    assert runner.trip == ("the machine made itself safe", "machine", 0.003)


def test_a_reading_session_that_was_cut_asks_the_gate():
    runner, rules = pair()
    runner.lost("the link was cut", MS)
    assert runner.trip is None and polled(rules, 2) == SAFE
    assert rules.trip[:2] == ("the link was cut", "gate")


def test_records_of_another_part_and_a_dead_runner():
    runner, rules = pair(part=2)
    runner.hand({"rate": 1.0}, 0)
    assert polled(rules, 2) == {} and rules.handed == 0
    dead = []
    runner, rules = pair(gone=lambda: bool(dead))
    runner.hand({"rate": 1.0}, 0)
    assert polled(rules, 2) == {"rate": 1.0}
    runner.hand({"rate": 2.0}, 3 * MS)  # its last act
    dead.append(True)
    assert polled(rules, 4) == SAFE and rules.trip[:2] == ("the runner's process has ended", "gate")


def test_records_pass_bytes_unchanged():
    told = Handed(3, 7, 123, 98, 1, "runner", "Tür offen\nzweite Zeile", b"\0" * 16)
    assert Handed.unpacked(told.packed()) == told
    for trip in (None, Trip("late", "gate", 0.05)):
        answer = GateAnswer(3, 7, True, trip, "no")
        assert GateAnswer.unpacked(answer.packed()) == answer


def test_the_newest_record_is_read_once():
    memory = memoryview(bytearray(256))
    writer, reader = Slots(memory), Slots(memory)
    assert reader.read() is None
    for content in (b"one", b"two", b"three"):
        writer.write(content)
    assert reader.read() == b"three" and reader.read() is None
    with pytest.raises(ValueError, match="a record must have <= 100 bytes; got 101"):
        writer.write(bytes(101))
    writer.write(b"four")
    assert reader.read() == b"four"


@pytest.mark.parametrize("read_first", [False, True])
def test_a_torn_record_is_not_taken_and_the_one_before_is(read_first):
    """A writer that was killed at any byte of its record, in both orders of the copy."""
    before = memoryview(bytearray(256))
    writer = Slots(before)
    for content in (b"alpha", b"bravo"):
        writer.write(content)
    after = memoryview(bytearray(before))
    last = Slots(after)
    last._number = 2
    last.write(b"charlie")
    changed = [k for k in range(256) if before[k] != after[k]]
    for cut in range(len(changed)):
        for torn in (changed[:cut], changed[cut + 1 :]):
            memory = bytearray(before)
            for k in torn:
                memory[k] = after[k]
            reader = Slots(memoryview(memory))
            reader._number = 2 if read_first else 0
            assert reader.read() == (None if read_first else b"bravo")


@settings(max_examples=50)
@given(st.integers(0, 127), st.integers(1, 255))
def test_a_changed_byte_of_the_newest_record_is_seen(place, change):
    memory = bytearray(256)
    writer = Slots(memoryview(memory))
    writer.write(b"a" * 20)  # in the second half
    writer.write(b"b" * 20)  # in the first
    memory[place] ^= change
    whole = place >= 28 + 20  # beyond the record
    assert Slots(memoryview(memory)).read() == (b"b" * 20 if whole else b"a" * 20)


@pytest.mark.parametrize("named", [False, True])
def test_two_mappings_of_one_file_share_records(named, monkeypatch):
    if named:  # a system without files in memory
        monkeypatch.delattr(os, "memfd_create", raising=False)
    file = shared(1 << 12)
    one, other = Slots(mapped(file, 1 << 12)), Slots(mapped(file, 1 << 12))
    os.close(file)
    one.write(b"record")
    assert other.read() == b"record"


def test_a_process_is_watched_until_it_ends():
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    assert RunnerProcess(ended.pid).gone()
    assert not RunnerProcess(os.getppid()).gone()
    blind = RunnerProcess(os.getppid())
    blind._file = None  # a system without descriptors of processes
    assert not blind.gone()
    blind._number += 1  # it was another's child meanwhile
    assert blind.gone()


def test_a_table_of_nodes_goes_over_a_wire(tmp_path):
    text = """
[measures.size]
node = "ns=3;s=Size"
unit = "um"
sample = "ns=3;s=Count"
[commands.velocity]
node = "ns=3;s=Velocity"
unit = "m/min"
min = 0.0
max = "2 m/min"
[machine]
done = "ns=3;s=Done"
"""
    (tmp_path / "nodes.toml").write_text(text)
    nodes = read_nodes(tmp_path / "nodes.toml")
    assert nodes_of(json.loads(json.dumps(nodes))) == nodes


def test_where_a_gate_is_refused():
    with pytest.raises(ValueError, match="gate must be False in shadow, where nothing is written"):
        hwsim.Live(shadow=True, gate=True)
    with pytest.raises(ValueError, match="gate must be False on a simulated Tank"):
        hwsim.run(Tank(), Drain(1.0, 0.01), live=hwsim.Live(safe={"flow": 0.0}, gate=True))


def test_the_process_of_the_gate_imports_no_plant_and_no_compiled_code():
    code = "import sys, hwsim.opcua._gate_process; print(*sys.modules)"
    names = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numba", "scipy", "xarray", "casadi", "hwsim.plants"} & set(names)


def behind(server):
    return hwsim.OpcuaPlant(server.url, security="none")


def test_a_gate_that_answers_late_is_ended():
    gate = Gate.__new__(Gate)
    gate._line, other = socket.socketpair()
    silent = [sys.executable, "-c", "import sys; sys.stdin.read()"]  # until the line is closed
    with other:
        gate._process = subprocess.Popen(silent, stdin=other)
    with pytest.raises(ConnectionError, match="the gate's process does not answer: timed out"):
        gate._ask(0.01, act="end")
    assert not gate.alive


def test_a_run_through_the_gate():
    axis = Axis(length=0.2)
    with served(axis, timeout=60.0) as server:
        plant = behind(server)
        log = hwsim.run(plant, Drive(), live=live(gate=True))
        assert log.outcome.aborted.values.tolist() == [0.0] and server.state["parts"] == 1
        assert [command["velocity"] for _, command in axis.told[:2]] == [1.001, 1.002]
        plant.close()


def test_a_step_that_hangs_behind_the_gate_and_parts_after_it():
    axis, through = Axis(length=60.0), {"gate": True, "deadline": 0.3}
    with served(axis, timeout=60.0) as server:
        plant = behind(server)
        with pytest.raises(hwsim.Aborted, match="no sign of the controller for more than 300 ms") as said:
            hwsim.run(plant, Drive(lambda: time.sleep(0.4) or {"velocity": 9.0}), live=live(**through))
        assert said.value.log.outcome.safe_by.values.tolist() == ["gate"]
        assert axis.told[-1][1] == axis.safe and {"velocity": 9.0} not in [each for _, each in axis.told]
        gate, ended = plant._link.gate, Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, ended, live=live(**through)).outcome.stopped.values.tolist() == [1.0]
        assert plant._link.gate is gate  # one process for all parts
        assert len(hwsim.run(plant, ended, live=live())) == 1  # the session of this process commands again
        assert plant._link.gate is None and not gate.alive
        plant.close()


def test_a_gate_that_is_killed_leaves_the_machine_to_its_own_watchdog():
    axis = Axis(length=60.0)
    with served(axis, timeout=0.3) as server:
        plant = behind(server)
        odd = lambda: os.kill(plant._link.gate._process.pid, signal.SIGKILL) or {}  # noqa: E731
        with pytest.raises(hwsim.Aborted, match="the gate's process has ended") as said:
            hwsim.run(plant, Odd(odd), live=live(gate=True))
        until = time.monotonic() + 10
        while not server.state["aborts"] and time.monotonic() < until:
            time.sleep(0.01)
        assert server.state["aborted"] == "no heartbeat for more than 0.3 s" and axis.told[-1][1] == axis.safe
        assert said.value.log.outcome.safe_by.values.tolist() == ["machine"]
        plant.close()


class Odd(Drive):
    """A drive that is not copied: its odd step knows the plant."""

    def __deepcopy__(self, memo):
        return self


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[1])
import hwsim
from opcua_fakes import Drive, live
odd = Drive(lambda: os.kill(os.getpid(), signal.SIGKILL))
hwsim.run(hwsim.OpcuaPlant(sys.argv[2], security="none"), odd, live=live(gate=True))
"""


def test_a_runner_that_is_killed_is_answered_by_the_gate_long_before_the_machine():
    axis = Axis(length=60.0)
    with served(axis, timeout=60.0) as server:
        command = [sys.executable, "-c", KILLED, Path(__file__).parent, server.url]
        assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
        until = time.monotonic() + 10
        while not (axis.told and axis.told[-1][1] == axis.safe) and time.monotonic() < until:
            time.sleep(0.01)
        assert [command for _, command in axis.told][-1] == axis.safe and len(axis.told) >= 3
        while server.state["operator"] and time.monotonic() < until:  # the gate has left
            time.sleep(0.01)
        assert not server.state["operator"] and server.state["aborts"] == 0
