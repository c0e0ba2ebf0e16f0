"""A link that is cut, a clock that jumps, a loss of power; in simulated time, against the clock, and served."""

import asyncio
import time
from datetime import UTC, datetime
from math import isnan
from typing import ClassVar

import numpy as np
import pytest
from asyncua import Client, ua
from faults_fakes import Counter, Counting, Steady
from opcua_fakes import Axis, Drive, live, served

import hwsim
from hwsim import faults
from hwsim._live.wall import take_safe
from hwsim.opcua._course import PacedPart
from hwsim.opcua._space import URI

pytestmark = pytest.mark.usefixtures("nothing_collected")
COUNTER = Counter()
MS = 1_000_000


def rows(log, name):
    return log["controller"][name].values.tolist()


def taken(plant, controller, seed=0):
    """Commands that the machine inside took, with their ticks."""
    machine = plant.start(np.random.default_rng(seed))

    class Kept:
        def __init__(self, of):
            self.measures, self.accepts, self.tick = of.measures, of.accepts, of.tick

        def start(self, rng):
            return machine

    hwsim.run(Kept(plant), controller)
    while not isinstance(machine, Counting):
        machine = machine.inner
    return machine.taken


@pytest.mark.parametrize("at", [0.3, 0.21])  # from the first tick at or after it
def test_a_cut_link_loses_measurements_and_holds_commands(at):
    plant = faults.LinkCut(Counter(steps=10), at=at, duration=0.3)
    log = hwsim.run(plant, Steady())
    read = rows(log, "x")
    assert [k for k, value in enumerate(read) if isnan(value)] == [3, 4, 5]
    assert read[:3] + read[6:] == [1, 2, 3, 7, 8, 9, 10, 11] and log.outcome.seen_link_cut.values == [3.0]
    commands = taken(plant, Steady())
    # those of ticks 3, 4, 5 are not taken; that of tick 6 is newer than they are
    assert [tick for tick, _ in commands] == [0, 1, 2, 6, 7, 8, 9]
    assert [command["speed"] for _, command in commands] == pytest.approx([1.1, 1.2, 1.3, 1.7, 1.8, 1.9, 2.0])


def test_the_newest_commands_of_a_cut_arrive_after_it():
    class Once(Steady):
        def step(self, **measured):
            self.read.append(measured)
            return {4: {"speed": 5.0}, 5: {"speed": 6.0, "stop": 0.0}}.get(len(self.read), {})

    commands = taken(faults.LinkCut(Counter(steps=10), at=0.3, duration=0.4), Once())
    assert commands == [(7, {"speed": 6.0, "stop": 0.0})]


def test_an_event_in_a_cut_is_answered_when_the_link_is_back():
    """The machine stands still until the answer reaches it."""
    plant = faults.LinkCut(Counter(events=True, steps=20), at=0.4, duration=0.4)
    log = hwsim.run(plant, Steady(period=None))
    times, read = log["controller"].time.values, np.array(rows(log, "x"))
    assert times == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0]) and np.isnan(read).tolist() == [
        False,
        True,
        *[False] * 3,
    ]
    assert [tick for tick, _ in taken(plant, Steady(period=None))] == [0, 8, 10, 15]


def test_a_cut_around_other_faults_does_not_count_their_samples_anew():
    inside = faults.Dropped(Counter(steps=30), of="y", share=0.4)
    lost = hwsim.run(faults.LinkCut(inside, at=1.0, duration=0.5), Steady(), rng=3)
    plain = hwsim.run(inside, Steady(), rng=3)
    whole = ~np.isnan(rows(lost, "x"))
    assert np.array_equal(np.array(rows(lost, "y"))[whole], np.array(rows(plain, "y"))[whole], equal_nan=True)
    assert lost.outcome.seen_dropped_y == plain.outcome.seen_dropped_y and whole.sum() == 31 - 5


@pytest.mark.parametrize(("of", "name"), [("clock", "clock"), (None, "time")])
def test_a_clock_that_jumps(of, name):
    class Timed(Counter):
        measures: ClassVar = {**Counter.measures, "time": "s"}

        def start(self, rng):
            return TimedMachine(self, *rng.spawn(2))

    class TimedMachine(Counting):
        def step(self, command, ticks):
            return super().step(command, ticks) | {"time": self.time * 0.1}

    plant = faults.ClockJump(Timed(), at=0.3, by=-60.0, of=of)
    machine = plant.start(np.random.default_rng(0))
    read = [machine.step({}, k > 0) for k in range(6)]
    assert [each[name] for each in read] == pytest.approx([0.0, 0.1, 0.2, -59.7, -59.6, -59.5])
    assert [each["x"] for each in read] == [1, 2, 3, 4, 5, 6] and machine.outcome()[plant.seen] == 3.0


def test_a_clock_that_nobody_measures_changes_nothing():
    log = hwsim.run(faults.ClockJump(COUNTER, at=0.3, by=1.0), Steady())
    assert rows(log, "x") == rows(hwsim.run(COUNTER, Steady()), "x") and log.outcome.seen_clock_jump == 38.0


def test_a_loss_of_power_ends_the_part():
    plant = faults.PowerLoss(COUNTER, at=0.52)
    log = hwsim.run(plant, Steady(), parts=2)
    assert log.outcome.aborted.values.tolist() == log.outcome.seen_power_loss.values.tolist() == [1.0, 1.0]
    times, read = log["controller"].time.values[:7], rows(log, "x")[:7]
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) and read[:6] == [1, 2, 3, 4, 5, 6]
    assert isnan(read[6]) and plant.outcomes["aborted"] == ""
    machine = plant.start(np.random.default_rng(0))
    machine.step({"speed": 1.0}, 2**62)
    assert machine.done and machine.time == 6 and machine.outcome()["place"] == pytest.approx(6.0)
    assert isnan(machine.step({"speed": 2.0}, 4)["x"]) and machine.time == 6
    with pytest.warns(UserWarning, match=r"PowerLoss\(at=100 s\) never struck"):
        later = hwsim.run(faults.PowerLoss(COUNTER, at=100.0), Steady())
    assert later.outcome.aborted == later.outcome.seen_power_loss == 0.0


def test_two_losses_of_power_are_one():
    plant = faults.PowerLoss(faults.PowerLoss(COUNTER, at=0.5), at=1.0)
    with pytest.warns(UserWarning, match=r"PowerLoss\(at=1 s\) never struck"):
        outcome = hwsim.run(plant, Steady()).outcome
    assert (outcome.aborted, outcome.seen_power_loss, outcome.seen_power_loss_2) == (1.0, 1.0, 0.0)


def test_nothing_is_learned_from_a_part_without_power(tmp_path):
    class Counts:
        seen = 0

        def next(self, controller, part_log):
            Counts.seen += 1
            return controller

    class Worn(Counter):
        def after(self, outcome):
            raise AssertionError("a part without power tells nothing")

    plant = faults.PowerLoss(Worn(), at=0.1)
    hwsim.run(plant, Steady(), parts=2, adapt=Counts())
    hwsim.run(plant, Steady(), parts=2, adapt=Counts(), live=hwsim.Live(safe={"speed": 0.0}, deadline=0.5))
    assert Counts.seen == 0
    path = tmp_path / "run.db"
    hwsim.run(plant, Steady(), parts=2, journal=path)
    assert hwsim.run(plant, Steady(), parts=3, journal=path).outcome.aborted.values.tolist() == [1.0] * 3


def test_the_machines_own_watchdog_stands_behind_the_cut():
    plant = faults.Late(faults.LinkCut(Axis(), at=0.0, duration=10.0), share=0.5)
    machine = plant.start(np.random.default_rng(0))
    machine.step({"velocity": 3.0}, 1)
    take_safe(machine, {"velocity": 0.0, "stop": 1.0}, 1)
    assert machine.done and machine.outcome()["stopped"] == 1.0


def course(plant):
    return PacedPart(1, plant.start(np.random.default_rng(0)), plant.tick, 1.0, 1)


def shown(plant, ticks=6):
    """What a server shows after each tick."""
    one = course(plant)
    one.go(0)
    samples = [one.sample()]
    for k in range(1, ticks):
        one.advance(k * 100 * MS)
        samples.append(one.sample())
    return samples


def test_the_number_of_a_late_sample_lags_and_that_of_a_duplicated_one_moves():
    for fault, numbers in ((faults.Late, [1, 1, 3, 3, 5, 6]), (faults.Duplicated, [1, 2, 3, 4, 5, 6])):
        samples = shown(fault(COUNTER, at=[1, 3]))
        assert [each.reading["x"] for each in samples] == [1, 1, 3, 3, 5, 6]
        assert [each.sequence for each in samples] == numbers
    late = faults.Late(faults.Late(COUNTER, at=[1, 2, 4]), at=[2, 4])
    samples = shown(late)
    assert (
        [each.sequence for each in samples] == [each.reading["x"] for each in samples] == [1, 1, 1, 4, 4, 6]
    )


def test_a_served_clock_jumps():
    samples = shown(
        faults.ClockJump(faults.ClockJump(Axis(tick=0.1, length=3.0), at=0.2, by=5.0), at=0.4, by=-1.0)
    )
    assert [each.shift for each in samples] == [0.0, 0.0, 5.0, 5.0, 4.0, 4.0]
    assert [each.time for each in samples] == pytest.approx([0.0, 0.1, 5.2, 5.3, 4.4, 4.5])


def test_a_served_link_is_cut_and_comes_back():
    samples = shown(faults.LinkCut(Axis(tick=0.1, length=3.0), at=0.2, duration=0.2))
    assert [each.cut for each in samples] == [False, False, True, True, False, False]


def test_a_served_machine_without_power_is_aborted_and_cut_once():
    samples = shown(faults.PowerLoss(Axis(tick=0.1, length=3.0), at=0.3), 4)
    assert [each.cut for each in samples] == [False] * 3 + [True]
    assert samples[-1].latched == "power loss" and not samples[-1].done
    assert samples[-1].outcome["aborted"] == 1.0


def test_in_lockstep_each_number_is_that_of_a_run():
    plant = faults.Late(
        faults.LinkCut(faults.Dropped(COUNTER, of="x", share=0.2), at=1.0, duration=0.3), share=0.2
    )
    plain = hwsim.run(plant, Steady(), parts=2, rng=7)
    with served(plant, speed=None) as server:
        log = hwsim.run(hwsim.OpcuaPlant(server.url, security="none"), Steady(), parts=2, rng=7)
    for name in plain.outcome:
        assert np.array_equal(log.outcome[name], plain.outcome[name]), name
    for name in plain["controller"]:
        assert np.array_equal(log["controller"][name], plain["controller"][name], equal_nan=True), name


def test_a_server_closes_the_connections_of_its_clients_while_the_link_is_cut():
    axis = Axis(length=3.0)
    with served(faults.LinkCut(axis, at=0.2, duration=0.1)) as server:
        plant = hwsim.OpcuaPlant(server.url, security="none")
        with pytest.raises(hwsim.Aborted, match=r"the link to opc\.tcp://.* was cut") as told:
            hwsim.run(plant, Drive(), live=live())
        assert told.value.log.outcome.safe_by.values == [""]
        until = time.monotonic() + 20.0
        while not server.state["aborts"] and time.monotonic() < until:
            time.sleep(0.02)
        assert server.state["aborted"].startswith("no heartbeat")
    assert axis.told[-1][1] == axis.safe  # by its own watchdog


def test_power_that_is_lost_is_lost_for_the_client_too():
    with served(faults.PowerLoss(Axis(length=3.0), at=0.2)) as server:
        plant = hwsim.OpcuaPlant(server.url, security="none")
        with pytest.raises(hwsim.Aborted, match=r"the link to opc\.tcp://.* was cut"):
            hwsim.run(plant, Drive(), live=live())
        assert server.state["aborted"] == "power loss" and server.state["parts"] == 0
        with pytest.raises(hwsim.Aborted, match=r"the link to opc\.tcp://.* was cut"):  # by the next loss
            hwsim.run(plant, Drive(), live=live())
        assert (server.state["part"], server.state["aborts"]) == (2, 2)  # the same process, a part more
        short = Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, short, live=live()).outcome.aborted.values.tolist() == [0.0]
        plant.close()


async def stamps(url, paths):
    """Source time stamps of nodes of a served axis, and the time of its part."""
    async with Client(url) as client:
        space = await client.get_namespace_index(URI)
        nodes = [client.get_node(ua.NodeId(f"Axis.{path}", space)) for path in paths]
        told = [await node.read_data_value() for node in nodes]
        return [each.SourceTimestamp for each in told], told[-1].Value.Value


def test_a_clock_that_jumps_shifts_the_time_stamps_of_the_server():
    """By a day, which no busy computer is late."""

    class Asking(Drive):
        def step(self, **measured):
            if self.steps == 20:
                seen.append(
                    asyncio.run(stamps(server.url, ("Monitoring.place", "Part.sequence", "Part.time")))
                )
            return super().step(**measured)

    seen = []
    with served(faults.ClockJump(Axis(length=60.0), at=0.1, by=-86400.0), timeout=5.0) as server:
        plant = hwsim.OpcuaPlant(server.url, security="none")
        hwsim.run(plant, Asking(lambda: {"stop": 1.0}, at=25), live=live(deadline=5.0))
    (told, part_time) = seen[-1]
    late = [(datetime.now(UTC) - each.replace(tzinfo=UTC)).total_seconds() for each in told]
    assert all(86000 < each < 87000 for each in late) and -86400 < part_time < -86300
