"""The link over TCP on this computer: no fixed port, every wait bounded."""

import socket
import struct
from threading import Thread
from time import monotonic, sleep

import numpy as np
import pytest
from hwsim_inside import TcpLink, TcpListener, packed

from hwsim import Courier, Link

PATIENCE = 20.0  # s; nothing here takes long, but the machine may be busy


@pytest.fixture
def listener():
    with TcpListener() as each:
        yield each


@pytest.fixture
def ends(listener):
    with TcpLink.connect(listener.address) as near, listener.accept(PATIENCE) as far:
        yield near, far


@pytest.fixture
def raw(listener):
    """A link and the naked socket at its other end."""
    with socket.create_connection(listener.address) as peer, listener.accept(PATIENCE) as link:
        yield link, peer


def collect(link, number):
    """Receive so many messages, or fewer when the link is closed."""
    got, deadline = [], monotonic() + PATIENCE
    while len(got) < number and monotonic() < deadline:
        if not link.wait(PATIENCE):
            break
        got += link.receive()
        if link.closed:
            break
    return got


def test_it_is_a_link(ends):
    near, far = ends
    assert isinstance(near, Link)
    near.advance(1e9)
    assert near.receive() == [] and not near.wait(0.0)
    for k in range(300):
        near.send(bytes([k % 256]) * k)
    assert collect(far, 300) == [bytes([k % 256]) * k for k in range(300)]
    far.send(b"and back")
    assert collect(near, 1) == [b"and back"]
    assert repr(near) == "TcpLink(open)"


def test_messages_in_pieces(raw):
    link, peer = raw
    stream = packed(b"first") + packed(b"") + packed(b"third")
    for byte in stream[:-1]:
        peer.sendall(bytes([byte]))
    assert collect(link, 2) == [b"first", b""]
    assert not link.closed
    peer.sendall(stream[-1:])
    assert collect(link, 1) == [b"third"]


def test_large_messages_both_ways_at_once(ends):
    """More than the network holds: neither side may block."""
    sizes = (9_000_000, 1, 7_000_000)
    messages = [np.random.default_rng(k).bytes(size) for k, size in enumerate(sizes)]
    for end in ends:
        for message in messages:
            end.send(message)
    assert ends[0].unsent > 0
    arrived = [False, False]

    def work(k):
        """Collect what the other end sent, then send what of the own is left."""
        got, deadline = collect(ends[k], len(messages)), monotonic() + PATIENCE
        arrived[k] = got == messages
        while ends[k].unsent and monotonic() < deadline:
            ends[k].receive()
            sleep(1e-3)

    worker = Thread(target=work, args=(1,))
    worker.start()
    work(0)
    worker.join(2 * PATIENCE)
    assert arrived == [True, True] and [end.unsent for end in ends] == [0, 0]


def test_what_was_sent_before_closing_arrives(ends):
    near, far = ends
    near.send(b"last words")
    near.close()
    assert collect(far, 2) == [b"last words"]
    assert far.closed and far.reason == "the peer closed it"
    assert near.reason == "it was closed here"
    for end in ends:
        with pytest.raises(ConnectionError, match="the link is closed: "):
            end.send(b"more")
        assert end.receive() == [] and end.wait(0.0)


def test_what_had_arrived_is_not_lost_when_sending_fails(raw):
    link, peer = raw
    peer.sendall(packed(b"last words"))
    peer.close()
    deadline = monotonic() + PATIENCE
    while not link.closed and monotonic() < deadline:
        link.send(b"anybody there?")
    assert link.closed and link.receive() == [b"last words"]


def test_a_peer_that_vanishes_within_a_message(raw):
    link, peer = raw
    peer.sendall(packed(b"whole") + packed(b"half")[:8])
    peer.close()
    assert collect(link, 2) == [b"whole"]
    assert link.reason == "the peer closed it within a message"


def test_a_peer_that_resets(raw):
    link, peer = raw
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # close with a reset
    peer.close()
    assert link.wait(PATIENCE) and link.receive() == []
    assert link.reason.startswith("the peer vanished (")


def test_a_peer_that_does_not_read_blocks_nobody(raw):
    link, peer = raw
    for _ in range(40):
        link.send(b"x" * 1_000_000)
    assert link.unsent > 0
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()
    assert link.wait(PATIENCE) and link.closed


@pytest.mark.parametrize(
    ("stream", "reason"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "prefix of a message must begin with c35a; got 4745"),
        (struct.pack("!HI", 0xC35A, 1001), "a message must be of at most 1000 bytes; got one of 1001"),
        (
            struct.pack("!HI", 0xC35A, 2**32 - 1),
            "a message must be of at most 1000 bytes; got one of 4294967295",
        ),
    ],
)
def test_what_is_refused(stream, reason):
    with TcpListener(largest=1000) as listener, socket.create_connection(listener.address) as peer:
        link = listener.accept(PATIENCE)
        peer.sendall(packed(b"good") + stream)
        assert collect(link, 2) == [b"good"]
        assert link.reason == reason
        with pytest.raises(ConnectionError, match="the link is closed: "):
            link.send(b"more")


def test_what_is_too_large_is_not_sent(listener):
    with TcpLink.connect(listener.address, largest=10) as link:
        with pytest.raises(ValueError, match="message must be of at most 10 bytes; got 11"):
            link.send(b"x" * 11)
        assert not link.closed and link.unsent == 0


def test_nobody_there(listener):
    with pytest.raises(TimeoutError):
        listener.accept(0.01)
    address = listener.address
    listener.close()
    with pytest.raises(OSError, match="refused"):
        TcpLink.connect(address)


def host(listener, lives, got, number):
    """A host that takes some records from each connection and breaks it off, again and again."""
    courier, begun = Courier(), monotonic()
    for life in [*lives, number]:
        link = listener.accept(PATIENCE)
        courier.attach(link)
        enough = len(got) + life
        while not link.closed and len(got) < min(enough, number) and monotonic() - begun < PATIENCE:
            link.wait(0.05)
            courier.advance(monotonic() - begun)
            got += courier.receive()
        if len(got) == number:
            # until the machine has its acknowledgement and leaves
            while not link.closed and monotonic() - begun < PATIENCE:
                link.wait(0.05)
                courier.advance(monotonic() - begun)
        link.close()


def test_no_record_is_lost_when_the_link_breaks(listener):
    number, got = 2000, []
    worker = Thread(target=host, args=(listener, (5, 0, 300, 64, 1), got, number), daemon=True)
    worker.start()
    machine, begun, links = Courier(), monotonic(), 0
    for k in range(number):
        machine.send(k.to_bytes(2, "big") * 50)
    while machine.waiting and monotonic() - begun < PATIENCE:
        link = TcpLink.connect(listener.address)
        links += 1
        machine.attach(link)
        while machine.waiting and not link.closed and monotonic() - begun < PATIENCE:
            machine.advance(monotonic() - begun)
            link.wait(0.05)
        link.close()
    worker.join(PATIENCE)
    assert not worker.is_alive() and links == 6
    assert got == [k.to_bytes(2, "big") * 50 for k in range(number)] and machine.waiting == 0


def test_a_network_that_takes_nothing_is_not_filled(raw):
    link, _ = raw
    machine = Courier(link)
    for _ in range(100):
        machine.send(b"x" * 1_000_000)
    machine.advance(0.0)
    full = machine.unsent
    assert 0 < full < 65_000_000
    for k in range(50):
        machine.advance(float(k))
    assert machine.unsent <= full
