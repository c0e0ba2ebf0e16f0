"""Pause, resume and abort at the machine reach the run, also between two parts."""

import asyncio

from hwsim._live.live import Live
from hwsim.opcua._machine import RemoteMachine

_LOOK = 0.1  # s; chosen: below what an operator notices


class Pauses:
    """The operator at the machine, and the run of a client."""

    def __init__(self, remote: RemoteMachine, live: Live, stops: int) -> None:
        self._remote, self._live, self._stops = remote, live, stops
        self._task: asyncio.Task[None] | None = None

    def look(self, paused: bool, stops: int, reason: str) -> None:
        """Look at what the machine says, in the thread of the link."""
        if stops != self._stops and self._live.reason is None:
            self._live.abort(reason or "asked at the machine", who="machine")
        self._stops = stops
        if paused and (self._task is None or self._task.done()):
            self._live.pause(who="machine")
            self._task = asyncio.get_running_loop().create_task(self._until_resumed())

    async def _until_resumed(self) -> None:
        paused = True
        while paused and self._live.reason is None:
            await asyncio.sleep(_LOOK)
            try:
                paused, stops, reason = await self._remote.operator()
            except (OSError, ValueError):  # cut, or not answered as it should be
                return
            if stops != self._stops:
                self._live.abort(reason or "asked at the machine", who="machine")
                return
        self._live.resume(who="machine")

    async def begin(self) -> None:
        """Look before a part is begun."""
        self.look(*await self._remote.operator())
