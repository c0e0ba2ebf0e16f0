"""The coroutines of one live part: the only writer, and the reader of samples."""

import asyncio
import time
from collections.abc import Callable, Coroutine, Mapping
from math import nan
from typing import Any, Final, NamedTuple

from asyncua import ua

from hwsim._live.forwarding import POLL, Forwarding
from hwsim._live.releases import NANOSECONDS
from hwsim.opcua._link import reads, writes
from hwsim.opcua._remote import Remote

BEATS = 4  # signs of life a deadline; source: the issue of live runs
_FEWEST, _MOST = 0.01, 0.05  # s between two reads; chosen: events are seen within 10 to 50 ms
_OF_PART: Final = ("Part.sequence", "Part.time", "Part.event", "Part.done")
_OF_MACHINE: Final = (
    "Production.part",
    "Production.aborts",
    "Production.aborted",
    "Production.stops",
    "Production.paused",
)


class Seen(NamedTuple):
    """A sample as this client read it."""

    reading: Mapping[str, Any]
    sequence: int
    time: float  # s
    event: int
    done: bool
    part: int
    aborts: int
    aborted: str
    stops: int
    paused: bool
    at: int  # monotonic, ns
    spread: float  # s between the oldest and the newest source time stamp
    bad: int  # measurements whose quality is not good


class Pulse:
    """Writes commands and heartbeats, reads samples; its methods run in the thread of the link."""

    def __init__(
        self,
        remote: Remote,
        names: Mapping[str, str],
        forwarding: Forwarding,
        deadline: float,
        heard: Callable[[], None],
    ) -> None:
        self.seen: Seen | None = None
        self.refusal: Exception | None = None
        self.handed = self.taken = self.wanted = self.served = 0
        self.safe_written = False
        self.bad = 0
        self._remote, self._forwarding, self._heard = remote, forwarding, heard
        self._beat_every = round(deadline / BEATS * NANOSECONDS)
        self._read_every = min(max(deadline / 2, _FEWEST), _MOST)
        self._names = tuple(names)
        self._list = reads([remote.node_id(path) for path in (*names.values(), *_OF_PART, *_OF_MACHINE)])
        self._count, self._due = 0, 0
        self._woken, self._asked = asyncio.Event(), asyncio.Event()
        self._over = False
        self._tasks = [asyncio.create_task(work) for work in self._works()]

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._write(), self._read()]

    def wake(self) -> None:
        """Write and read at once."""
        self._woken.set()
        self._asked.set()

    async def close(self) -> None:
        """Stop; nothing is written any more."""
        self._over = True
        self.wake()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _write(self) -> None:
        """Forward what is to be written, and the heartbeat while the controller is alive."""
        while not self._over and not self.safe_written:
            number, now = self.handed, time.monotonic_ns()
            command = self._forwarding.poll(now)
            tripped = self._forwarding.trip is not None
            if tripped and not command:
                break  # made safe elsewhere
            beat = number > 0 and now >= self._due and self._forwarding.alive(now)
            try:
                if command or beat:
                    await self._sent(command, beat or (bool(command) and not tripped))
            except ConnectionError as error:
                self._cut(error)
                break
            self.taken = number
            self.safe_written = tripped
            self._heard()
            await _waited(self._woken, POLL)
        self.safe_written = self.safe_written or self._forwarding.trip is not None
        self._heard()

    async def _sent(self, command: Mapping[str, Any], beat: bool) -> None:
        """Write a command list."""
        values = {self._remote.node_id(f"Commands.{name}"): number(value) for name, value in command.items()}
        if beat:
            self._count += 1
            self._due = time.monotonic_ns() + self._beat_every
            heartbeat = self._remote.node_id("Commands.heartbeat")
            values[heartbeat] = ua.Variant(self._count % (1 << 32), ua.VariantType.UInt32)
        states = await self._remote.link.write(writes(values))
        if bad := [state for state in states if state.is_bad()]:
            await self._refused(command, bad[0])

    async def _refused(self, command: Mapping[str, Any], state: ua.StatusCode) -> None:
        """Note why the machine did not take a list."""
        said, done = await self._remote.values("Production.refused", "Part.done")
        if done:  # it ended while the list was on its way
            return
        if state.value != ua.StatusCodes.BadInvalidState or not said:
            said = f"the machine refused {dict(command)!r}: {state.name}"
        self.refusal = ValueError(said)
        if self._forwarding.trip is not None:
            self._forwarding.refused(self.refusal)

    def _cut(self, error: ConnectionError) -> None:
        """Note a cut link: the machine's own watchdog makes it safe."""
        self._forwarding.told(str(error), "machine", time.monotonic_ns())
        self._heard()

    async def _read(self) -> None:
        """Read samples, at once where one is wanted."""
        while not self._over:
            number = self.wanted
            try:
                told = await self._remote.link.read(self._list)
            except ConnectionError as error:
                self._cut(error)
                return
            self.seen = self._sample(told)
            self.served = number
            self._heard()
            if self.wanted == number:
                await _waited(self._asked, self._read_every)

    def _sample(self, told: list[ua.DataValue]) -> Seen:
        measured, rest = told[: len(self._names)], told[len(self._names) :]
        reading = {name: read_number(each) for name, each in zip(self._names, measured, strict=True)}
        stamps = [each.SourceTimestamp for each in measured if each.SourceTimestamp is not None]
        spread = (max(stamps) - min(stamps)).total_seconds() if stamps else 0.0
        bad = sum(not _good(each) for each in measured)
        values = [None if each.Value is None else each.Value.Value for each in rest]
        return Seen(reading, *values, time.monotonic_ns(), spread, bad)


async def _waited(event: asyncio.Event, seconds: float) -> None:
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return
    finally:
        event.clear()


def number(value: Any) -> ua.Variant:
    """A command as a value of OPC UA."""
    from hwsim.opcua._shown import plain

    told = float(value) if isinstance(value, float | int) else plain(value)
    return ua.Variant(told, ua.VariantType.Double, is_array=isinstance(told, list))


def _good(told: ua.DataValue) -> bool:
    return told.Value is not None and (told.StatusCode is None or told.StatusCode.is_good())


def read_number(told: ua.DataValue) -> Any:
    """A measurement: a number or an array; NaN where its quality is not good."""
    return told.Value.Value if _good(told) else nan
