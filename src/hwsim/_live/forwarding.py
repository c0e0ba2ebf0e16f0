"""Which commands reach a machine: new ones while they are young, then the safe one, then nothing."""

from collections import deque
from collections.abc import Mapping
from math import isfinite, nan
from typing import Any, Final, NamedTuple

import numpy as np

POLL: Final = 0.002
"""Time between two polls, s; chosen: a tenth of the shortest useful deadline, 1 to 2 % of a core."""


class Trip(NamedTuple):
    """Why, by whom and how fast a machine was made safe."""

    reason: str
    by: str  # "runner", "link", "gate", "machine"; "": not known to be safe
    delay: float  # s from the last sign of life of the controller; NaN: not known to be safe


class Forwarding:
    """Commands of one part on their way to the machine; times are monotonic, ns.

    The thread of the controller hands over and renews; one other thread polls and writes what `poll` returns.
    After the safe command the part is latched: nothing follows it. `by`: who polls; `handed`:
    commands so far.
    """

    def __init__(self, safe: Mapping[str, Any], deadline: int, now: int, by: str = "link") -> None:
        self.trip: Trip | None = None
        self.by, self.handed = by, 0
        self.waits = False  # whether the controller's thread waits for the machine, and is in no step
        self._safe, self._deadline, self._life = dict(safe), deadline, now
        self._waiting: deque[tuple[int, Mapping[str, Any]]] = deque()  # ns when it was handed over
        self._asked: tuple[str, str] | None = None

    def hand(self, command: Mapping[str, Any], now: int) -> None:
        """Hand over changed commands; a step beyond the deadline asks for the safe command instead."""
        late = self._late(now)
        if command:  # else it is a sign of life alone, which never is too old to be sent
            self._waiting.append((now, command))
        if not late:
            self._life = now
        self.handed += 1  # last: who reads it finds the command

    def _late(self, now: int) -> bool:
        """Ask for the safe command after a silence: who polls may have slept as long, and have seen none."""
        if late := now - self._life > self._deadline:
            self.ask(self._silence(), self.by)
        return late

    def _silence(self) -> str:
        return f"no sign of the controller for more than {self._deadline / 1e6:g} ms"

    def look(self) -> None:
        """Take in what was handed over in another process; here there is none."""

    def renew(self, now: int) -> None:
        """Say that the controller is alive: it waits for its release or for an event."""
        self._life = now

    def ask(self, reason: str, by: str) -> None:
        """Ask for the safe command; the first reason counts."""
        self._asked = self._asked or (reason, by)

    def told(self, reason: str, by: str, now: int) -> None:
        """Note that nothing is written any more: the machine is safe without this link, or "" not known."""
        if self.trip is None:
            self.trip = Trip(reason, by, (now - self._life) / 1e9 if by else nan)

    def lost(self, reason: str, now: int) -> None:
        """Note that a safe command does not arrive: nobody here knows what the machine does."""
        if self.trip is None:
            self.told(reason, "", now)
        elif self.trip.by != "machine":
            told = self.trip.reason
            self.trip = Trip(told if reason in told else f"{told}; {reason}", "", nan)  # two may tell it

    def helped_itself(self, said: str, now: int) -> None:
        """Note that the machine was seen to have made itself safe."""
        reason = f"the machine made itself safe: {said}"
        if self.trip is None:
            self.told(reason, "machine", now)
        elif self.trip.by != "machine":
            self.trip = Trip(f"{self.trip.reason}; {reason}", "machine", (now - self._life) / 1e9)

    def refused(self, error: Exception) -> None:
        """Note that the machine did not take the safe command."""
        assert self.trip is not None
        self.trip = Trip(f"{self.trip.reason}; the safe command was refused: {error}", "", nan)

    def alive(self, now: int) -> bool:
        """Whether a heartbeat may be sent: the controller was heard within the deadline, nothing tripped."""
        return self.trip is None and self._asked is None and now - self._life <= self._deadline

    def poll(self, now: int) -> Mapping[str, Any]:
        """Return what to write now: changed commands, once the safe command, or nothing."""
        if self.trip is not None:
            return {}
        if now - self._life > self._deadline:
            slow = ", which waited: not its step but this computer was slow" if self.waits else ""
            self.ask(self._silence() + slow, self.by)
        command: dict[str, Any] = {}
        while self._waiting and self._asked is None:
            handed, changes = self._waiting.popleft()
            self._refuse_old(now - handed)
            command |= changes
        if odd := [name for name, value in command.items() if not _finite(value)]:
            self.ask(f"{odd[0]} must be a finite number; got {command[odd[0]]!r}", self.by)
        if self._asked is None:
            return command
        self.trip = Trip(*self._asked, (now - self._life) / 1e9)
        return self._safe

    def _refuse_old(self, age: int) -> None:
        """Ask for the safe command where a command is older (ns) than the deadline: the link held it up."""
        if age > self._deadline:
            limit = f"longer than the deadline of {self._deadline / 1e6:g} ms"
            self.ask(f"a command waited {age / 1e6:.0f} ms for the link, {limit}", self.by)


def _finite(value: Any) -> bool:
    if isinstance(value, float | int):
        return isfinite(value)
    numbers = np.asarray(value)
    return numbers.dtype.kind in "fiu" and bool(np.isfinite(numbers).all())
