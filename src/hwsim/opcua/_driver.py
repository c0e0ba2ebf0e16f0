"""What the desk of a server needs of the machine behind it."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

Answer = tuple[list[float], int, bool, bool, str]
"""Measurements, time in ticks, event, done, why the machine refused the command."""


class Refused(Exception):  # noqa: N818  an answer to a client
    """The machine does not do what it is told now; its text says why."""


class Driver(Protocol):
    """The machine of a server; all of it is called in the thread of the server."""

    async def start(self, part: int, seed: str) -> None:
        """Start a part; `Refused` where none may be started."""

    async def advance(self, values: Sequence[float], ticks: int) -> Answer:
        """Take commands and advance, in lockstep; `Refused` on a machine with its own time."""

    async def take(self, command: Mapping[str, Any]) -> None:
        """Take commands on a machine with its own time; `Refused` where it does not."""

    def beat(self, count: int) -> None:
        """Note the heartbeat of the operator."""

    async def pause(self, paused: bool) -> None:
        """Begin no part, or go on."""

    async def abort(self, reason: str) -> None:
        """Make the machine safe and latch it."""

    async def reset(self) -> None:
        """Forget a part that is over; `Refused` while it is under way."""

    def close(self) -> None:
        """End the part."""
