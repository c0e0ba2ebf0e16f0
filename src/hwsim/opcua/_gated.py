"""A live part whose commands go through the gate, and what the gate answers."""

import time
from collections.abc import Callable, Coroutine, Mapping
from math import nan
from typing import Any

from hwsim._live.forwarding import POLL, Trip
from hwsim._live.live import Live
from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._gate import Gate
from hwsim.opcua._gate_rules import PART_OVER, GateAnswer, GatedForwarding
from hwsim.opcua._live_part import RemotePart
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._pulse import Pulse


def gate_of(remote: RemoteMachine, told: Declaration) -> Gate:
    """The gate of a machine; it is started where there is none."""
    link = remote.link
    if link.gate is not None and not link.gate.alive:
        link.close_gate()
    if link.gate is None:
        link.connect()  # the session before may have commanded, and only one does
        link.gate = gate = Gate(link.url, link.security, link.user, remote.table)
        if gate.declaration != told:
            link.close_gate()
            raise ValueError(f"the machine at {link.url} is another one for the gate")
    return link.gate


class GateReader(Pulse):
    """Reads samples, and what the gate has written."""

    def __init__(
        self,
        gate: Gate,
        remote: RemoteMachine,
        names: Mapping[str, str],
        forwarding: GatedForwarding,
        live: Live,
        events: bool,
        heard: Callable[[], None],
    ) -> None:
        self._gate, self._gated, self._follower_ended = gate, forwarding, False
        super().__init__(remote, names, forwarding, live.deadline, events, heard)

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._follow(), self._read()]

    async def _failed(self, said: str) -> None:
        """Let the gate write the safe command; without its answers nobody here knows of it."""
        self._gated.ask(said, self._gated.by)
        if self._follower_ended and self._gated.trip is None:
            self._gated.trip = Trip(said, "", nan)
            self.safe_written = True
            self._heard()

    async def _follow(self) -> None:
        """Take in the answers of the gate until the part is over or the machine is safe."""
        try:
            await self._answers()
        finally:
            self._follower_ended = True
        self.safe_written = self._gated.trip is not None
        self._heard()

    async def _answers(self) -> None:
        while not self._over and self._gated.trip is None:
            content = self._gate.answers.read()
            if content is not None:
                self._take_in(GateAnswer.unpacked(content))
            elif not self._gate.alive:
                self._gated.told("the gate's process has ended", "", time.monotonic_ns())
            self._heard()
            await self._woken.wait(POLL)

    def _take_in(self, answer: GateAnswer) -> None:
        if answer.part != self._gated.part:  # one before
            return
        self.taken = answer.taken
        if answer.refusal is not None:
            self.refusal = ValueError(answer.refusal)
        if answer.trip is not None and answer.trip.reason != PART_OVER:
            self._gated.trip = answer.trip


class GatedPart(RemotePart):
    """A live part whose commands go through the gate."""

    def __init__(
        self,
        gate: Gate,
        remote: RemoteMachine,
        told: Declaration,
        names: Mapping[str, str],
        live: Live,
        period: int | None,
        part: int,
        pauses: Pauses,
    ) -> None:
        self._gate, self._closed = gate, False
        super().__init__(remote, told, names, live, period, part, pauses)

    def _rules(self, now: int) -> GatedForwarding:
        deadline = round(self._live.deadline * NANOSECONDS)
        names = tuple(self._told.accepts)
        self._gated = GatedForwarding(
            self._live.safe, deadline, now, part=self.part, names=names, slots=self._gate.handed
        )
        return self._gated

    async def _begun(self, names: Mapping[str, str]) -> Pulse:
        events = self._period is None
        return GateReader(self._gate, self._remote, names, self._gated, self._live, events, self._heard)

    def close(self) -> None:
        """Stop writing, here and in the gate, and reading."""
        if self._closed:
            return
        self._closed = True
        self._gated.over()
        try:
            super().close()
        finally:
            self._gate.end()
