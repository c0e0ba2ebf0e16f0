"""Machines behind OPC UA: what a step costs, how fast a machine is made safe, what survives a kill.

    python benchmarks/opcua.py [lists] [rate] [safe] [cut] [gate] [kills] [shadow] [--trials 10]

The server runs in a process of its own. Bars: a step of two lists (8 + 4 values) at least 4 times as fast as one
value after the other, 3 times encrypted; a step in lockstep at most half of the two lists; 20 Hz encrypted: 99 %
of steps within 25 ms, none missed; the safe command within deadline + 30 ms (exception, NaN, step asleep or
looping), within timeout + 50 ms by the machine (interpreter held, process killed, link cut), in 95 %, with the
gate the first two within deadline + 30 ms; no command that moves the machine after a safe one; killed servers lose and
double no finished part; a shadow writes nothing.
"""

import argparse
import contextlib
import ctypes
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from math import nan
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "hwsim"))

import opcua_fakes

import hwsim
from hwsim.opcua import _live_part

USERS = {"operator": "benchmark"}
DEADLINE, TIMEOUT = 0.05, 0.5
NAMES = tuple(f"m{k}" for k in range(8)), tuple(f"c{k}" for k in range(4))


class Wide:
    """Eight measurements, four commands, and nothing else."""

    measures = dict.fromkeys(NAMES[0], "mm")
    accepts = dict.fromkeys(NAMES[1], "mm/s")
    safe = dict.fromkeys(NAMES[1], 0.0)
    tick = 0.01

    def start(self, rng):
        return WidePart()


class WidePart:
    def __init__(self):
        self.time, self.done, self.event = 0, False, False
        self.reading = {name: float(k) for k, name in enumerate(NAMES[0])}

    def step(self, command, ticks):
        self.time += ticks if ticks < 2**60 else 0
        return self.reading

    def outcome(self):
        return {}


class Told(opcua_fakes.Axis):
    """Prints each command with its time."""

    def start(self, rng):
        part = super().start(rng)
        step = part.step

        def told(command, ticks):
            if command:
                print(json.dumps([time.monotonic_ns(), command]), flush=True)
            return step(command, ticks)

        part.step = told
        return part


PLANTS = {
    "wide": Wide,
    "axis": lambda: Told(length=3.0),
    "short": lambda: Told(length=0.4),
    "long": lambda: Told(length=70.0),
    "shadow": lambda: Told(length=10.5),
}


def serving(name, url, speed, keys):
    """In the process of the server: serve until the input ends."""
    controller = opcua_fakes.Drive(period=0.01) if name == "shadow" else None
    secure = {"security": "none"} if keys == "none" else {"security": keys, "users": USERS}
    with hwsim.serve(
        PLANTS[name](),
        url,
        speed=None if speed == 0 else speed,
        controller=controller,
        timeout=TIMEOUT,
        **secure,
    ) as server:
        print(server.url, flush=True)
        for _ in sys.stdin:
            print(json.dumps({"state": dict(server.state)}), flush=True)


class Server:
    """A server in a process of its own; `lines`: what it printed."""

    def __init__(self, name, url=opcua_fakes.ANY, speed=1.0, keys="none"):
        command = [sys.executable, __file__, "--serve", name, url, str(speed), str(keys)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()
        self.lines = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        self.lines.extend(json.loads(line) for line in self.process.stdout)

    def state(self):
        """State of the served machine."""
        seen = len(self.lines)
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        while not any(isinstance(line, dict) for line in self.lines[seen:]):
            time.sleep(0.01)
        return next(line["state"] for line in self.lines[seen:] if isinstance(line, dict))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.process.kill()
        self.process.wait()


def plant_of(server, keys="none"):
    user = None if keys == "none" else ("operator", USERS["operator"])
    return hwsim.OpcuaPlant(server.url, security=keys, user=user)


def timed(works, rounds, often=10):
    """Median and 99th percentile of several works in turn, so that they meet the same load, ms."""
    took = [[] for _ in works]
    for _ in range(rounds):
        for work, times in zip(works, took, strict=True):
            for _ in range(often):
                begun = time.perf_counter()
                work()
                times.append(1e3 * (time.perf_counter() - begun))
    return [(statistics.median(times), float(np.percentile(times, 99))) for times in took]


def lists(keys, number):
    """One value after the other, two lists, and lockstep."""
    from asyncua import ua

    from hwsim.opcua._link import reads, writes

    label = "plain" if keys == "none" else "encrypted"
    with Server("wide", keys=keys) as server:
        plant = plant_of(server, keys)
        remote, link = plant._remote, plant._link
        link.loop.run(remote.start(1, "1"))
        ids = [remote.node_id(f"Monitoring.{name}") for name in NAMES[0]]
        to = [remote.node_id(f"Commands.{name}") for name in NAMES[1]]
        beat = remote.node_id("Commands.heartbeat")
        count = iter(range(10**9))

        def variant(k):
            return ua.Variant(float(k % 7), ua.VariantType.Double)

        async def singly():
            for node in ids:
                await link.read(reads([node]))
            for node in to:
                await link.write(writes({node: variant(next(count))}))
            await link.write(writes({beat: ua.Variant(next(count), ua.VariantType.UInt32)}))

        async def listed():
            await link.read(reads(ids))
            told = {node: variant(next(count)) for node in to}
            await link.write(writes({**told, beat: ua.Variant(next(count), ua.VariantType.UInt32)}))

        with Server("wide", speed=0, keys=keys) as other:
            locked = plant_of(other, keys)
            part = locked.start(np.random.default_rng(0))
            command = dict.fromkeys(NAMES[1], 1.0)
            works = (
                lambda: link.loop.run(singly()),
                lambda: link.loop.run(listed()),
                lambda: part.step(command, 1),
            )
            one, two, lock = timed(works, number)
            locked.close()
        plant.close()
    print(f"{label}, ms, median / p99 of {10 * number}: one by one {one[0]:.2f} / {one[1]:.1f}, "
          f"lists {two[0]:.2f} / {two[1]:.1f} ({one[0] / two[0]:.1f} times), "
          f"lockstep {lock[0]:.2f} / {lock[1]:.1f} ({lock[0] / two[0]:.2f} of the lists)")  # fmt: skip


def rate(keys, steps):
    """Steps of 20 Hz, encrypted: from the release until the machine has taken the command."""
    took = []

    class Timed(_live_part.RemotePart):
        def _hand(self, command, now):
            super()._hand(command, now)
            if self._releases is not None:
                took.append((time.monotonic_ns() - self.released) / 1e6)

    original, _live_part.RemotePart = _live_part.RemotePart, Timed
    from hwsim.opcua import _begin

    _begin.RemotePart = Timed
    with Server("long", keys=keys) as server:
        stop = opcua_fakes.Drive(lambda: {"stop": 1.0}, at=steps, period=0.05)
        log = hwsim.run(plant_of(server, keys), stop, live=opcua_fakes.live(deadline=DEADLINE))
    _live_part.RemotePart = _begin.RemotePart = original
    print(f"20 Hz encrypted, {len(took)} steps: median {statistics.median(took):.1f}, "
          f"p99 {np.percentile(took, 99):.1f}, longest {max(took):.1f} ms; "
          f"missed {int(log.outcome.overruns[0])}, aborted {int(log.outcome.aborted[0])}")  # fmt: skip


def loop(seconds):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass
    return {}


def fault():
    raise RuntimeError("fault")


def held(seconds):
    ctypes.PyDLL(None).usleep(round(1e6 * seconds))  # keeps the interpreter's lock
    return {"velocity": 9.0}


def delay(lines):
    """From the last good command to the safe one, ms, and the number of moving commands after it."""
    told = [line for line in lines if isinstance(line, list)]
    safe = next((k for k, (_, command) in enumerate(told) if command.get("stop")), None)
    if safe is None:
        return nan, 0
    after = sum(bool(command.get("velocity")) for _, command in told[safe + 1 :])
    return (told[safe][0] - told[safe - 1][0]) / 1e6, after


def trial(server, plant, odd, gate=False):
    seen = len(server.lines)
    with contextlib.suppress(hwsim.Aborted):
        hwsim.run(plant, opcua_fakes.Drive(odd), live=opcua_fakes.live(deadline=DEADLINE, gate=gate))
    until = time.monotonic() + 3
    while delay(server.lines[seen:])[0] != delay(server.lines[seen:])[0] and time.monotonic() < until:
        time.sleep(0.01)
    time.sleep(0.05)
    return delay(server.lines[seen:])


def safe(trials):
    """How fast a machine is made safe, whatever happens."""
    causes = {
        "exception": fault,
        "NaN": lambda: {"velocity": nan},
        "step asleep": lambda: time.sleep(0.4) or {"velocity": 9.0},
        "step looping": lambda: loop(0.4) or {"velocity": 9.0},
        "interpreter held": lambda: held(0.9),
    }
    with Server("axis") as server:
        plant = plant_of(server)
        for name, odd in causes.items():
            told(name, [trial(server, plant, odd) for _ in range(trials)], name == "interpreter held")
        plant.close()
        told("link cut", cuts(server, trials), True)
        told("process killed", [killed(server) for _ in range(trials)], True)


def cuts(server, trials):
    """The link of a run is cut; each run has a session of its own."""
    port, found = int(server.url.rpartition(":")[2]), []
    for _ in range(trials):
        cable = opcua_fakes.Cable(port)
        plant = hwsim.OpcuaPlant(cable.url, security="none")
        found.append(trial(server, plant, lambda cable=cable: cable.cut() or {"velocity": 9.0}))
        plant.close()
        cable.close()
    return found


def cut(trials):
    """Cut links alone."""
    with Server("axis") as server:
        told("link cut", cuts(server, trials), True)


def killed(server, *gate):
    """The process of a runner is killed."""
    seen = len(server.lines)
    subprocess.run([sys.executable, __file__, "--die", server.url, *gate], check=False)
    time.sleep(TIMEOUT + 0.3)
    return delay(server.lines[seen:])


def gate(trials):
    """The same with the gate: what the link's thread answers, and what only the machine did."""
    causes = {
        "step asleep": lambda: time.sleep(0.4) or {"velocity": 9.0},
        "step looping": lambda: loop(0.4) or {"velocity": 9.0},
        "interpreter held": lambda: held(0.9),
    }
    with Server("axis") as server:
        plant = plant_of(server)
        for name, odd in causes.items():
            told(f"{name}, gate", [trial(server, plant, odd, gate=True) for _ in range(trials)], False)
        plant.close()
        told("process killed, gate", [killed(server, "--gate") for _ in range(trials)], False)


def told(name, found, by_machine):
    times, after = zip(*found, strict=True)
    bar = 1e3 * (TIMEOUT + 0.05 if by_machine else DEADLINE + 0.03)
    print(f"{name}: last good command to safe, {len(times)} trials: median {np.median(times):.0f}, "
          f"p95 {np.percentile(times, 95):.0f}, largest {max(times):.0f} ms (bar {bar:.0f}); "
          f"moving commands after it: {sum(after)}")  # fmt: skip


def dying(url, gate):
    """In a process: run a part and be killed within it."""
    plant = hwsim.OpcuaPlant(url, security="none")
    odd = opcua_fakes.Drive(lambda: os.kill(os.getpid(), signal.SIGKILL))
    hwsim.run(plant, odd, live=opcua_fakes.live(deadline=DEADLINE, gate=gate))


def kills(parts, number):
    """Kill the server within parts; run again with the journal until all parts are there."""
    rng, folder = np.random.default_rng(1), Path(tempfile.mkdtemp())
    server = Server("short")
    plant, killed, runs = plant_of(server), 0, 0
    stop = threading.Event()

    def killer():
        nonlocal server, killed
        while killed < number and not stop.wait(float(rng.uniform(0.3, 1.2))):
            url = server.url
            server.process.kill()
            server.process.wait()
            killed += 1
            server = Server("short", url)

    thread = threading.Thread(target=killer)
    thread.start()
    while True:
        runs += 1
        try:
            log = hwsim.run(
                plant, opcua_fakes.Drive(), parts=parts, journal=folder / "run.db", live=opcua_fakes.live()
            )
            break
        except (hwsim.Aborted, ConnectionError) as error:
            print(f"  run {runs}: {error}")
    stop.set()
    thread.join()
    server.process.kill()
    begun = log.outcome.begun.values.tolist()
    print(f"{killed} kills in {len(log)} parts, {runs} runs: finished {int((log.outcome.aborted.values == 0).sum())}, "
          f"aborted {int((log.outcome.aborted.values == 1).sum())}, doubled {len(begun) - len(set(begun))}")  # fmt: skip
    shutil.rmtree(folder)


def shadow():
    """A thousand steps of a client that only listens."""
    with Server("shadow") as server:
        log = hwsim.run(plant_of(server), opcua_fakes.Drive(period=0.01), live=hwsim.Live(shadow=True))
        state = server.state()
    print(f"shadow: {len(log['controller'].time)} steps, {int(log.outcome.overruns[0])} missed, "
          f"writes at the server {state['writes']}")  # fmt: skip


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", nargs="*", default=["lists", "rate", "safe", "gate", "kills", "shadow"])
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--serve", nargs=4)
    parser.add_argument("--die")
    parser.add_argument("--gate", action="store_true")
    given = parser.parse_args()
    if given.serve:
        name, url, speed, keys = given.serve
        serving(name, url, float(speed), keys)
    elif given.die:
        dying(given.die, given.gate)
    else:
        run(given)


def run(given):
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    home = Path(tempfile.mkdtemp())
    keys = home / "keys"
    hwsim.opcua.make_keys(keys)
    if "lists" in given.what:
        lists("none", 5 * given.trials)
        lists(keys, 5 * given.trials)
    if "rate" in given.what:
        rate(keys, given.steps)
    if "safe" in given.what:
        safe(given.trials)
    if "cut" in given.what:
        cut(given.trials)
    if "gate" in given.what:
        gate(given.trials)
    if "kills" in given.what:
        kills(2 * given.trials, given.trials)
    if "shadow" in given.what:
        shadow()
    shutil.rmtree(home)


if __name__ == "__main__":
    main()
