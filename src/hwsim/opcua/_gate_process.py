"""The process of the gate: it holds the only session that writes, and looks at the runner each 2 ms.

``python -m hwsim.opcua._gate_process MEMORY SOCKET PID`` is started by `hwsim.opcua._gate`; it imports no
plant and no compiled code. What is not urgent (logins, beginning and end of a part) comes as lines of JSON
over the socket, and is answered by one line.
"""

import contextlib
import gc
import json
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Coroutine, Mapping
from typing import Any, Final

from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._foreign import ForeignMachine, nodes_of
from hwsim.opcua._gate_rules import RECORD, GateAnswer, GateRules
from hwsim.opcua._keys import read_keys
from hwsim.opcua._link import ANSWER, ClientLink
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pulse import Pulse
from hwsim.opcua._remote import Remote
from hwsim.opcua._slots import Slots, mapped

_LOOK: Final = 0.2  # s; chosen: the gate ends within it; the safe command does not wait for it


class RunnerProcess:
    """The process of the runner, watched by its descriptor, or by the parent's id where there is none."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._file: int | None = None
        with contextlib.suppress(AttributeError, OSError):
            self._file = os.pidfd_open(number)

    def gone(self) -> bool:
        """Whether it has ended."""
        if self._file is not None and select.select([self._file], [], [], 0)[0]:
            return True
        return os.getppid() != self._number


class Writer(Pulse):
    """Writes, and reads only to learn why something was refused."""

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._write()]


class GateProcess:
    """Session and rules of the gate."""

    def __init__(self, memory: memoryview, runner: RunnerProcess) -> None:
        half = len(memory) // 2
        self._handed, self._answers = Slots(memory[:half]), Slots(memory[half:])
        self._runner = runner
        self._link: ClientLink | None = None
        self._remote: RemoteMachine | None = None
        self._writer: Writer | None = None
        self._rules: GateRules | None = None
        self._part, self._said = 0, b""

    def answer(self, asked: Mapping[str, Any]) -> Any:
        """Do what a line asks for."""
        acts: Mapping[str, Any] = {"open": self._open, "begin": self._begin, "end": self._end}
        return acts[asked["act"]](**{name: value for name, value in asked.items() if name != "act"})

    def _open(self, url: str, security: str, user: list[str] | None, nodes: Any) -> str:
        """Begin the session."""
        self._link = link = ClientLink(url, read_keys(security), None if user is None else (user[0], user[1]))
        link.connect()
        found: Any = ForeignMachine.found(link, nodes_of(nodes)) if nodes else Remote.found(link)
        self._remote = link.loop.run(found)
        assert self._remote is not None
        gc.collect()
        gc.freeze()  # a full collection takes longer than a poll
        told: Declaration = link.loop.run(self._remote.declaration())
        return told.to_json()

    def _begin(
        self, part: int, seed: str, safe: Mapping[str, float], deadline: float, names: list[str]
    ) -> None:
        """Start a part, and watch over it."""
        assert self._link is not None and self._remote is not None
        self._link.reconnect()
        self._link.loop.run(self._remote.start(part, seed))
        self._part, self._said = part, b""
        self._link.loop.run(self._watch(safe, deadline, names))

    async def _watch(self, safe: Mapping[str, float], deadline: float, names: list[str]) -> None:
        assert self._remote is not None
        now = time.monotonic_ns()
        self._rules = GateRules(
            safe,
            round(deadline * NANOSECONDS),
            now,
            part=self._part,
            names=names,
            slots=self._handed,
            gone=self._runner.gone,
        )
        self._writer = Writer(self._remote, {}, self._rules, deadline, False, self._tell)
        await self._writer.sample()

    def _tell(self) -> None:
        """Tell the runner what is new, in the thread of the link."""
        writer, rules = self._writer, self._rules
        if writer is None or rules is None:
            return
        refusal = None if writer.refusal is None else str(writer.refusal)
        answer = GateAnswer(self._part, writer.taken, writer.safe_written, rules.trip, refusal)
        if (said := answer.packed()) != self._said:
            self._said = said
            self._answers.write(said)

    def _end(self) -> None:
        """End the part: nothing is written any more."""
        if self._writer is not None and self._link is not None:
            self._link.loop.run(self._writer.close(), 2 * ANSWER)
        self._writer = self._rules = None

    def leave(self) -> None:
        """Make the machine safe if a part is under way, and end the session."""
        if self._rules is not None and self._writer is not None and self._link is not None:
            self._rules.ask("the runner has left", self._rules.by)
            until = time.monotonic() + ANSWER
            while not self._writer.safe_written and time.monotonic() < until:
                time.sleep(_LOOK / 10)
        if self._link is not None:
            self._link.close()


def served(gate: GateProcess, runner: RunnerProcess, line: socket.socket) -> None:
    """Answer the lines of the runner until it leaves or ends."""
    line.settimeout(_LOOK)
    waiting = b""
    while not runner.gone():
        try:
            more = line.recv(1 << 16)
        except TimeoutError:
            continue
        if not more:
            return
        waiting += more
        while b"\n" in waiting:
            asked, _, waiting = waiting.partition(b"\n")
            line.sendall(json.dumps(_answered(gate, json.loads(asked))).encode() + b"\n")


def _answered(gate: GateProcess, asked: Mapping[str, Any]) -> list[Any]:
    """What a line is answered: a value, or class and text of an error."""
    try:
        return ["", gate.answer(asked)]
    except Exception as error:
        return [type(error).__name__, str(error)]


def main() -> None:
    """Be the gate of the process that started this one."""
    memory, line, number = (int(each) for each in sys.argv[1:])
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)  # those of the terminal are the runner's
    runner = RunnerProcess(number)
    gate = GateProcess(mapped(memory, 2 * RECORD), runner)
    with contextlib.suppress(OSError):  # the runner is gone
        served(gate, runner, socket.socket(fileno=line))
    with contextlib.suppress(OSError, TimeoutError):  # a machine that does not answer helps itself
        gate.leave()


if __name__ == "__main__":
    main()
