"""A simulated machine that keeps wall time, with a thread that makes it safe when its controller hangs."""

import copy
import threading
import time
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from hwsim._live.forwarding import POLL, Forwarding, Trip
from hwsim._live.live import Live
from hwsim._live.machine import TrippedError
from hwsim._live.releases import Releases
from hwsim._processor.tasks import NANOSECONDS
from hwsim.faults._machine import inside
from hwsim.protocols import FOREVER, Machine, Plant

_SLICES = 4  # signs of life a deadline while waiting; chosen: one or two may be late
_LONG = 0.005  # s; chosen: a copy takes 0.2 to 0.4 ms, and made safe late by so much is late by two polls


class WallMachine:
    """A simulated part in wall time (`LiveMachine`); only `step` and the guard touch it, one at a time.

    A step is simulated at once and then waited for; a copy from before serves where the machine has to be
    made safe in between. Between an event and the answer of a controller without a period no time passes.
    """

    def __init__(
        self, machine: Machine, tick: Fraction, period: int | None, live: Live, samples: int = 1
    ) -> None:
        now = time.monotonic_ns()
        self.released = self.sampled = now
        self.taken = True
        self._machine, self._live = machine, live
        self._samples = samples  # ticks between two samples of the machine's own computer
        self._releases = Releases(now, tick, period or 1)
        self._periodic = period is not None
        self._before: Machine | None = None  # the machine at the start of a long step
        self._forwarding = Forwarding(live.safe, round(live.deadline * NANOSECONDS), now)
        self._lock, self._over = threading.Lock(), threading.Event()
        self._guard = threading.Thread(target=self._watch, name="hwsim guard", daemon=True)
        self._guard.start()

    @property
    def time(self) -> int:
        """Ticks since the start of the part."""
        return self._machine.time

    @property
    def done(self) -> bool:
        """Whether the part is finished."""
        return self._machine.done

    @property
    def event(self) -> bool:
        """Whether the last step ended at an event."""
        return self._machine.event

    @property
    def trip(self) -> Trip | None:
        """Why the machine was made safe."""
        return self._forwarding.trip

    def outcome(self) -> Mapping[str, Any]:
        """Return the outcome of the simulated part."""
        with self._lock:
            return self._machine.outcome()

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        """Take the command, simulate up to the next release or event, and wait for it."""
        self.taken = False
        with self._lock:
            now = time.monotonic_ns()
            self._forwarding.hand({}, now)  # a sign of life; the command itself is taken here
            self._refuse_tripped()
            reading = self._simulated(command, ticks, now)
            self.taken = True
            self._forwarding.renew(time.monotonic_ns())  # the plant's own time is not the controller's
        self._wait_until(self._releases.instant(self.time))
        self.sampled = time.monotonic_ns()
        return reading

    def _simulated(self, command: Mapping[str, Any], ticks: int, now: int) -> Mapping[str, Any]:
        machine, releases = self._machine, self._releases
        if not self._periodic:  # its time stood still while the controller decided
            self._releases = releases._replace(start=releases.start + now - releases.instant(machine.time))
        elif ticks and releases.following(machine.time + ticks, now) != machine.time + ticks:
            return self._late(command, ticks, now)
        long = ticks >= FOREVER or releases.instant(ticks) - releases.start > _LONG * NANOSECONDS
        self._before = copy.deepcopy(machine) if long else None
        self._command = command
        return machine.step(command, ticks)

    def _late(self, command: Mapping[str, Any], ticks: int, now: int) -> Mapping[str, Any]:
        """Hold the last command until this one came, then go on to the next release on the grid."""
        machine, self._before = self._machine, None
        if self._live.overruns == "abort":
            self._forwarding.ask("a release was missed", "runner")
            self._make_safe()
            raise TrippedError
        due = self._releases.following(machine.time + ticks, now)
        machine.step({}, self._until(now))
        if machine.done:
            return machine.step({}, 0)
        return machine.step(command, 0 if machine.event else due - machine.time)

    def _until(self, now: int) -> int:
        """Ticks of the machine until an instant (ns), up to its computer's next sample."""
        left = self._releases.ticks(now) - self._machine.time
        return max(0, -(-left // self._samples) * self._samples)

    def _wait_until(self, instant: int) -> None:
        """Wait, with signs of life, until a monotonic time, ns."""
        slice_ = self._live.deadline / _SLICES
        while (left := (instant - time.monotonic_ns()) / NANOSECONDS) > 0:
            self._over.wait(min(left, slice_))
            self._forwarding.renew(time.monotonic_ns())
            self._refuse_tripped()
        self.released = instant
        self._before = None

    def _refuse_tripped(self) -> None:
        if self._forwarding.trip is not None:
            raise TrippedError

    def _watch(self) -> None:
        """Thread of the guard."""
        while not self._over.wait(POLL):
            if self._live.reason is not None:
                self._forwarding.ask(self._live.reason, self._forwarding.by)
            with self._lock:
                self._make_safe()

    def make_safe(self, reason: str) -> None:
        """Write the safe command now, unless it was written."""
        self._forwarding.ask(reason, "runner")
        with self._lock:
            self._make_safe()

    def _make_safe(self) -> None:
        """Poll, and take the safe command at the state that the machine has by now."""
        safe = self._forwarding.poll(time.monotonic_ns())
        if not safe:
            return
        before = self._before
        machine, command = (self._machine, {}) if before is None else (before, self._command)
        self._machine, self._live.tripped = machine, True
        try:
            if (elapsed := self._until(time.monotonic_ns())) and not machine.done:
                machine.step(command, elapsed)
            take_safe(machine, safe, self._samples)
        except Exception as error:
            self._forwarding.refused(error)

    def close(self) -> None:
        """Stop the guard."""
        self._over.set()
        self._guard.join()


def samples_of(plant: Plant) -> int:
    """Ticks between two samples of the machine's own computer, which takes commands only then."""
    return int(getattr(plant, "sample_ticks", 1))


def take_safe(machine: Machine, safe: Mapping[str, Any], samples: int) -> None:
    """Let a simulated machine take the safe command, one with a computer of its own at its next sample."""
    own = inside(machine)  # its watchdog stands behind a cut link
    if not machine.done:
        own.step(safe, 0)
    if samples > 1 and not machine.done:
        own.step({}, samples)
