"""A part of a machine with its own control, as a client that only listens follows it."""

import asyncio
import time
import warnings
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from hwsim._live.live import Aborted, Live
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._live_part import RemotePart
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._pulse import Pulse
from hwsim.opcua._sample import ReadSample
from sdpgrind.base.progress import current, logger

_LOOK = 0.01  # s; chosen: below the time between two parts


class Listener(Pulse):
    """Reads samples and writes nothing."""

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._read()]

    async def _failed(self, said: str) -> None:
        """Stop following: nothing is written here."""
        self._forwarding.told(said, "", time.monotonic_ns())
        self._heard()


class ShadowPart(RemotePart):
    """A part that is only listened to."""

    async def _begun(self, names: Mapping[str, str]) -> Pulse:
        deadline, events = self._live.deadline, self._period is None
        return Listener(self._remote, names, self._forwarding, deadline, events, self._heard)

    def _heard(self) -> None:
        if self._live.reason is not None:
            self._forwarding.told(self._live.reason, "", time.monotonic_ns())
        super()._heard()

    def _hand(self, command: Mapping[str, Any], now: int) -> None:
        self.taken = True
        try:
            self._checked(command)
        except (TypeError, ValueError) as error:
            warnings.warn(f"the controller would be refused: {error}", stacklevel=2)

    def _over(self, seen: ReadSample) -> bool:
        return seen.done or seen.part != self.part

    def make_safe(self, reason: str) -> None:
        """Leave the machine to its own control."""
        self._forwarding.told(reason, "", time.monotonic_ns())


def followed(
    remote: RemoteMachine,
    told: Declaration,
    names: Mapping[str, str],
    live: Live,
    period: int | None,
    pauses: Pauses,
) -> ShadowPart:
    """Wait for the beginning of a part and follow it."""
    waiting = "waiting for the machine to begin a part"
    if remote.table is None and not told.own:
        waiting += "; it has no control of its own, so another client must begin one"
    logger.info(waiting)
    if (progress := current()) is not None:
        progress.say(waiting)
    number = remote.link.loop.run(_next_part(remote, lambda: live.reason))
    return ShadowPart(remote, told, names, live, period, number, pauses)


async def _next_part(remote: RemoteMachine, ended: Callable[[], str | None]) -> int:
    before = await remote.last_part()
    while ended() is None:
        part = await remote.last_part()
        if part != before:
            return part
        await asyncio.sleep(_LOOK)
    raise Aborted(f"no part was begun: {ended()}")
