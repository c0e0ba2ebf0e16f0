"""The coroutines of one live part: the only writer, and the reader of samples."""

import asyncio
import time
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from asyncua import ua

from hwsim._live.forwarding import POLL, Forwarding
from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._bell import Bell
from hwsim.opcua._link import reads, writes
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._sample import ReadSample

BEATS = 4  # signs of life a deadline; chosen: one or two may be late
_FEWEST, _MOST = 0.01, 0.05  # s between two reads; chosen: events and aborts are seen within 10 to 50 ms


class Pulse:
    """Writes commands and heartbeats, reads samples; its methods run in the thread of the link."""

    def __init__(
        self,
        remote: RemoteMachine,
        names: Mapping[str, str],
        forwarding: Forwarding,
        deadline: float,
        events: bool,
        heard: Callable[[], None],
    ) -> None:
        self.seen: ReadSample | None = None
        self._first: ReadSample | None = None
        self.refusal: Exception | None = None
        self.taken = self.wanted = self.served = 0
        self.safe_written = False
        self.bad = 0
        self._remote, self._forwarding, self._heard = remote, forwarding, heard
        self._beat_every = round(deadline / BEATS * NANOSECONDS)
        self._read_every = min(max(deadline / 2, _FEWEST), _MOST) if events else _MOST
        self._names = names
        self._list = reads(remote.nodes(names))
        self._count, self._due = 0, 0
        self._woken, self._asked = Bell(), Bell()
        self._over = self._writer_ended = False
        self._tasks = [asyncio.create_task(self._kept(work)) for work in self._works()]

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._write(), self._read()]

    def wake(self) -> None:
        """Write and read at once."""
        self._woken.ring()
        self._asked.ring()

    async def close(self) -> None:
        """Stop; nothing is written any more."""
        self._over = True
        self.wake()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _kept(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a task; whatever error ends it, the machine is made safe."""
        try:
            await work
        except ConnectionError as error:
            self._cut(error)
        except Exception as error:
            await self._failed(f"{type(error).__name__}: {error}")

    async def _failed(self, said: str) -> None:
        """Make the machine safe after an error: the writer does it, or this task where that has ended."""
        self._forwarding.ask(said, self._forwarding.by)
        self._woken.ring()
        if self._writer_ended and not (self.safe_written or self._over):
            await self._last(said)
            self.safe_written = True
            self._heard()

    async def _last(self, said: str) -> None:
        """Write the safe command in place of the writer; where that fails too, nobody knows the machine."""
        now = time.monotonic_ns()
        safe = self._forwarding.poll(now)
        if not safe:  # it was on its way when the writer ended
            self._forwarding.lost(said, now)
            return
        try:
            await self._sent(safe, False)
        except Exception as error:
            self._forwarding.lost(f"{type(error).__name__}: {error}", now)

    async def _write(self) -> None:
        """Write until the part is over or the machine is safe."""
        try:
            await self._forward()
        finally:
            self._writer_ended = True
        self.safe_written = self.safe_written or self._forwarding.trip is not None
        self._heard()

    async def _forward(self) -> None:
        """Forward what is to be written, and the heartbeat while the controller is alive."""
        while not self._over and not self.safe_written:
            self._forwarding.look()
            number, now = self._forwarding.handed, time.monotonic_ns()
            command = self._forwarding.poll(now)
            tripped = self._forwarding.trip is not None
            if tripped and not command:
                break  # made safe elsewhere
            beat = number > 0 and now >= self._due and self._forwarding.alive(now)
            if command or beat:
                await self._sent(command, beat or (bool(command) and not tripped))
            self.taken = number
            self.safe_written = tripped
            self._heard()
            await self._woken.wait(POLL)

    async def _sent(self, command: Mapping[str, Any], beat: bool) -> None:
        """Write a command list."""
        if beat:
            self._count += 1
            self._due = time.monotonic_ns() + self._beat_every
        values = self._remote.written(command, self._count if beat else None)
        states = await self._remote.link.write(writes(values))
        if bad := [state for state in states if state.is_bad()]:
            await self._refused(command, bad[0])

    async def _refused(self, command: Mapping[str, Any], state: ua.StatusCode) -> None:
        """Note why the machine did not take a list."""
        said = await self._remote.refusal(command, state)
        if not said:  # the part ended while the list was on its way
            return
        await self.sample()
        assert self.seen is not None and self._first is not None
        if self.seen.aborts != self._first.aborts:
            self._forwarding.helped_itself(self.seen.aborted, time.monotonic_ns())
        elif self._forwarding.trip is not None:
            self._forwarding.refused(ValueError(said))
        else:
            self.refusal = ValueError(said)

    def _cut(self, error: ConnectionError) -> None:
        """Note a cut link: unless the safe command was written, only the machine's own watchdog is left."""
        if not self.safe_written:
            self._forwarding.lost(str(error), time.monotonic_ns())
        self.safe_written = self.safe_written or (self._writer_ended and self._forwarding.trip is not None)
        self._heard()

    async def _read(self) -> None:
        """Read samples, at once where one is wanted."""
        while not self._over:
            number = self.wanted
            await self.sample()
            self.served = number
            self._heard()
            if self.wanted == number:
                await self._asked.wait(self._read_every)

    async def sample(self) -> None:
        """Read a sample."""
        asked = time.monotonic_ns()
        told = await self._remote.link.read(self._list)
        self.seen = self._remote.seen(self._names, told, asked)
        self._first = self._first or self.seen
