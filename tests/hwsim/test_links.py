"""Messages in a stream, a link in memory, and records that survive both."""

import copy
import struct
from collections import deque
from itertools import pairwise

import numpy as np
import pytest
from hwsim_inside import Unpacker, backlogs, packed
from hypothesis import given, settings
from hypothesis import strategies as st

from hwsim import Courier, Link, QueueLink

MESSAGES = st.lists(st.binary(max_size=40), max_size=8)


def pieces(stream, cuts):
    at = sorted({0, len(stream), *(cut % (len(stream) + 1) for cut in cuts)})
    return [stream[begin:end] for begin, end in pairwise(at)]


@given(MESSAGES, st.lists(st.integers(0, 10**6), max_size=30))
def test_any_split_of_the_stream_gives_the_same_messages(messages, cuts):
    unpacker, stream = Unpacker(), b"".join(packed(message) for message in messages)
    assert [each for piece in pieces(stream, cuts) for each in unpacker.feed(piece)] == messages
    assert not unpacker.partial and unpacker.fault() == ""


@given(MESSAGES)
def test_byte_by_byte(messages):
    unpacker, seen = Unpacker(), []
    for byte in b"".join(packed(message) for message in messages):
        seen += unpacker.feed(bytes([byte]))
    assert seen == messages


@given(MESSAGES, st.binary(min_size=6, max_size=30), st.integers(1, 12))
def test_a_broken_prefix_is_refused_after_what_was_whole(messages, junk, size):
    junk = b"\x00" + junk[1:]
    stream = b"".join(packed(message) for message in messages) + junk
    unpacker = Unpacker()
    assert [
        each for k in range(0, len(stream), size) for each in unpacker.feed(stream[k : k + size])
    ] == messages
    assert unpacker.fault().startswith("prefix of a message must begin with c35a; got 00")
    assert unpacker.feed(packed(b"more")) == []


def test_what_is_too_large_is_refused_both_ways():
    with pytest.raises(ValueError, match="message must be of at most 10 bytes; got 11"):
        packed(b"x" * 11, 10)
    unpacker = Unpacker(10)
    assert unpacker.feed(packed(b"x" * 10) + packed(b"x" * 11)) == [b"x" * 10]
    assert unpacker.fault() == "a message must be of at most 10 bytes; got one of 11"


def test_the_prefix_is_that_of_the_page():
    assert packed(b"abc") == b"\xc3\x5a\x00\x00\x00\x03abc"
    with pytest.raises(TypeError, match="message must be bytes; got 'abc'"):
        packed("abc")


@given(
    st.lists(st.tuples(st.floats(0.0, 0.5), st.sampled_from(["send", "receive"])), max_size=40),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.3),
    st.integers(0, 2**32),
)
@settings(deadline=None)
def test_messages_arrive_late_in_order_and_once(steps, latency, jitter, seed):
    near, far = QueueLink(latency, jitter).start(seed)
    now, sent, got = 0.0, [], []
    for passed, what in steps:
        now += passed
        near.advance(now)
        far.advance(now)
        if what == "send":
            near.send(struct.pack("d", now))
            sent.append(now)
        else:
            got += [(struct.unpack("d", each)[0], now) for each in far.receive()]
            missing = sent[len(got) :]
            # none stays longer than it may
            assert all(when + latency + jitter > now - 2e-9 for when in missing)
    assert [when for when, _ in got] == sent[: len(got)]
    assert all(arrival >= when + latency - 2e-9 for when, arrival in got)


def arrived(loss, seed=4, number=4000):
    near, far = QueueLink(loss=loss).start(seed)
    for k in range(number):
        near.send(k.to_bytes(4, "big"))
    return [int.from_bytes(each, "big") for each in far.receive()]


def test_a_share_is_lost():
    assert arrived(0.0) == list(range(4000)) and arrived(1.0) == []
    few, many = arrived(0.1), arrived(0.3)
    assert abs(len(few) - 3600) < 4 * (4000 * 0.09) ** 0.5
    assert set(many) < set(few) and few == sorted(few)  # the same draws: a larger loss only adds to it
    assert few == arrived(0.1) != arrived(0.1, seed=5)


def test_both_ways_draw_for_themselves():
    quiet, busy = QueueLink(loss=0.5).start(1), QueueLink(loss=0.5).start(1)
    for k in range(50):
        quiet[0].send(bytes([k]))
        busy[0].send(bytes([k]))
        busy[1].send(bytes([k]))
    assert quiet[1].receive() == busy[1].receive()


def test_a_closed_link_loses_what_is_under_way():
    near, far = QueueLink(latency=0.1).start()
    near.send(b"never seen")
    far.close()
    assert near.closed and far.closed
    far.advance(1.0)
    assert far.receive() == []
    with pytest.raises(ConnectionError, match="the link is closed"):
        near.send(b"more")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: QueueLink(latency=-1.0), r"latency must be >= 0 \(s\); got -1.0"),
        (lambda: QueueLink(jitter=float("inf")), r"jitter must be finite \(s\); got inf"),
        (lambda: QueueLink(loss=1.5), r"loss must be in \[0, 1\]; got 1.5"),
        (lambda: back(QueueLink().start()[0]), r"time must be >= that of the link, 2 \(s\); got 1.0"),
        (lambda: back(Courier()), r"time must be >= 2, that was told last \(s\); got 1.0"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def back(link):
    link.advance(2.0)
    link.advance(1.0)


@pytest.mark.parametrize("link", [QueueLink().start()[0], Courier()])
def test_what_is_no_message(link):
    with pytest.raises(TypeError, match="must be bytes; got 'text'"):
        link.send("text")


def test_both_are_links():
    assert isinstance(QueueLink().start()[0], Link) and isinstance(Courier(), Link)
    with pytest.raises(TypeError, match="link must be a link; got 5"):
        Courier(5)


def talk(machine, host, steps, tick=0.01, begin=0):
    got, back = [], []
    for k in range(begin, begin + steps):
        machine.advance(k * tick)
        host.advance(k * tick)
        got += host.receive()
        back += machine.receive()
    return got, back


@given(
    st.floats(0.0, 0.6),
    st.floats(0.0, 0.1),
    st.lists(st.integers(0, 60), max_size=4),
    st.integers(0, 90),
    st.integers(0, 2**32),
)
@settings(max_examples=60, deadline=None)
def test_no_record_is_lost_doubled_or_out_of_order(loss, jitter, breaks, number, seed):
    kind = QueueLink(latency=0.02, jitter=jitter, loss=loss)
    machine, host = Courier(), Courier()
    got, back, step = [], [], 0
    for k, steps in enumerate([*breaks, None]):
        near, far = kind.start(seed + k)
        machine.attach(near)
        host.attach(far)
        if k == 0:
            for record in range(number):
                machine.send(record.to_bytes(2, "big"))
                host.send(record.to_bytes(3, "big"))
        while steps is None or steps > 0:
            there, here = talk(machine, host, 1, begin=step)
            got, back, step = got + there, back + here, step + 1
            if steps is None and not (machine.waiting or host.waiting):
                break
            assert step < 20_000
            steps = None if steps is None else steps - 1
        near.close()
    assert [int.from_bytes(each, "big") for each in got] == list(range(number))
    assert [int.from_bytes(each, "big") for each in back] == list(range(number))


def test_a_link_that_loses_every_second_message_is_got_over():
    """640 records are ten windows; what is lost goes again as soon as a sign of life has told, and nothing
    else does.

    A round of a record takes 4 ticks (latency there and back), and as many more as it takes until a later
    message arrives there and one from there here: both geometric. So z**ticks of a round has the mean R =
    z**4 (0.5/(1 - 0.5 z))**2, that of a record, of geometrically many rounds, 0.5 R/(1 - 0.5 R): 23 for z =
    1.11. By Markov's inequality a record takes longer than 224 ticks with a probability of less than 23 *
    1.11**-224, one of the 640 with less than 1e-6, and a window lasts no longer than its slowest record."""
    near, far = QueueLink(latency=0.02, loss=0.5).start(11)
    machine, host = Courier(near), Courier(far)
    for k in range(640):
        machine.send(k.to_bytes(2, "big"))
    got, ticks = [], 0
    while machine.waiting:
        got += talk(machine, host, 1, begin=ticks)[0]
        ticks += 1
    assert got == [k.to_bytes(2, "big") for k in range(640)] and ticks <= 10 * 224


def test_only_what_was_lost_is_sent_again():
    sent = []

    class Counting(Courier):
        def _message(self, record):
            sent.append(record)
            return super()._message(record)

    near, far = QueueLink(latency=0.02, loss=0.3).start(2)
    machine, host = Counting(near), Courier(far)
    for k in range(60):
        machine.send(bytes([k]))
    talk(machine, host, 400)
    records = [each for each in sent if each is not None]
    # geometric: 60/0.7 = 86 of sd (60 * 0.3)^(1/2)/0.7 = 6; go back n would send all from the first that was
    # lost on
    assert machine.waiting == 0 and abs(len(records) - 86) < 4 * 6


def test_a_backlog_is_a_queue_whatever_of_it_is_in_the_file(monkeypatch):
    monkeypatch.setattr(backlogs, "NEAR", 4)
    backlog, plain, rng = backlogs.Backlog(), deque(), np.random.default_rng(3)
    for k in range(2000):
        if rng.random() < (0.7 if k % 400 < 200 else 0.2):
            record = rng.bytes(int(rng.integers(0, 40)))
            backlog.append(record)
            plain.append(record)
        elif plain:
            assert backlog.popleft() == plain.popleft()
        assert len(backlog) == len(plain) and len(backlog._near) == min(4, len(plain))
        assert [backlog[place] for place in range(len(backlog._near))] == list(plain)[:4]
    assert backlog._far is not None


def test_a_host_that_is_gone_for_long_costs_no_memory_and_no_record(monkeypatch):
    monkeypatch.setattr(backlogs, "NEAR", 100)
    near, far = QueueLink().start()
    machine, host = Courier(near), Courier()
    for k in range(5000):
        machine.send(k.to_bytes(2, "big"))
    assert machine.waiting == 5000 and len(machine._kept._near) == 100
    host.attach(far)
    got, _ = talk(machine, host, 200)
    assert got == [k.to_bytes(2, "big") for k in range(5000)] and machine.waiting == 0


def test_without_a_link_records_wait():
    machine = Courier()
    for k in range(1000):
        machine.send(bytes([k % 256]))
        machine.advance(0.01 * k)
    assert machine.waiting == 1000 and machine.closed and machine.silence == pytest.approx(9.99)
    near, far = QueueLink().start()
    host = Courier(far)
    machine.attach(near)
    got, _ = talk(machine, host, 40, begin=1000)
    assert got == [bytes([k % 256]) for k in range(1000)] and machine.waiting == 0


def test_what_was_sent_over_a_broken_link_is_sent_again_at_once():
    near, far = QueueLink(latency=0.02).start()
    machine, host = Courier(near), Courier(far)
    machine.send(b"first")
    machine.advance(0.0)
    near.close()
    machine.send(b"second")
    near, far = QueueLink().start()
    machine.attach(near)
    host.attach(far)
    machine.advance(0.01)
    host.advance(0.01)
    assert host.receive() == [b"first", b"second"]


def test_signs_of_life():
    near, far = QueueLink(latency=0.05).start()
    machine, host = Courier(near), Courier(far)
    talk(machine, host, 100)
    assert machine.silence < 0.011 and not machine.closed
    for k in range(100, 150):
        machine.advance(k * 0.01)
    assert machine.silence == pytest.approx(0.45, abs=0.011)  # what was under way was heard still


def test_a_new_host_takes_over_what_the_old_one_had_not():
    near, far = QueueLink().start()
    machine, old = Courier(near), Courier(far)
    for k in range(10):
        machine.send(bytes([k]))
    talk(machine, old, 3)
    for k in range(10, 20):
        machine.send(bytes([k]))
    near, far = QueueLink().start()
    machine.attach(near)
    new = Courier(far)
    got, _ = talk(machine, new, 5, begin=3)
    assert got == [bytes([k]) for k in range(10, 20)]


@pytest.mark.parametrize("number", [10, 100])  # within the window of records under way, and beyond it
def test_a_host_that_comes_back_goes_on_behind_what_another_took(number):
    machine, first, second, step = Courier(), Courier(), Courier(), 0
    for host, records in ((first, 5), (second, number), (first, 3)):
        near, far = QueueLink().start()
        machine.attach(near)
        host.attach(far)
        for k in range(records):
            machine.send(bytes([k]))
        assert (
            talk(machine, host, 10, begin=step)[0] == [bytes([k]) for k in range(records)]
            and machine.waiting == 0
        )
        near.close()
        step += 10


def test_a_new_machine_is_not_taken_for_the_old_one():
    near, far = QueueLink().start()
    old, host = Courier(near), Courier(far)
    for k in range(10):
        old.send(bytes([k]))
    assert len(talk(old, host, 3)[0]) == 10
    near, far = QueueLink().start()
    new = Courier(near)
    host.attach(far)
    for k in range(5):  # numbers that the host has seen from another
        new.send(bytes([100 + k]))
    got, _ = talk(new, host, 5, begin=3)
    assert got == [bytes([100 + k]) for k in range(5)] and new.waiting == 0


@pytest.mark.parametrize("junk", [b"", b"GET / HTTP/1.1", b"\x07" * 65, b"\x01" * 41])
def test_who_speaks_another_language_is_cut_off(junk):
    near, far = QueueLink().start()
    machine = Courier(near)
    machine.send(b"kept")
    far.send(junk)
    machine.advance(0.1)
    assert machine.closed and machine.waiting == 1 and machine.silence == pytest.approx(0.1)


@pytest.mark.parametrize("arrived", [(3, 0), (0, 0b10)])  # three in order; one behind two that are lost
def test_who_acknowledges_what_was_never_sent_is_cut_off(arrived):
    near, far = QueueLink().start()
    machine = Courier(near)
    machine.advance(0.0)
    (message,) = far.receive()
    name = struct.unpack_from("!BQ", message)[1]
    far.send(struct.pack("!B8Q", 3, 77, name, *arrived, 1, 1, 0, 0))
    machine.send(b"kept")
    machine.advance(0.1)
    assert machine.closed and machine.waiting == 1


def test_a_copy_is_the_same_courier():
    machine = Courier()
    for each in (copy.copy(machine), copy.deepcopy([machine])[0]):
        each.send(b"one")
    assert machine.waiting == 2
