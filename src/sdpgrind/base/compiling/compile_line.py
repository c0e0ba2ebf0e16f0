"""Progress of compiling; numba itself is silent, for up to half a minute at a first use.

The total is the number of kernels reachable from those called so far; it grows with further calls.
"""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.event import Listener, register

from sdpgrind.base.compiling.kernel_digest import reached
from sdpgrind.base.progress import Progress, current, redraw

_PATIENCE = 2.0  # silent compiling, s; chosen: a longer silence looks like a fault


class Compiling(Listener):
    """Listens to numba's compiler and shows its progress; `clock` returns a time, s."""

    def __init__(self, clock: Any = time.monotonic) -> None:
        self.count = 0  # kernels compiled in this process
        self.progress: Progress | None = None
        self.area = ""
        self._clock = clock
        self._kernels: dict[Any, None] = {}
        self._depth = 0  # kernels compile those that they call
        self._begin = self._spent = 0.0

    def on_start(self, event: Any) -> None:
        """Count a kernel that begins to compile."""
        kernel = event.data["dispatcher"]
        if self._depth == 0:
            self._begin = self._clock()
            self._kernels.update(dict.fromkeys(_compiled_apart(kernel)))
        self._depth += 1
        self._tell(kernel)

    def on_end(self, event: Any) -> None:
        """Count a kernel that is compiled, or failed."""
        self._depth -= 1
        self.count += 1
        if self._depth == 0:
            self._spent += self._clock() - self._begin
            if self.progress is not None:
                self.progress(1.0, f"{self.area}: first use")
            elif self._shown:
                redraw("")

    def forget(self) -> None:
        """Restart the count."""
        self._kernels.clear()

    @property
    def _shown(self) -> bool:
        lasted = self._spent + (self._clock() - self._begin if self._depth else 0.0)
        alone = self.progress is None and current() is None
        return alone and lasted > _PATIENCE and sys.stderr.isatty()

    def _tell(self, kernel: Any) -> None:
        verb = current()
        if self.progress is None and verb is None and not self._shown:
            return
        done, total = sum(bool(one.overloads) for one in self._kernels), len(self._kernels)
        text = f"compiling {self.area or _area(kernel)}, once on this machine: {done} of {total}"
        if self.progress is not None:
            self.progress(done / max(total, 1), text)
        elif verb is not None:
            verb.say(text)
        else:
            redraw(text)


listener = Compiling()
_listening: list[Compiling] = []


def listen() -> None:
    """Start listening, at the first kernel that is not on disk: a warm start costs nothing."""
    if not _listening:
        _listening.append(listener)
        register("numba:compile", listener)


@contextmanager
def told(area: str, progress: Progress | None) -> Iterator[None]:
    """Report compiling in the block, as work of `area`, to `progress`; None: a terminal line after 2 s."""
    listener.area, listener.progress = area, progress
    listener.forget()
    try:
        yield
    finally:
        listener.area, listener.progress = "", None


def _compiled_apart(kernel: Any) -> list[Any]:
    """Return the kernels that a kernel needs, itself included, without inlined ones."""
    options = [(one, getattr(one, "targetoptions", None)) for one in reached(kernel)]
    return [one for one, given in options if given is not None and given.get("inline", "never") == "never"]


def _area(kernel: Any) -> str:
    """Return the area of a kernel: ``sdpgrind.locus._trace`` belongs to locus."""
    parts: list[str] = kernel.py_func.__module__.split(".")
    return parts[1] if parts[0] == "sdpgrind" and len(parts) > 1 else parts[0]
