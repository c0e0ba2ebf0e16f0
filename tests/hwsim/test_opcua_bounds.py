"""What a peer may send: heads are looked at before anything parses them, and a flood does not hurt others."""

import contextlib
import socket
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st
from opcua_fakes import ANY, Axis, Drive, live

import hwsim
from hwsim.opcua._bounds import CHUNK, MalformedError, messages

pytestmark = pytest.mark.usefixtures("nothing_collected")


def message(kind, body, chunk=b"F"):
    return kind + chunk + (8 + len(body)).to_bytes(4, "little") + body


def hello(url):
    body = b"".join(number.to_bytes(4, "little") for number in (0, 65535, 65535, 0, 0, len(url)))
    return message(b"HEL", body + url.encode())


BODIES = st.binary(min_size=4, max_size=300)
SERIES = st.lists(
    st.tuples(st.sampled_from([b"OPN", b"MSG", b"CLO"]), BODIES).map(lambda each: message(*each)), max_size=6
).map(lambda rest: [message(b"HEL", b"\0" * 24), *rest])


@given(SERIES, st.data())
def test_messages_are_taken_whole_however_they_arrive(series, data):
    sent = b"".join(series)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(sent)), max_size=8)))
    received, taken = bytearray(), []
    for begin, end in zip([0, *cuts], [*cuts, len(sent)], strict=True):
        received += sent[begin:end]
        taken += messages(received, not taken)
    assert taken == series and not received


@given(st.binary(max_size=200), st.booleans())
def test_anything_is_messages_a_begin_or_malformed(sent, first):
    received = bytearray(sent)
    with contextlib.suppress(MalformedError):
        taken = b"".join(messages(received, first))
        assert taken + received == sent


@pytest.mark.parametrize(
    ("sent", "first"),
    [
        (message(b"OPN", b"\0" * 8), True),
        (message(b"HEL", b"\0" * 8), False),
        (message(b"NON", b"\0" * 8), False),
        (message(b"MSG", b"\0" * 8, b"X"), False),
        (message(b"OPN", b"\0" * 8, b"C"), False),
        (b"MSGF" + (7).to_bytes(4, "little"), False),
        (b"MSGF" + (11).to_bytes(4, "little"), False),
        (b"MSGF" + (CHUNK + 1).to_bytes(4, "little"), False),
        (b"MSGF" + (2**32 - 1).to_bytes(4, "little"), False),
    ],
)
def test_a_malformed_head_is_told_before_the_body_is_there(sent, first):
    with pytest.raises(MalformedError, match="a message begins with"):
        list(messages(bytearray(sent), first))


def attacked(server, begin, junk):
    """Send junk until the server cuts the connection; return the bytes that it took."""
    host, port = server.url.removeprefix("opc.tcp://").split(":")
    sent = 0
    with socket.create_connection((host, int(port)), 5) as peer, contextlib.suppress(ConnectionError):
        peer.sendall(begin)
        while sent < 10**8:
            peer.sendall(junk)
            sent += len(junk)
    return sent


def test_a_flood_is_cut_and_a_rightful_client_does_not_notice():
    over, found = [], {}

    class Through(Drive):
        """Ends its part after the flood."""

        def step(self, **measured):
            return {"stop": 1.0} if over else super().step(**measured)

        def __deepcopy__(self, memo):
            return Through(period=self.period)

    with hwsim.serve(Axis(length=60.0), ANY, security="none") as server:
        plant = hwsim.OpcuaPlant(server.url, security="none")

        def run():
            found["log"] = hwsim.run(plant, Through(period=0.05), live=live(deadline=0.5))

        rightful = threading.Thread(target=run)
        rightful.start()
        while server.state["part"] == 0 and rightful.is_alive():
            time.sleep(0.01)
        chunk = message(b"MSG", b"\0" * 60_000, b"C")
        for begin, junk in [
            (hello(server.url), b"A" * 65536),
            (hello(server.url), chunk),
            (b"MSGF" + (2**31 - 1).to_bytes(4, "little"), b"A" * 65536),
            (b"", hello(server.url) * 100),
        ]:
            assert attacked(server, begin, junk) < 2 * 10**7  # what the sockets hold
        over.append(True)
        rightful.join()
        plant.close()
    outcome = found["log"].outcome
    assert (outcome.aborted.values.tolist(), outcome.stopped.values.tolist()) == ([0.0], [1.0])


def test_a_peer_that_is_gone_without_a_word_is_found_out():
    """Its session ends within 10 s; its connection would stay, and after 64 of them nobody could connect."""
    with hwsim.serve(Axis(), ANY, security="none") as server:
        host, port = server.url.removeprefix("opc.tcp://").split(":")
        with socket.create_connection((host, int(port)), 5) as peer:
            peer.sendall(hello(server.url))
            assert peer.recv(8)[:3] == b"ACK"
            (taken,) = server._house._server.bserver.clients
            connection = taken.transport.get_extra_info("socket")
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
            idle, pause, count, owed = (
                connection.getsockopt(socket.IPPROTO_TCP, getattr(socket, name))
                for name in ("TCP_KEEPIDLE", "TCP_KEEPINTVL", "TCP_KEEPCNT", "TCP_USER_TIMEOUT")
            )
            assert idle + pause * count <= 11 and owed <= 11_000
