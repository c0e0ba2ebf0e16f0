"""A part on a machine with its own time (`LiveMachine`): the thread that steps the controller waits here."""

import contextlib
import threading
import time
from collections.abc import Callable, Mapping
from fractions import Fraction
from math import nan
from typing import Any

import numpy as np

from hwsim._live.forwarding import Forwarding, Trip
from hwsim._live.live import Live
from hwsim._live.machine import TrippedError
from hwsim._live.releases import Releases
from hwsim._part.clock import exact
from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._link import ANSWER
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._pulse import BEATS, Pulse
from hwsim.opcua._sample import ReadSample, checked, within

_STALE = 0.5  # s; measured: a computer with 5 tasks a core pauses for 0.24 s; samples come each 10 ms
_PERIODS = 2  # chosen: one sample may be missing


class RemotePart:
    """A live part: commands go out by the link's thread, samples come in by it."""

    def __init__(
        self,
        remote: RemoteMachine,
        told: Declaration,
        names: Mapping[str, str],
        live: Live,
        period: int | None,
        part: int,
        pauses: Pauses,
    ) -> None:
        now = time.monotonic_ns()
        self.time, self.done, self.event = 0, False, False
        self.released = self.sampled = now
        self.taken, self.part = True, part
        self._remote, self._told, self._live, self._period = remote, told, live, period
        self._tick = exact("tick", told.tick)
        self._releases: Releases | None = None  # from the first command
        self._events = 0
        self._news = threading.Condition()
        self._forwarding = self._rules(now)
        self._watch = Watch(live, self._wall(period), self._forwarding, pauses)
        self._pulse = remote.link.loop.run(self._begun(names))

    def _rules(self, now: int) -> Forwarding:
        return Forwarding(self._live.safe, round(self._live.deadline * NANOSECONDS), now)

    async def _begun(self, names: Mapping[str, str]) -> Pulse:
        deadline, events = self._live.deadline, self._period is None
        return Pulse(self._remote, names, self._forwarding, deadline, events, self._heard)

    def _wall(self, period: int | None) -> float:
        """Period in wall time, s; 0: events."""
        return float((period or 0) * self._tick / Fraction(self._told.speed or 1))

    @property
    def trip(self) -> Trip | None:
        """Why the machine was made safe."""
        return self._forwarding.trip

    def _heard(self) -> None:
        """Look at what came, in the thread of the link."""
        if self._live.reason is not None:
            self._forwarding.ask(self._live.reason, self._forwarding.by)
        if (seen := self._pulse_seen()) is not None:
            self._watch.look(seen)
            self._watch.age(time.monotonic_ns())
        self._live.tripped = self._live.tripped or self._forwarding.trip is not None
        with self._news:
            self._news.notify_all()

    def _pulse_seen(self) -> ReadSample | None:
        pulse = getattr(self, "_pulse", None)
        return None if pulse is None else pulse.seen

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        """Hand over the command, wait for the release, the event or the end, measure."""
        if not command and not ticks:
            reading = self._taken_in(self._fresh())
            self.released = self.sampled
            return reading
        self.taken = False
        now = time.monotonic_ns()
        self._hand(command, now)
        if self._releases is None:
            self._releases = Releases(now, self._tick / Fraction(self._told.speed or 1), self._period or 1)
        due = self.time + ticks
        if self._period is not None and self._releases.following(due, now) != due:
            due = self._releases.following(due, now)
            if self._live.overruns == "abort":
                self._forwarding.ask("a release was missed", "runner")
        until = None if self._period is None else self._releases.instant(due)
        self._wait(self._happened, until)
        on_time = not self._happened()
        seen = self._fresh()
        self.released = until if on_time and until is not None else self.sampled
        reading = self._taken_in(seen)
        self.time = due if on_time else max(self.time, self._machine_ticks(seen))
        self._watch.stuck(reading, command)
        self._refuse_tripped()
        return reading

    def _hand(self, command: Mapping[str, Any], now: int) -> None:
        """Hand over a command and wait until the machine has taken it; a wrong one is not sent."""
        self._forwarding.hand(self._checked(command), now)
        number = self._forwarding.handed
        self._wake()
        self._wait(lambda: self._pulse.taken >= number)
        if self._pulse.refusal is not None:
            raise self._pulse.refusal
        self.taken = True

    def _checked(self, command: Mapping[str, Any]) -> dict[str, Any]:
        """Return a command as it goes out; one that the machine would refuse is refused here."""
        told, sent = self._told, dict[str, Any]()
        for name, value in command.items():
            sent[name] = checked(name, value, told.accepts[name])
            if name in told.ranges:
                within(name, sent[name], told.ranges[name], told.accepts[name])
        if self._remote.table is not None:
            self._remote.written(sent, None)  # what its types do not hold is refused here
        return sent

    def _happened(self) -> bool:
        """Whether an event or the end came that was not yet told."""
        seen = self._pulse.seen
        return seen is not None and (self._over(seen) or seen.event != self._events)

    def _over(self, seen: ReadSample) -> bool:
        return seen.done

    def _fresh(self) -> ReadSample:
        """A sample that was read from now on."""
        self._pulse.wanted += 1
        number = self._pulse.wanted
        self._wake()
        self._wait(lambda: self._pulse.served >= number)
        seen = self._pulse.seen
        assert seen is not None
        self.sampled = seen.at
        return seen

    def _taken_in(self, seen: ReadSample) -> dict[str, Any]:
        self.event = seen.event != self._events
        self._events, self.done = seen.event, self._over(seen)
        self._pulse.bad += seen.bad
        return {
            name: np.array(value) if isinstance(value, list) else value
            for name, value in seen.reading.items()
        }

    def _machine_ticks(self, seen: ReadSample) -> int:
        if seen.time == seen.time:
            return round(Fraction(seen.time) / self._tick)
        return self._releases.ticks(seen.at) if self._releases else 0  # it does not tell its time

    def _wake(self) -> None:
        self._remote.link.loop.loop.call_soon_threadsafe(self._pulse.wake)

    def _wait(self, happened: Callable[[], bool], until: int | None = None) -> None:
        """Wait, with signs of life, for something or until a monotonic time (ns)."""
        slice_ = self._live.deadline / BEATS
        self._forwarding.waits = True
        try:
            self._waited(happened, until, slice_)
        finally:
            self._forwarding.waits = False

    def _waited(self, happened: Callable[[], bool], until: int | None, slice_: float) -> None:
        while not happened():
            left = slice_ if until is None else (until - time.monotonic_ns()) / NANOSECONDS
            if left <= 0:
                return
            with self._news:
                self._news.wait(min(left, slice_))
            self._forwarding.renew(time.monotonic_ns())
            self._refuse_tripped()

    def _refuse_tripped(self) -> None:
        if self._forwarding.trip is not None:
            raise TrippedError

    def make_safe(self, reason: str) -> None:
        """Write the safe command now, unless it was written, and wait for it."""
        self._forwarding.ask(reason, "runner")
        self._wake()
        until = time.monotonic() + ANSWER
        while not self._pulse.safe_written and time.monotonic() < until:
            with self._news:
                self._news.wait(self._live.deadline)
        if not self._pulse.safe_written:
            said = reason if self._forwarding.trip is None else "the link does not answer"
            self._forwarding.lost(said, time.monotonic_ns())

    @property
    def watchdog(self) -> float:
        """Time limit of the machine's own watchdog, s; 0: not known."""
        return self._told.timeout

    def outcome(self) -> dict[str, Any]:
        """Read the outcome of the part; NaN for what a machine that was cut off does not tell."""
        unknown = {name: nan for name, unit in self._told.outcomes.items() if isinstance(unit, str)}
        told = self._remote_outcome()
        if told and self.trip is not None and not self.trip.by:
            self._look_again()
        return {**unknown, **told, "bad_quality": float(self._pulse.bad)}

    def _look_again(self) -> None:
        """See whether the machine has made itself safe by now."""
        with contextlib.suppress(OSError, ValueError):
            self._remote.link.loop.run(self._seen_again(), ANSWER)

    async def _seen_again(self) -> None:
        await self._pulse.sample()
        self._heard()

    def _remote_outcome(self) -> dict[str, Any]:
        until = time.monotonic() + self._told.timeout + ANSWER
        try:
            while time.monotonic() < until:
                if told := self._remote.link.loop.run(self._remote.outcome(self.part), ANSWER):
                    return told
                time.sleep(self._live.deadline / BEATS)
        except (ConnectionError, TimeoutError):
            pass
        return {}

    def close(self) -> None:
        """Stop writing and reading."""
        self._remote.link.loop.run(self._pulse.close(), 2 * ANSWER)


class Watch:
    """Looks at samples: stale, restarted, made safe by the machine, stuck; asks for the safe command."""

    def __init__(self, live: Live, period: float, forwarding: Forwarding, pauses: Pauses) -> None:
        self._live, self._forwarding, self._pauses = live, forwarding, pauses
        self._stale = live.stale if live.stale is not None else max(_PERIODS * period, _STALE)
        self._old = f"measurements are stale: no new sample for more than {self._stale:g} s"
        self._first: ReadSample | None = None
        self._last: ReadSample | None = None  # the last one whose sequence moved
        self._equal = dict.fromkeys(live.stuck, 1)
        self._before: Mapping[str, Any] = {}

    def look(self, seen: ReadSample) -> None:
        """Look at a sample, in the thread of the link."""
        first, last = self._first or seen, self._last or seen
        self._first = first
        self._pauses.look(seen.paused, seen.stops, seen.aborted)
        if seen.aborts != first.aborts or (seen.part != first.part and not self._live.shadow):
            if self._forwarding.trip is None or not self._forwarding.trip.by:
                self._forwarding.helped_itself(seen.aborted or f"part {seen.part} was begun on it", seen.at)
            return
        if seen.sequence < last.sequence:
            self._forwarding.ask("the machine was restarted: the sequence of its samples went back", "runner")
        elif seen.sequence != last.sequence or seen.done or self._last is None:
            self._last = seen
        elif seen.at - last.at > self._stale * NANOSECONDS:
            self._forwarding.ask(self._old, "runner")
        if seen.spread > self._stale:
            self._forwarding.ask(
                f"measurements are stale: those of one list are {seen.spread:g} s apart", "runner"
            )

    def age(self, now: int) -> None:
        """Look at the age of the last sample, also while none arrives."""
        last = self._last
        if last is not None and not last.done and now - last.at > self._stale * NANOSECONDS:
            self._forwarding.ask(self._old, "runner")

    def stuck(self, reading: Mapping[str, Any], command: Mapping[str, Any]) -> None:
        """Count equal readings in a row while the machine is commanded."""
        for name, most in self._live.stuck.items():
            same = bool(command) and reading[name] == self._before.get(name)
            self._equal[name] = self._equal[name] + 1 if same else 1
            if self._equal[name] >= most:
                self._forwarding.ask(f"{name} is stuck: {most} equal readings in a row", "runner")
        self._before = reading
