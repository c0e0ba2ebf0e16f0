"""The gate as its runner has it: a process that holds the only session that writes, and a part behind it."""

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any, Final, NoReturn

from hwsim._live.forwarding import POLL
from hwsim._live.live import Live
from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._gate_rules import RECORD, GateAnswer, GatedForwarding
from hwsim.opcua._link import CONNECTING, ClientLink
from hwsim.opcua._live_part import RemotePart
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._pulse import Pulse
from hwsim.opcua._slots import Slots, mapped, shared

_OPENING: Final = 60.0  # s; chosen: imports take 2 s, on a busy computer ten times as long
_CLOSING: Final = 10.0  # s; chosen: the gate waits 2 s for a machine that does not answer
_SOURCE = Path(__file__).parents[2]  # where this package was found, for the other process
_ERRORS: Final = {
    each.__name__: each for each in (ConnectionError, PermissionError, TimeoutError, ValueError)
}


class Gate:
    """A process with a session of its own; it ends with this one."""

    def __init__(self, link: ClientLink, nodes: Any) -> None:
        memory = shared(2 * RECORD)
        whole = mapped(memory, 2 * RECORD)
        self.handed, self.answers = Slots(whole[:RECORD]), Slots(whole[RECORD:])
        self._line, other = socket.socketpair()
        try:
            self._process = _started(memory, other.fileno())
        finally:
            other.close()
            os.close(memory)
        user = None if link.user is None else list(link.user)
        try:
            told = self._ask(
                _OPENING, act="open", url=link.url, security=link.security, user=user, nodes=nodes
            )
        except BaseException:
            self.close()
            raise
        self.declaration = Declaration.from_json(told)

    @property
    def alive(self) -> bool:
        """Whether its process runs."""
        return self._process.poll() is None

    def begin(self, part: int, seed: str, live: Live, names: tuple[str, ...]) -> None:
        """Start a part."""
        self._ask(
            2 * CONNECTING,
            act="begin",
            part=part,
            seed=seed,
            safe=live.safe,
            deadline=live.deadline,
            names=names,
        )

    def end(self) -> None:
        """End the part; a gate that does not answer is ended."""
        try:
            self._ask(CONNECTING, act="end")
        except (OSError, RuntimeError):
            self.close()

    def _ask(self, seconds: float, **asked: Any) -> Any:
        """Send a line and wait for the answer."""
        self._line.settimeout(seconds)
        try:
            self._line.sendall(json.dumps(asked).encode() + b"\n")
            told = b""
            while not told.endswith(b"\n"):
                more = self._line.recv(1 << 16)
                if not more:
                    raise ConnectionError("it has ended")
                told += more
        except OSError as error:
            raise ConnectionError(f"the gate's process does not answer: {error}") from None
        kind, value = json.loads(told)
        return value if not kind else _raised(kind, value)

    def close(self) -> None:
        """End the process; a part under way is made safe."""
        self._line.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_CLOSING)
            return
        self._process.kill()
        self._process.wait()


def _raised(kind: str, text: str) -> NoReturn:
    """Raise an error of the gate's process here."""
    if kind in _ERRORS:
        raise _ERRORS[kind](text)
    raise RuntimeError(f"the gate's process failed: {kind}: {text}")


def _started(memory: int, line: int) -> "subprocess.Popen[bytes]":
    """Start the process: a fresh interpreter, which imports nothing of the user's program."""
    path = os.pathsep.join([str(_SOURCE), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "hwsim.opcua._gate_process", str(memory), str(line), str(os.getpid())]
    return subprocess.Popen(
        command,
        pass_fds=(memory, line),
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
    )


def gate_of(remote: RemoteMachine, told: Declaration) -> Gate:
    """The gate of a machine; it is started where there is none."""
    link = remote.link
    if link.gate is not None and not link.gate.alive:
        link.close_gate()
    if link.gate is None:
        link.connect()  # the session before may have commanded, and only one does
        link.gate = gate = Gate(link, remote.table)
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
        self._gate, self._gated = gate, forwarding
        super().__init__(remote, names, forwarding, live.deadline, events, heard)

    def _works(self) -> list[Coroutine[Any, Any, None]]:
        return [self._follow(), self._read()]

    async def _follow(self) -> None:
        """Take in the answers of the gate."""
        while not self._over and self._gated.trip is None:
            content = self._gate.answers.read()
            if content is not None:
                self._take_in(GateAnswer.unpacked(content))
            elif not self._gate.alive:
                self._gated.told("the gate's process has ended", "machine", time.monotonic_ns())
            self._heard()
            await self._woken.wait(POLL)
        self.safe_written = self._gated.trip is not None
        self._heard()

    def _take_in(self, answer: GateAnswer) -> None:
        if answer.part != self._gated.part:  # one before
            return
        self.taken = answer.taken
        if answer.refusal is not None:
            self.refusal = ValueError(answer.refusal)
        if answer.trip is not None:
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
