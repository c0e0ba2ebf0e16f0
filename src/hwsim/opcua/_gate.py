"""The gate as its runner has it: a process that holds the only session that writes."""

import contextlib
import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any, Final, NoReturn

from hwsim._live.live import Live
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._gate_rules import RECORD
from hwsim.opcua._slots import Slots, mapped, shared

_OPENING: Final = 60.0  # s; chosen: imports take 2 s, on a busy computer ten times as long
_BEGINNING: Final = 20.0  # s; chosen: a login of 10 s at most, and the machine begins its part
_ENDING: Final = 5.0  # s; chosen: what is on its way is answered within 2 s, or never
_CLOSING: Final = 10.0  # s; chosen: the gate waits 2 s for a machine that does not answer
_SOURCE = Path(__file__).parents[2]  # where this package was found, for the other process
_ERRORS: Final = {
    each.__name__: each for each in (ConnectionError, PermissionError, TimeoutError, ValueError)
}


class Gate:
    """A process with a session of its own; it ends with this one."""

    def __init__(self, url: str, security: str, user: tuple[str, str] | None, nodes: Any) -> None:
        if os.name != "posix":
            raise ValueError("gate must be False on this system, which hands no descriptors to a process")
        memory = shared(2 * RECORD)
        whole = mapped(memory, 2 * RECORD)
        self.handed, self.answers = Slots(whole[:RECORD]), Slots(whole[RECORD:])
        self._line, other = socket.socketpair()
        try:
            self._process = _started(memory, other.fileno())
        finally:
            other.close()
            os.close(memory)
        try:
            told = self._ask(_OPENING, act="open", url=url, security=security, user=user, nodes=nodes)
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
            _BEGINNING,
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
            self._ask(_ENDING, act="end")
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
            self.close()  # an answer that comes late is not that of the next line
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
        stdout=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
    )
