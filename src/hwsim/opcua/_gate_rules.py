"""Rules of the gate: what a runner writes for it and it answers, each in a record of shared memory.

The rules are those of the link's thread, `hwsim._live.forwarding`; only how a command gets there differs.
"""

import json
import struct
import threading
from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from hwsim._live.forwarding import Forwarding, Trip
from hwsim.opcua._packing import blocks, unblocked
from hwsim.opcua._slots import Slots

RECORD: Final = 1 << 22  # bytes for two records each way; chosen: a message of 1 MiB, and its names
NOTHING, ASK, OVER = range(3)
"""What a runner wants beside commands: the safe command, or that nothing more is written."""
PART_OVER: Final = "the part is over"  # a reason that breaks nothing off
_HEAD: Final = struct.Struct("<QQqqBH")  # part, number, ns twice, what is wanted, bytes of who and why
_LONGEST = 1000  # characters of a reason; chosen: a line on a screen has less


class Handed(NamedTuple):
    """What a runner tells the gate."""

    part: int
    number: int  # of the command
    time: int  # of the last sign of life, ns
    handed: int = 0  # when the command was handed over, ns
    wanted: int = NOTHING
    by: str = ""
    reason: str = ""
    values: bytes = b""  # of the command, as `_packing.blocks`

    def packed(self) -> bytes:
        """Return the bytes of a record."""
        said = f"{self.by}\n{self.reason[:_LONGEST]}".encode()
        head = self.part, self.number, self.time, self.handed, self.wanted, len(said)
        return _HEAD.pack(*head) + said + self.values

    @classmethod
    def unpacked(cls, content: bytes) -> "Handed":
        """Read the bytes of a record."""
        part, number, at, handed, wanted, length = _HEAD.unpack_from(content)
        end = _HEAD.size + length
        by, _, reason = content[_HEAD.size : end].decode().partition("\n")
        return cls(part, number, at, handed, wanted, by, reason, content[end:])


class GateAnswer(NamedTuple):
    """What the gate tells its runner."""

    part: int
    taken: int  # number of the last command that the machine has taken
    safe_written: bool
    trip: Trip | None
    refusal: str | None

    def packed(self) -> bytes:
        """Return the bytes of a record."""
        return json.dumps(self).encode()

    @classmethod
    def unpacked(cls, content: bytes) -> "GateAnswer":
        """Read the bytes of a record."""
        told = cls(*json.loads(content))
        return told if told.trip is None else told._replace(trip=Trip(*told.trip))


class GateRules(Forwarding):
    """The rules in the process of the gate; `gone`: whether the runner's process has ended."""

    def __init__(
        self,
        safe: Mapping[str, Any],
        deadline: int,
        now: int,
        *,
        part: int,
        names: Sequence[str],
        slots: Slots,
        gone: Callable[[], bool],
    ) -> None:
        super().__init__(safe, deadline, now, by="gate")
        self._part, self._names, self._slots, self._gone = part, names, slots, gone

    def look(self) -> None:
        """Take in the newest record."""
        content = self._slots.read()
        if content is not None and (told := Handed.unpacked(content)).part == self._part:
            self._take_in(told)
        if self._gone():
            self.ask("the runner's process has ended", self.by)

    def _late(self, now: int) -> bool:
        """Leave it to the runner, which knows its signs of life that the gate has not read."""
        return False

    def _take_in(self, told: Handed) -> None:
        if told.number != self.handed:
            self.hand(unblocked(self._names, array("d", told.values)), told.handed)
            self.handed = told.number
        self.renew(told.time)
        if told.wanted == ASK:
            self.ask(told.reason, told.by)
        elif told.wanted == OVER:
            self.told(told.reason, told.by, told.time)


class GatedForwarding(Forwarding):
    """The rules as the runner sees them: what it says is written for the gate, which tells what trips."""

    def __init__(
        self,
        safe: Mapping[str, Any],
        deadline: int,
        now: int,
        *,
        part: int,
        names: Sequence[str],
        slots: Slots,
    ) -> None:
        super().__init__(safe, deadline, now, by="gate")
        self.part, self._names, self._slots = part, names, slots
        self._said = Handed(part, 0, now)
        self._turn = threading.Lock()  # of the threads of this process; the gate waits for none

    def _say(self, **changes: Any) -> None:
        with self._turn:
            said = self._said._replace(**changes)
            self._slots.write(said.packed())  # first: one that is too long is refused, and the next is not
            self._said, self._life = said, said.time

    def hand(self, command: Mapping[str, Any], now: int) -> None:
        """Hand over changed commands; a step beyond the deadline asks for the safe command instead."""
        life = self._said.time if self._late(now) else now
        values = array("d", blocks(self._names, command)).tobytes()
        self.handed += 1
        self._say(number=self.handed, time=life, handed=now, values=values)

    def renew(self, now: int) -> None:
        """Say that the controller is alive."""
        self._say(time=now)

    def ask(self, reason: str, by: str) -> None:
        """Ask for the safe command; the first reason counts."""
        if self._said.wanted == NOTHING:
            self._say(wanted=ASK, reason=reason, by=by)

    def told(self, reason: str, by: str, now: int) -> None:
        """Note that the machine is safe without the gate, or "" not known; it writes nothing any more."""
        if self.trip is None:
            super().told(reason, by, now)
            self._say(wanted=OVER, reason=reason, by=by)

    def lost(self, reason: str, now: int) -> None:
        """Note that the session that reads was cut: the gate has its own, and writes the safe command."""
        self.ask(reason, self.by)

    def over(self) -> None:
        """Say that the part is over: nothing is written any more but a safe command that was asked for."""
        if self._said.wanted == NOTHING:
            self._say(wanted=OVER, reason=PART_OVER, by=self.by)
