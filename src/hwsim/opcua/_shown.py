"""What a machine with its own time shows: its thread takes samples, the server's thread shows the newest."""

import asyncio
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from math import nan
from typing import Any

from hwsim.opcua._course import ShownSample
from hwsim.opcua._produced import Produced
from hwsim.opcua._sample import plain
from hwsim.opcua._space import Space


class Shown:
    """The newest sample on its way to the variables of the server."""

    def __init__(self, space: Space, produced: Produced) -> None:
        self.produced = produced
        self._space, self._loop = space, asyncio.get_running_loop()
        self._newest: ShownSample | None = None
        self._order = asyncio.Lock()
        self._part, self._ended = 0, 0

    def reading(self, reading: Mapping[str, Any]) -> None:
        """Show measurements before the first part; in the server's thread."""
        self._loop.create_task(self._measured(reading, datetime.now(UTC)))

    def show(self, sample: ShownSample, slip: float) -> None:
        """Show a sample; in the thread of the machine."""
        self._newest, self.produced.slip = sample, slip
        self._loop.call_soon_threadsafe(self._begin)

    def _begin(self) -> None:
        self._task = self._loop.create_task(self._show_newest())

    async def settled(self) -> None:
        """Wait until what was to be shown stands there."""
        async with self._order:  # those who wait for it have it in the order in which they came
            return

    async def _show_newest(self) -> None:
        async with self._order:
            sample, self._newest = self._newest, None
            if sample is not None:
                await self._show(sample)

    async def _show(self, sample: ShownSample) -> None:
        if sample.cut:
            self._space.cut_connections()
        now = datetime.now(UTC) + timedelta(seconds=sample.shift)
        if sample.part != self._part:
            self._part = sample.part
            await self.produced.begun(sample.part)
            for path in self._space.commands:  # those of the part before
                await self._space.show(path, nan, now)
        await self._measured(sample.reading, now)
        for name, value in sample.held.items():
            await self._space.show(f"Commands.{name}", plain(value), now)
        for name in ("sequence", "time", "event"):
            await self._space.show(f"Part.{name}", getattr(sample, name), now)
        if sample.outcome is not None and self._ended != sample.part:
            self._ended = sample.part
            if sample.latched:
                await self.produced.aborted(sample.outcome, sample.latched)
            else:
                await self.produced.finished(sample.outcome)

    async def _measured(self, reading: Mapping[str, Any], now: datetime) -> None:
        for name, value in reading.items():
            await self._space.show(f"Monitoring.{name}", plain(value), now)
