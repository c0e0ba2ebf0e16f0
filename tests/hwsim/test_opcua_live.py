"""Live runs on a served machine: what is written, who makes it safe, what the operator at the machine can do.

Nothing is timed here; benchmarks/opcua.py measures how fast it is.
"""

import asyncio
import threading
import time
from decimal import Decimal
from math import nan
from typing import ClassVar

import numpy as np
import pytest
from asyncua import Client, ua
from opcua_fakes import Axis, Cable, Drive, live, served

import hwsim
import sdpgrind
from hwsim._live.forwarding import Forwarding
from hwsim.opcua import _begin, _link, _live_part
from hwsim.opcua._link import writes
from hwsim.opcua._live_part import Watch
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._remote import Remote
from hwsim.opcua._sample import ReadSample, checked, read_number
from hwsim.opcua._space import URI

pytestmark = pytest.mark.usefixtures("nothing_collected")


@pytest.fixture
def axis():
    return Axis()


def behind(server, **options):
    return hwsim.OpcuaPlant(server.url, security="none", **options)


def velocities_after_safe(axis):
    """Commands that would move the axis after the first safe one."""
    safe = [k for k, (_, command) in enumerate(axis.told) if command.get("stop")]
    assert safe, axis.told
    return [command for _, command in axis.told[safe[0] + 1 :] if command.get("velocity")]


def test_a_part_runs_in_wall_time_and_is_journaled(axis, tmp_path):
    with served(axis) as server:
        control = live()
        log = hwsim.run(behind(server), Drive(), parts=2, live=control, journal=tmp_path / "shift.db")
        state = server.state
    assert log.outcome.aborted.values.tolist() == [0.0, 0.0] and state["parts"] == 2 and state["aborts"] == 0
    assert log.outcome.stopped.values.tolist() == [0.0, 0.0] and control.state == "idle"
    table = log["controller"]
    assert table.time.values[0] == 0.0 and table.velocity_command.values[0] == 1.001
    assert 1.0 < table.speed.values[-1] < 1.1
    assert [command["velocity"] for _, command in axis.told[:2]] == [1.001, 1.002]
    assert len(sdpgrind.load(tmp_path / "shift.db").log()) == 2


def loop(seconds):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass
    return {}


@pytest.mark.parametrize(
    ("odd", "reason", "by"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero", "runner"),
        (
            lambda: {"velocity": nan},
            "ValueError: velocity commanded by controller must be a number",
            "runner",
        ),
        (
            lambda: {"feed": 1.0},
            "ValueError: a command of controller must be one of velocity, stop",
            "runner",
        ),
        (
            lambda: {"velocity": 50.0},
            "ValueError: velocity must be in [-10, 10] (mm/s); got 50.0",
            "runner",
        ),
        (lambda: {"stop": np.array([1.0, nan])}, "ValueError: stop[1] must be finite; got nan", "runner"),
        (
            lambda: {"velocity": "0.01"},
            "TypeError: velocity must be a number (mm/s); got '0.01'",
            "runner",
        ),
        (
            lambda: {"velocity": Decimal("0.01")},
            "TypeError: velocity must be a number (mm/s); got Decimal('0.01')",
            "runner",
        ),
        (lambda: time.sleep(0.2) or {}, "no sign of the controller for more than 100 ms", "link"),
        (lambda: loop(0.2), "no sign of the controller for more than 100 ms", "link"),
        (lambda: (_ for _ in ()).throw(KeyboardInterrupt), "KeyboardInterrupt", "runner"),
    ],
)
def test_whatever_goes_wrong_the_safe_command_comes_first_and_nothing_after(odd, reason, by):
    axis = Axis(length=60.0)
    with served(axis) as server, pytest.raises(hwsim.Aborted, match="made safe") as said:
        hwsim.run(behind(server), Drive(odd), parts=2, live=live())
    outcome = said.value.log.outcome
    assert outcome.aborted.values.tolist() == [1.0] and outcome.safe_by.values[0] == by
    assert reason in outcome.abort_reason.values[0]
    assert axis.told[-1][1] == axis.safe and not velocities_after_safe(axis)
    assert len(said.value.log["controller"].time) >= 4


def test_a_command_goes_out_as_a_simulated_machine_takes_it():
    for odd in ("0.01", Decimal("0.01"), 1j, np.array(0.01), True, None):
        with pytest.raises(TypeError, match=r"velocity must be a number \(mm/s\); got "):
            checked("velocity", odd, "mm/s")
    for one in (1, np.float32(1.0), np.int64(1)):
        assert type(checked("velocity", one, "mm/s")) is float
    assert checked("path", [[1, 2], [3, 4]], "").tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_a_text_is_refused_in_lockstep_as_in_a_simulation(axis):
    with (
        pytest.raises(TypeError, match=r"velocity must be a number \(mm/s\); got '0.01'"),
        served(axis, speed=None) as server,
    ):
        hwsim.run(behind(server), Drive(lambda: {"velocity": "0.01"}))


def test_an_operator_aborts_from_another_thread():
    axis, control = Axis(length=60.0), live()
    with served(axis) as server:
        odd = lambda: threading.Thread(target=control.abort, args=("door open",)).start() or {}  # noqa: E731
        with pytest.raises(hwsim.Aborted, match="door open"):
            hwsim.run(behind(server), Drive(odd), live=control)
    assert axis.told[-1][1] == axis.safe and control.state == "aborted"


async def _call(url, method, *arguments):
    async with Client(url) as client:
        space = await client.get_namespace_index(URI)
        machine = client.get_node(ua.NodeId("Axis", space))
        return await machine.call_method(ua.NodeId(f"Axis.{method}", space), *arguments)


def call(server, method, *arguments):
    return asyncio.run(_call(server.url, method, *arguments))


class Calling(Drive):
    """Calls a method at the machine in a thread, within its step `at`."""

    def __init__(self, server, *call, **options):
        super().__init__(**options)
        self.server, self.call = server, call

    def __deepcopy__(self, memo):
        return Calling(self.server, *self.call, at=self.at, period=self.period)

    def step(self, **measured):
        command = super().step(**measured)
        if self.steps == self.at:
            threading.Thread(target=call, args=(self.server, *self.call), daemon=True).start()
        return command


def test_an_abort_at_the_machine_reaches_the_run():
    axis, control = Axis(length=60.0), live()
    with served(axis) as server:
        with pytest.raises(hwsim.Aborted, match="the machine made itself safe: emergency exit") as said:
            hwsim.run(behind(server), Calling(server, "Abort", "emergency exit"), parts=2, live=control)
        assert server.state["aborted"] == "emergency exit" and server.state["aborts"] == 1
    assert said.value.log.outcome.safe_by.values.tolist() == ["machine"]
    assert [act.who for act in control.acts][-1:] in ([], ["machine"])
    assert control.reason == "emergency exit" and not velocities_after_safe(axis)


class Pausing(Calling):
    """Has the machine paused in its first part; ends a part five steps after it knows of the pause."""

    def __deepcopy__(self, memo):
        return Pausing(self.server, *self.call, at=self.at, period=self.period)

    def reset(self):
        super().reset()
        self.left = 5
        if self.server.state["parts"]:
            self.at = 0

    def step(self, **measured):
        command = super().step(**measured)
        self.left -= bool(self.server.state["paused"] or self.server.state["parts"])
        return command if self.left > 0 else {"stop": 1.0}


def test_a_pause_at_the_machine_ends_after_the_part_and_goes_on():
    axis, control = Axis(length=60.0), live()

    def resume_between_parts():
        while not (server.state["paused"] and server.state["parts"] == 1 and control.state == "paused"):
            time.sleep(0.02)
        call(server, "Resume")

    with served(axis) as server:
        resume = threading.Thread(target=resume_between_parts, daemon=True)
        resume.start()
        log = hwsim.run(behind(server), Pausing(server, "Pause"), parts=2, live=control)
        resume.join()
        assert server.state["parts"] == 2
    assert [(act.who, act.what) for act in control.acts[:2]] == [("machine", "pause"), ("machine", "resume")]
    assert log.outcome.aborted.values.tolist() == [0.0, 0.0]


def test_a_machine_without_a_heartbeat_makes_itself_safe_and_is_latched(axis):
    axis = Axis(length=60.0)

    async def operate(url):
        async with Client(url) as client:
            space = await client.get_namespace_index(URI)
            node = lambda path: client.get_node(ua.NodeId(f"Axis.{path}", space))  # noqa: E731
            machine = client.get_node(ua.NodeId("Axis", space))

            async def start(part):
                return await machine.call_method(node("Start"), ua.Variant(part, ua.VariantType.Int64), "7")

            assert await start(1) == ""
            velocity, heartbeat = node("Commands.velocity"), node("Commands.heartbeat")
            beat = lambda k: ua.Variant(k, ua.VariantType.UInt32)  # noqa: E731
            await client.write_values([velocity, heartbeat], [2.0, beat(1)])
            while not await node("Production.aborted").read_value():
                await heartbeat.write_value(beat(1))  # it stands still
                await asyncio.sleep(0.02)
            said = [await node("Production.aborted").read_value(), await start(1)]
            with pytest.raises(ua.uaerrors.BadInvalidState):
                await velocity.write_value(3.0)
            assert await start(2) == ""
            await client.write_values([velocity, heartbeat], [4.0, beat(2)])
            return said

    with served(axis, timeout=0.2) as server:
        said = asyncio.run(operate(server.url))
    assert (
        said[0] == "no heartbeat for more than 0.2 s" and said[1] == "part must be > 1, a new number; got 1"
    )
    assert [command for _, command in axis.told] == [{"velocity": 2.0}, axis.safe, {"velocity": 4.0}]


def test_another_session_does_not_keep_the_part_of_a_lost_one_alive():
    axis = Axis(length=60.0)
    beat = lambda k: ua.Variant(k, ua.VariantType.UInt32)  # noqa: E731

    async def operate(url):
        async with Client(url) as first:
            space = await first.get_namespace_index(URI)
            node = lambda client, path: client.get_node(ua.NodeId(f"Axis.{path}", space))  # noqa: E731
            start = ua.NodeId("Axis.Start", space), ua.Variant(1, ua.VariantType.Int64), "7"
            assert await first.get_node(ua.NodeId("Axis", space)).call_method(*start) == ""
            await node(first, "Commands.heartbeat").write_value(beat(1))
        async with Client(url) as other:
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await node(other, "Commands.heartbeat").write_value(beat(2))
            while not (said := await node(other, "Production.aborted").read_value()):
                await asyncio.sleep(0.02)
            return said

    with served(axis, timeout=0.2) as server:
        assert asyncio.run(operate(server.url)) == "no heartbeat for more than 0.2 s"


def test_writes_outside_the_range_and_nan_are_refused(axis):
    async def operate(url):
        async with Client(url) as client:
            space = await client.get_namespace_index(URI)
            velocity = client.get_node(ua.NodeId("Axis.Commands.velocity", space))
            for value in (10.1, nan, float("inf")):
                with pytest.raises(ua.uaerrors.BadOutOfRange):
                    await velocity.write_value(value)
            with pytest.raises(ua.uaerrors.BadTypeMismatch):
                await velocity.write_value(3)
            place = client.get_node(ua.NodeId("Axis.Monitoring.place", space))
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await place.write_value(1.0)
            unit = await client.get_node(
                ua.NodeId("Axis.Commands.velocity.EngineeringUnits", space)
            ).read_value()
            ends = await client.get_node(ua.NodeId("Axis.Commands.velocity.EURange", space)).read_value()
            return unit.DisplayName.Text, unit.UnitId, ends.Low, ends.High

    with served(axis) as server:
        assert asyncio.run(operate(server.url)) == ("mm/s", 0x433136, -10.0, 10.0)  # C16
    assert axis.told == []


def test_a_cut_link_ends_the_part_and_the_machine_makes_itself_safe():
    axis = Axis(length=60.0)
    with served(axis, timeout=0.2) as server:
        cable = Cable(int(server.url.rpartition(":")[2]))
        plant = hwsim.OpcuaPlant(cable.url, security="none")
        odd = Drive(lambda: cable.cut() or {"velocity": 3.0})
        told = f"part 0 was aborted, and it is not known whether the machine is safe: the link to {cable.url} was"
        with pytest.raises(hwsim.Aborted, match=f"{told} cut; its own watchdog must .* within 0.2 s") as said:
            hwsim.run(plant, odd, live=live())
        until = time.monotonic() + 5
        while not server.state["aborts"] and time.monotonic() < until:
            time.sleep(0.01)
        assert server.state["aborted"] == "no heartbeat for more than 0.2 s"
        outcome = said.value.log.outcome
        assert outcome.safe_by.values.tolist() == [""] and np.isnan(outcome.safe_delay.values).all()
        assert not velocities_after_safe(axis)
        short = Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, short, live=live()).outcome.stopped.values.tolist() == [
            1.0
        ]  # a fresh session
        plant.close()
        cable.close()


def test_after_a_stall_nothing_is_delivered_late_and_the_session_is_not_used_again(monkeypatch):
    for waiting in (_link, _live_part):
        monkeypatch.setattr(waiting, "ANSWER", 0.5)  # s; an answer takes milliseconds
    axis = Axis(length=60.0)
    with served(axis, timeout=0.2) as server:
        cable = Cable(int(server.url.rpartition(":")[2]))
        plant = hwsim.OpcuaPlant(cable.url, security="none")
        odd = Drive(lambda: cable.stall() or {"velocity": 3.0})
        with pytest.raises(hwsim.Aborted, match=r"it is not known whether the machine is safe"):
            hwsim.run(plant, odd, live=live())
        assert not plant._link.alive  # though nothing was closed at the other end
        cable.flow()
        until = time.monotonic() + 5
        while not cable.resets and time.monotonic() < until:
            time.sleep(0.01)
        assert cable.resets == 1  # what this end had not sent is gone; what had left it meets the latch
        assert not any(command.get("velocity") == 3.0 for _, command in axis.told)
        short = Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, short, live=live()).outcome.aborted.values.tolist() == [0.0]
        plant.close()
        cable.close()


@pytest.mark.parametrize(
    ("error", "kind", "said"),
    [
        (ua.uaerrors.BadSessionClosed(), ConnectionError, "the link to .* was cut"),
        (TimeoutError(), ConnectionError, "the link to .* was cut"),
        (ConnectionError("gone"), ConnectionError, "the link to .* was cut"),
        (ua.uaerrors.BadTypeMismatch(), ValueError, "did not take a list to write: BadTypeMismatch: "),
        (ua.uaerrors.BadOutOfRange(), ValueError, "did not take a list to write: BadOutOfRange: "),
        (ua.uaerrors.BadNotWritable(), ValueError, "did not take a list to write: BadNotWritable: "),
        (ua.uaerrors.BadEncodingError(), ValueError, "did not take a list to write: BadEncodingError: "),
        (ua.UaError("no such type"), ValueError, "did not take a list to write: UaError: no such type"),
        (ua.uaerrors.BadUserAccessDenied(), PermissionError, "to write: BadUserAccessDenied: "),
    ],
)
def test_what_is_not_taken_is_no_cut_link(axis, monkeypatch, error, kind, said):
    with served(axis) as server:
        plant = behind(server)
        link = plant._link

        async def refused(parameters):
            raise error

        monkeypatch.setattr(link.client.uaclient.session, "write", refused)
        with pytest.raises(kind, match=said) as told:
            link.loop.run(link.write(writes({})))
        assert type(told.value) is kind and link.alive == (kind is not ConnectionError)
        plant.close()


def test_a_list_that_the_machine_does_not_take_makes_it_safe_over_the_same_session(axis):
    with served(axis) as server:
        plant = behind(server)
        session, given = plant._link.client.uaclient.session, []
        write = session.write

        async def once(parameters):
            given.append(parameters)
            if len(given) == 4:
                raise ua.uaerrors.BadTypeMismatch
            return await write(parameters)

        session.write = once
        with pytest.raises(hwsim.Aborted, match=r"safe: ValueError: .* did not take .*: BadTypeMismatch"):
            hwsim.run(plant, Drive(), live=live())
        assert axis.told[-1][1] == {"velocity": 0.0, "stop": 1.0}
        plant.close()


class Unlucky(Drive):
    """Its machine is switched off within its first part."""

    identity = "unlucky"  # for the journal, which would walk through the server
    switch: ClassVar = []

    def step(self, **measured):
        if self.switch and self.steps == 5:
            self.switch.pop()()
        return super().step(**measured)


def test_after_a_lost_server_the_journal_goes_on_with_the_next_part(tmp_path):
    axis, run = Axis(), {"parts": 3, "journal": tmp_path / "shift.db"}
    server = served(axis)
    url, plant = server.url, behind(server)
    Unlucky.switch.append(server.stop)
    with pytest.raises(hwsim.Aborted, match=r"the link to .* was cut"):
        hwsim.run(plant, Unlucky(), live=live(), **run)
    with hwsim.serve(axis, url, security="none") as again:
        log = hwsim.run(plant, Unlucky(), live=live(), **run)
        assert again.state["parts"] == 2
    assert log.outcome.aborted.values.tolist() == [1.0, 0.0, 0.0] and len(set(log.outcome.begun.values)) == 3
    plant.close()


def watched(**options):
    control, forwarding = live(**options), Forwarding({"stop": 1.0}, 10**8, 0)
    return Watch(control, 0.02, forwarding, Pauses(None, control, 0)), forwarding, control


def sample(**changes):
    plain = {"reading": {}, "sequence": 5, "time": 0.0, "event": 0, "done": False, "part": 1, "aborts": 0,
             "aborted": "", "stops": 0, "paused": False, "at": 0, "spread": 0.0, "bad": 0}  # fmt: skip
    return ReadSample(**{**plain, **changes})


@pytest.mark.parametrize(
    ("next_one", "reason"),
    [
        (sample(at=400_000_000), "measurements are stale: no new sample for more than 0.3 s"),
        (sample(sequence=4), "the machine was restarted: the sequence of its samples went back"),
        (sample(sequence=6, spread=0.4), "measurements are stale: those of one list are 0.4 s apart"),
        (sample(aborts=1, aborted="no heartbeat"), "the machine made itself safe: no heartbeat"),
        (sample(part=2), "the machine made itself safe: part 2 was begun on it"),
        (sample(sequence=6, at=400_000_000), None),
        (sample(at=200_000_000), None),
    ],
)
def test_samples_that_tell_of_a_fault(next_one, reason):
    watch, forwarding, _ = watched(stale=0.3)
    watch.look(sample())
    watch.look(next_one)
    forwarding.poll(1)
    assert (forwarding.trip.reason if forwarding.trip else None) == reason


@pytest.mark.parametrize(
    ("seen", "now", "trips"), [(False, 201, True), (False, 200, False), (True, 900, False)]
)
def test_the_last_sample_ages_also_while_none_arrives(seen, now, trips):
    watch, forwarding, _ = watched(stale=0.2)
    watch.age(900_000_000)  # before the first one
    watch.look(sample(done=seen))
    watch.age(now * 1_000_000)
    forwarding.renew(now * 1_000_000)
    assert bool(forwarding.poll(now * 1_000_000)) is trips
    if trips:
        assert forwarding.trip.reason == "measurements are stale: no new sample for more than 0.2 s"


class Still(Axis):
    """Its place does not change."""

    def start(self, rng):
        part = super().start(rng)
        step = part.step
        part.step = lambda command, ticks: {**step(command, ticks), "place": 5.0}
        return part


def test_stuck_readings_abort_while_the_machine_is_commanded():
    axis = Still(length=60.0)
    with (
        served(axis) as server,
        pytest.raises(hwsim.Aborted, match="place is stuck: 6 equal readings in a row"),
    ):
        hwsim.run(behind(server), Drive(), live=live(stuck={"place": 6}))
    assert axis.told[-1][1] == axis.safe


def test_refusals_before_anything_moves(axis):
    with served(axis) as server:
        plant = behind(server)
        for wrong, said in (
            (
                {"live": live(safe={"velocity": 20.0})},
                r"safe\['velocity'\] must be in \[-10, 10\] \(mm/s\); got 20",
            ),
            (
                {"live": live(safe={"feed": 1.0})},
                "safe must be of commands that the plant accepts: velocity, stop",
            ),
            (
                {"live": live(deadline=1e-6)},
                r"deadline must be > 3 round trips of .* ms to opc.tcp.*; got 1e-06",
            ),
            ({}, "live must be given: the machine at opc.tcp.* keeps its own time"),
        ):
            with pytest.raises(ValueError, match=said):
                hwsim.run(plant, Drive(), **wrong)
        assert hwsim.check(plant, Drive()) and server.state["part"] == 0 and axis.told == []
    with (
        pytest.raises(ValueError, match=r"live must be None: .* is in lockstep"),
        served(axis, speed=None) as server,
    ):
        hwsim.run(behind(server), Drive(), live=live())


def test_what_the_machine_s_own_watchdog_does_otherwise_is_told(axis):
    with served(axis) as server:
        plant = behind(server)
        assert plant.safe == axis.safe
        with pytest.warns(UserWarning, match=r"deadline is longer than .* watchdog, 0.5 s, .*; got 2"):
            hwsim.run(plant, Drive(lambda: {"stop": 1.0}, at=3), live=live(deadline=2.0))
        said = r"safe differs from .* own safe command, {'velocity': 0.0, 'stop': 1.0}; got {'velocity': 0.0}"
        with pytest.warns(UserWarning, match=said):
            hwsim.run(plant, Drive(lambda: {"stop": 1.0}, at=3), live=live(safe={"velocity": 0.0}))
        plant.close()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"speed": 0.0}, "speed must be > 0; got 0.0"),
        (
            {"timeout": 0.001, "speed": 2.0},
            r"timeout must be >= a tick of the plant, 0.005 s at this speed \(s\); got 0.001",
        ),
        ({"timeout": -1.0}, r"timeout must be > 0 \(s\); got -1.0"),
        ({"security": None}, "security must be a folder of certificates, which `hwsim keys FOLDER` makes"),
        ({"users": {"operator": "x"}}, 'users must be None with security="none"'),
        (
            {"listen": "all"},
            'security must be a folder of certificates but on a loopback address; got "none" on all',
        ),
        ({"controller": Drive(), "speed": None}, "controller must be None in lockstep"),
    ],
)
def test_wrong_arguments_of_serve(change, said):
    with pytest.raises(ValueError, match=said):
        served(Axis(), **change)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://127.0.0.1", "url must be such as opc.tcp://127.0.0.1:4840; got 'http://127.0.0.1'"),
        ("opc.tcp://127.0.0.1:99999", "url must be such as"),
        ("opc.tcp://user:secret@127.0.0.1", "url must be such as"),
        ("opc.tcp://10.0.0.1:4840", 'but on a loopback address; got "none" on 10.0.0.1'),
        ("opc.tcp://0.0.0.0:4840", 'but on a loopback address; got "none" on 0.0.0.0'),
    ],
)
def test_wrong_addresses(url, said):
    with pytest.raises(ValueError, match=said):
        hwsim.serve(Axis(), url, security="none")


def test_a_plant_without_a_safe_command_is_served_in_lockstep_only():
    class Unsafe(Axis):
        safe = None

    with pytest.raises(
        ValueError, match="speed must be None, lockstep, for a Unsafe: it has no safe command"
    ):
        served(Unsafe())


def test_two_servers_at_one_port(axis):
    with (
        served(axis) as server,
        pytest.raises(OSError, match=f"{server.url} cannot be served: Address already in use"),
    ):
        hwsim.serve(axis, server.url, security="none")


def test_no_server():
    with pytest.raises(ConnectionError, match=r"no session at opc.tcp://127.0.0.1:9"):
        hwsim.OpcuaPlant("opc.tcp://127.0.0.1:9", security="none")


def test_a_command_that_ends_the_part_is_told(axis):
    with served(axis) as server:
        log = hwsim.run(behind(server), Drive(lambda: {"stop": 1.0}, at=4), parts=2, live=live())
        assert server.state["parts"] == 2
    assert log.outcome.stopped.values.tolist() == [1.0, 1.0] == (1.0 - log.outcome.aborted.values).tolist()


def test_shadow_writes_nothing_and_logs_both_commands():
    axis = Axis(length=0.2)
    with served(axis, controller=Drive()) as server:
        log = hwsim.run(behind(server), Drive(), live=hwsim.Live(shadow=True))
        assert server.state["writes"] == 0 and server.state["operator"] == ""
        with pytest.raises(ValueError, match=r"live must be in shadow, .*has its own control"):
            hwsim.run(behind(server), Drive(), live=live())
        assert server.state["writes"] == 0
    table = log["controller"]
    assert {"velocity_command", "velocity_actual", "stop_actual"} <= set(table)
    assert (
        table.velocity_actual.attrs["units"] == "mm/s" and np.isfinite(table.velocity_actual.values[1:]).all()
    )
    assert log.outcome.aborted.values.tolist() == [0.0] and log.outcome.stopped.values.tolist() == [0.0]
    assert hwsim.run(hwsim.Recording(log), Drive()).outcome.same.values.tolist() == [1.0]
    assert all(not command.get("stop") for _, command in axis.told)


def test_a_shadow_says_that_it_waits_and_a_stand_without_its_own_control_is_told(axis):
    control, told = hwsim.Live(shadow=True), []

    def progress(share, text):
        told.append(text)
        control.abort("nobody begins")

    waiting = "waiting for the machine to begin a part; it has no control of its own, so another client must"
    with served(axis) as server, pytest.raises(hwsim.Aborted, match="no part was begun: nobody begins"):
        hwsim.run(behind(server), Drive(), live=control, progress=progress)
    assert told == [f"{waiting} begin one"]


def test_a_shadow_tells_commands_that_the_machine_would_refuse():
    with served(Axis(length=0.2), controller=Drive()) as server:
        said = r"the controller would be refused: velocity must be in \[-10, 10\] \(mm/s\); got 50"
        with pytest.warns(UserWarning, match=said):
            odd = Drive(lambda: {"velocity": 50.0}, at=2)
            log = hwsim.run(behind(server), odd, live=hwsim.Live(shadow=True))
    assert log.outcome.aborted.values.tolist() == [0.0] and 50.0 in log["controller"].velocity_command


def test_other_clients_see_no_command_of_the_part_before(axis):
    async def shown(url):
        async with Client(url) as client:
            space = await client.get_namespace_index(URI)
            await client.get_node(ua.NodeId("Axis", space)).call_method(
                ua.NodeId("Axis.Start", space), ua.Variant(2, ua.VariantType.Int64), ""
            )
            node = client.get_node(ua.NodeId("Axis.Commands.stop", space))
            while (value := await node.read_value()) == 1.0:
                await asyncio.sleep(0.01)
            return value

    with served(axis, timeout=60.0) as server:
        plant = behind(server)
        hwsim.run(plant, Drive(lambda: {"stop": 1.0}, at=3), live=live())
        plant.close()
        assert np.isnan(asyncio.run(asyncio.wait_for(shown(server.url), 20.0)))


def test_the_deadline_is_compared_with_the_link_before_the_first_part_only(axis, monkeypatch):
    seen, check = [], _begin.check_deadline
    monkeypatch.setattr(_begin, "check_deadline", lambda *given: seen.append(check(*given)))
    with served(axis) as server:
        control = live()
        for parts in (1, 2):
            hwsim.run(behind(server), Drive(lambda: {"stop": 1.0}, at=2), parts=parts, live=control)
            assert len(seen) == parts


def test_a_period_that_is_no_number_of_ticks_is_answered_by_one_that_is(axis):
    with served(axis) as server:
        plant = behind(server)
        told = str(hwsim.check(plant, Drive(period=0.025)))
        assert told.endswith("no whole number of the plant's ticks of 0.01 s; a period of 0.02 s would fit")
        assert str(hwsim.check(plant, Drive())) == "Drive and OpcuaPlant fit"
        plant.close()
    with served(axis, controller=Drive()) as server:
        plant = behind(server)
        assert str(hwsim.check(plant, Drive())).splitlines()[1:] == [
            "- the machine is listened to only, hwsim.Live(shadow=True): it has its own control"
        ]
        assert str(hwsim.check(plant.listening(), Drive())) == "Drive and OpcuaPlant fit"
        plant.close()


def test_a_quality_that_is_not_good_is_nan_and_counted():
    poor = ua.DataValue(ua.Variant(1.0), StatusCode=ua.StatusCode(ua.StatusCodes.UncertainLastUsableValue))
    assert np.isnan(read_number(poor)) and read_number(ua.DataValue(ua.Variant(1.0))) == 1.0
    remote = Remote(None, 2, "Axis")
    plain = [ua.DataValue(ua.Variant(value)) for value in (7, 0.5, 0, False, 1, 0, "", 0, False)]
    seen = remote.seen({"place": "Monitoring.place"}, [poor, *plain], 11)
    assert seen.bad == 1 and seen.sequence == 7 and seen.at == 11 and np.isnan(seen.reading["place"])
