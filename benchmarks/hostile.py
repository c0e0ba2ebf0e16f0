"""Forged messages to `Courier` and `Watchdog`: what raises, whether silence makes safe, how long a call takes.

    python benchmarks/hostile.py [--frames 100000]

Bars: no exception; the safe command in each step in which the host was silent for longer than the timeout;
`advance` within 5 ms in 99 % of calls under a flood. Half of the frames have all fields anywhere, half are those
of a good courier but for one or two fields. On a busy machine only the thread's own time tells; its load is printed.
"""

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "hwsim"))

from test_links_hostile import RECORD, SAFE, SIGN, TICK, Drive, Peer

from hwsim import Watchdog

FIELDS = ("sender", "whose", "arrived", "behind", "reached", "number", "oldest", "record")
TIMEOUT = 5 * TICK  # s
EDGES = (0, 1, 2, 63, 64, 65, 2**47, 2**48 - 1, 2**48, 2**48 + 1, 2**63, 2**64 - 1)


def number(rng):
    if rng.random() < 0.5:
        return int(rng.choice(np.array(EDGES, dtype=np.uint64)))
    return int(rng.integers(0, 70)) if rng.random() < 0.7 else int(rng.integers(0, 2**64, dtype=np.uint64))


def forged(peer, rng):
    """Fields of a frame that differ from those of a good courier."""
    kind = RECORD if rng.random() < 0.6 else SIGN
    names = FIELDS if rng.random() < 0.5 else rng.choice(FIELDS, rng.integers(0, 3), replace=False)
    good = {"oldest": min(peer.courier._taken, 2**48), "record": 0, "reached": 0}
    if kind == RECORD:
        good |= {
            "record": good["oldest"] + int(rng.integers(0, 64)),
            "content": rng.bytes(int(rng.integers(0, 20))),
        }
    return {"kind": kind, **good, **{str(name): number(rng) for name in names}}


def series(frames, rng):
    """Send frames to a watchdog; count exceptions, closed links and steps that were wrongly not safe."""
    raised = closed = unsafe = accepted = silent_steps = 0
    peer = Peer()
    guarded = Watchdog(Drive(), peer.courier, timeout=TIMEOUT, safe_command=SAFE)
    guarded.reset()
    for k in range(frames):
        courier = peer.courier
        if courier.closed:
            closed += 1
            fresh = Peer(courier)
            peer.near, peer.far = fresh.near, fresh.far
            peer.far.advance(courier.time)
        if k % 50 == 0:
            guarded.reset()
        peer.far.advance(courier.time)
        try:
            peer.forge(**forged(peer, rng))
            if k % 50 >= 40:  # lost: the host is silent for 10 steps
                peer.near.receive()
            command = guarded.step()
        except Exception as error:
            raised += 1
            print("raised", repr(error))
            continue
        accepted += courier.silence == 0.0
        courier.receive()
        if courier.silence > TIMEOUT:
            silent_steps += 1
            unsafe += command != SAFE
    return raised, closed, unsafe, accepted, silent_steps


def flood(calls, each, content):
    """Times (ms) of `advance` while a peer sends `each` messages between two calls."""
    peer, times, closed = Peer(), [], 0
    record = 0
    for _ in range(calls):
        if peer.courier.closed:
            closed += 1
            fresh = Peer(peer.courier)
            peer.near, peer.far = fresh.near, fresh.far
            peer.far.advance(peer.time)
        for _ in range(each):
            if content is None:
                peer.forge()
            else:
                peer.forge(RECORD, content, oldest=record, record=record, whose=99)
                record += 1
        peer.time += TICK
        begin = time.perf_counter(), time.thread_time()
        peer.courier.advance(peer.time)
        times.append((1e3 * (time.perf_counter() - begin[0]), 1e3 * (time.thread_time() - begin[1])))
        peer.far.advance(peer.time)
        peer.far.receive()
        peer.courier.receive()
    return np.array(times), closed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=100_000)
    frames = parser.parse_args().frames
    begin = time.perf_counter()
    raised, closed, unsafe, accepted, silent = series(frames, np.random.default_rng(0))
    print(
        f"{frames} frames in {time.perf_counter() - begin:.0f} s: {raised} exceptions; {accepted} counted as life, "
        f"{closed} closed the link; {silent} steps after a silence > {TIMEOUT:g} s, {unsafe} of them not safe"
    )
    print("ms of the wall clock and of the thread's own time: median, 99 %, largest")
    for name, each, content in (
        ("100 signs of life", 100, None), ("1000 signs of life", 1000, None), ("5000 signs of life", 5000, None),
        ("100 records of 20 bytes", 100, bytes(20)), ("3 records of 1 MB", 3, bytes(10**6)),
        ("100 000 signs of life", 100_000, None),
    ):  # fmt: skip
        calls = 20 if each == 100_000 else 300
        times, closed = flood(calls, each, content)
        told = [f"{np.median(row):.2f}, {np.quantile(row, 0.99):.2f}, {row.max():.2f}" for row in times.T]
        print(f"{name:24} a call: {told[0]}; of the thread {told[1]}; {calls} calls, closed {closed} times")
    print("load of the machine:", *(f"{each:.1f}" for each in os.getloadavg()), "on", os.cpu_count(), "cores")


if __name__ == "__main__":
    main()
