"""What a served machine tells of its parts: number, outcomes, why the last one was aborted."""

import json
from collections import deque
from collections.abc import Mapping
from typing import Any

from hwsim.opcua._packing import outcome_text
from hwsim.opcua._space import Space

_KEPT = 64  # outcomes; chosen: a shift of parts
_LONG = 16384  # characters of an outcome in the list; chosen: 64 of them stay below a message of 1 MiB


class Produced:
    """The variables of ``Production`` and the state of the machine."""

    def __init__(self, space: Space) -> None:
        self.part, self.parts, self.aborts, self.stops = 0, 0, 0, 0
        self.asked = ""  # why an operator asks for an abort
        self.reason = ""  # why the last part was aborted
        self.slip = 0.0  # s by which the time of the machine lags behind
        self._space, self._paused = space, False
        self._kept: deque[str] = deque(maxlen=_KEPT)

    async def begun(self, part: int) -> None:
        """Tell that a part was begun."""
        self.part, self.reason = part, ""
        await self._show(part=part, aborted="", refused="")
        await self._space.show("Part.done", False)
        await self._space.show("MachineryItemState", "Executing")

    async def finished(self, outcome: Mapping[str, Any]) -> None:
        """Tell that a part is finished."""
        self.parts += 1
        await self._ended(outcome, 0.0)
        await self._show(parts=self.parts)
        await self._space.show("Part.done", True)

    async def aborted(self, outcome: Mapping[str, Any], reason: str) -> None:
        """Tell that a part was aborted and the machine made safe."""
        self.aborts += 1
        self.reason = reason
        await self._ended(outcome, 1.0)
        await self._show(aborted=reason, aborts=self.aborts)
        await self.stopped()  # last: who sees that it was asked for sees that it was done
        await self._space.show("MachineryItemState", "OutOfService")

    async def _ended(self, outcome: Mapping[str, Any], aborted: float) -> None:
        text = json.dumps(
            {"part": self.part, "aborted": aborted, "outcome": json.loads(outcome_text(outcome))}
        )
        self._kept.append(text if len(text) <= _LONG else json.dumps({"part": self.part, "aborted": aborted}))
        await self._show(outcome=text, outcomes=list(self._kept))
        await self._space.show("MachineryItemState", "NotExecuting")

    async def stopped(self) -> None:
        """Tell that an operator asked for an abort, unless it was told with the part that was aborted."""
        if self.asked:
            self.stops, said, self.asked = self.stops + 1, self.asked, ""
            await self._show(stops=self.stops, aborted=said)

    async def hold(self, paused: bool) -> None:
        """Tell that no part is begun, or that the machine goes on."""
        self._paused = paused
        await self._show(paused=paused)

    @property
    def paused(self) -> bool:
        """Whether no part is begun."""
        return self._paused

    def state(self) -> dict[str, Any]:
        """State of the machine for the program that serves it."""
        parts = {"part": self.part, "parts": self.parts, "aborts": self.aborts}
        return {**parts, "aborted": self.reason, "paused": self._paused, "slip": self.slip}

    async def _show(self, **values: Any) -> None:
        for name, value in values.items():
            await self._space.show(f"Production.{name}", value)
