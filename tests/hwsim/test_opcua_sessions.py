"""A session ends with its connection, whatever it was doing, and the machine goes on to look after itself."""

import asyncio
import socket
import struct
import threading
import time

import pytest
from asyncua import Client, ua
from opcua_fakes import Axis, Cable, Drive, live, served

import hwsim
from hwsim.opcua import _house
from hwsim.opcua._link import writes
from hwsim.opcua._space import URI

AT_ONCE = struct.pack("ii", 1, 0)  # SO_LINGER: the end of a connection is a reset
UINT, INT = ua.VariantType.UInt32, ua.VariantType.Int64


def until(happened, seconds=5.0):
    """Whether something happens; the limit is that of a test that has failed."""
    last = time.monotonic() + seconds
    while not (there := happened()) and time.monotonic() < last:
        time.sleep(0.01)
    return there


@pytest.fixture
def patient(monkeypatch):
    """A server that takes no session for gone that is only silent."""
    monkeypatch.setattr(_house, "_GONE", 600_000.0)


@pytest.fixture
def wire():
    """Both ends of a connection over a cable, and the cable."""
    with socket.create_server(("127.0.0.1", 0)) as door:
        cable = Cable(door.getsockname()[1])
        near = socket.create_connection(("127.0.0.1", int(cable.url.rpartition(":")[2])))
        far, _ = door.accept()
        near.sendall(b"there")
        assert far.recv(9) == b"there"
        for end in (near, far):
            end.settimeout(5.0)
        yield near, far, cable
        cable.close()
        near.close()
        far.close()


def test_a_reset_of_a_client_ends_the_other_side_of_a_cable(wire):
    near, far, cable = wire
    near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)
    near.close()
    assert far.recv(9) == b"" and until(lambda: cable.resets == 1)


def test_an_end_ends_the_other_side_of_a_cable(wire):
    near, far, cable = wire
    far.close()
    assert near.recv(9) == b"" and cable.resets == 0


def test_a_cut_ends_both_sides_though_the_client_resets_meanwhile(wire):
    near, far, cable = wire
    near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)
    first, *others = cable._open

    class Late:
        """The first socket that is cut: the client is served before the next one."""

        def shutdown(self, how):
            near.close()
            assert until(lambda: cable.resets == 1)
            first.shutdown(how)

        def close(self):
            first.close()

    cable._open = [Late(), *others]
    cable.cut()
    assert far.recv(9) == b""


def test_a_closed_cable_takes_no_connection():
    with socket.create_server(("127.0.0.1", 0)) as door:
        cable = Cable(door.getsockname()[1])
        cable.close()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", int(cable.url.rpartition(":")[2])), 5.0)


def test_an_operator_whose_connection_was_reset_holds_no_machine(patient):
    with served(Axis(length=60.0), timeout=0.2) as server:
        cable = Cable(int(server.url.rpartition(":")[2]))
        plant = hwsim.OpcuaPlant(cable.url, security="none")
        link = plant._link
        link.loop.run(plant._remote.start(1, "1"))
        assert server.state["operator"]
        link.loop.loop.call_soon_threadsafe(link.reset)
        assert until(lambda: not server.state["operator"])
        assert until(lambda: server.state["aborts"] == 1)
        short = Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, short, live=live()).outcome.stopped.values.tolist() == [1.0]
        plant.close()
        cable.close()


class Held(Axis):
    """The thread of the machine is held where it begins a part, or takes 3 mm/s."""

    def __init__(self, where):
        super().__init__(length=60.0)
        self.__dict__.update(where=where, asked=threading.Event(), go=threading.Event())

    def start(self, rng):
        if self.where == "start" and threading.current_thread().name == "hwsim machine":
            self.wait()
        part = super().start(rng)
        step = part.step

        def held(command, ticks):
            if self.where == "take" and command.get("velocity") == 3.0:
                self.wait()
            return step(command, ticks)

        part.step = held
        return part

    def wait(self):
        self.asked.set()
        assert self.go.wait(10.0)


def left_while_held(server, axis, plant, work):
    """Reset the connection while the machine does what was asked over it."""
    link = plant._link
    asyncio.run_coroutine_threadsafe(work, link.loop.loop)
    assert axis.asked.wait(10.0)
    link.loop.loop.call_soon_threadsafe(link.reset)
    assert until(lambda: not server.state["operator"])
    axis.go.set()


def test_a_machine_whose_operator_left_within_a_command_makes_itself_safe():
    axis = Held("take")
    with served(axis, timeout=0.2) as server:
        plant = hwsim.OpcuaPlant(server.url, security="none")
        remote, link = plant._remote, plant._link
        link.loop.run(remote.start(1, "1"))
        command = link.write(writes(remote.written({"velocity": 3.0}, 1)))
        left_while_held(server, axis, plant, command)
        assert until(lambda: server.state["aborts"] == 1)
        assert server.state["aborted"] == "no heartbeat for more than 0.2 s"
        assert [told for _, told in axis.told] == [{"velocity": 3.0}, axis.safe]
        short = Drive(lambda: {"stop": 1.0}, at=3)
        assert hwsim.run(plant, short, live=live()).outcome.aborted.values.tolist() == [0.0]
        plant.close()


def test_a_part_whose_starter_left_before_the_answer_is_kept_alive_by_nobody_else():
    axis = Held("start")
    with served(axis, timeout=0.5) as server:
        plant, other = (hwsim.OpcuaPlant(server.url, security="none") for _ in range(2))
        left_while_held(server, axis, plant, plant._remote.start(1, "1"))
        assert until(lambda: server.state["part"] == 1)
        beat = writes(other._remote.written({}, 1))
        (state,) = other._link.loop.run(other._link.write(beat))
        assert state.value == ua.StatusCodes.BadUserAccessDenied
        assert until(lambda: server.state["aborts"] == 1)
        plant.close()
        other.close()


class Watched:
    """What a subscription tells."""

    def datachange_notification(self, node, value, data): ...


def test_subscriptions_do_not_keep_the_session_of_a_lost_connection(patient):
    async def operate(server):
        client = Client(server.url)
        await client.connect()
        space = await client.get_namespace_index(URI)
        watched = await client.create_subscription(100, Watched())
        await watched.subscribe_data_change(client.get_node(ua.NodeId("Axis.Part.time", space)))
        await client.get_node(ua.NodeId("Axis.Commands.heartbeat", space)).write_value(ua.Variant(1, UINT))
        assert server.state["operator"]
        client.uaclient.protocol.transport.abort()
        return await asyncio.to_thread(until, lambda: not server.state["operator"])

    with served(Axis(), timeout=0.2) as server:
        assert asyncio.run(operate(server))


def test_a_second_connection_does_not_take_over_a_session():
    async def operate(url):
        async with Client(url) as client:
            other = Client(url)
            await other.connect_socket()
            await other.send_hello()
            await other.open_secure_channel()
            other.uaclient.protocol.authentication_token = client.uaclient.protocol.authentication_token
            asked = ua.ActivateSessionParameters()
            asked.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
            with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
                await other.uaclient.activate_session(asked)
            other.disconnect_socket()
            space = await client.get_namespace_index(URI)
            start = ua.NodeId("Axis.Start", space), ua.Variant(1, INT), "7"
            return await client.get_node(ua.NodeId("Axis", space)).call_method(*start)

    with served(Axis(), timeout=0.2) as server:
        assert asyncio.run(operate(server.url)) == ""
