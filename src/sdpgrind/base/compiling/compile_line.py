"""Progress of compiling; numba itself is silent, for up to half a minute at a first use.

It speaks through the progress that was given to the verb under way. Where none was, it has a line of its own
on standard error, also in a pipe. Kernels are counted up; how many are to come is not known.
"""

import math
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any, TextIO

from numba.core.event import Listener, register

from sdpgrind.base.progress import Progress, Speaker, compile_time, current, reported, unasked

_PATIENCE = 2.0  # silent compiling, s; chosen: a longer silence looks like a fault


class CompileLine(Speaker):
    """A line without a share, for compiling that nobody asked to hear of.

    `compiled`: seconds of compiling before; `spoken`: time of the last line.
    """

    def __init__(self, stream: TextIO, compiled: float, spoken: float) -> None:
        super().__init__(stream)
        self._patience = max(0.0, _PATIENCE - compiled, spoken + self._every - time.monotonic())

    def line(self) -> str:
        """Return the line: who speaks, and of what."""
        return f"sdpgrind: {self._text}"


class Compiling(Listener):
    """Listens to numba's compiler and shows its progress."""

    def __init__(self) -> None:
        self.count = 0  # kernels compiled in this process
        self._name = ""  # area whose work it is; "": that of the outermost kernel
        self._area = ""
        self._progress: Progress | None = None
        self._first, self._expected = 0, 1  # kernels at the begin of the area's work, and in it
        self._depth = 0  # kernels compile those that they call
        self._before, self._spoken = compile_time.spent, -math.inf
        self._line: CompileLine | None = None
        self._closing = ExitStack()

    def on_start(self, event: Any) -> None:
        """Tell of a kernel that begins to compile."""
        self._depth += 1  # first: numba tells the end of a kernel whose begin raised, too
        if self._depth == 1:
            self._open(event.data["dispatcher"])
        self._tell(self._text())

    def on_end(self, event: Any) -> None:
        """Count a kernel that is compiled, or failed."""
        self._depth -= 1
        self.count += 1
        if self._depth == 0:
            self._close()
            if self._progress is not None:
                self._tell(f"{self._name}: first use")

    @contextmanager
    def of(self, area: str, progress: Progress | None, kernels: int) -> Iterator[None]:
        """Report compiling in the block, some `kernels`, as work of `area`; None: as if nobody had asked."""
        self._name, self._progress = area, progress
        self._first, self._expected = self.count, kernels
        try:
            with (
                nullcontext() if progress is None else reported(progress)
            ):  # plans in the block are silent then
                yield
        finally:
            self._name, self._progress = "", None

    def _tell(self, text: str) -> None:
        if self._progress is not None:
            self._progress(min((self.count - self._first) / self._expected, 1.0), text)
        elif self._line is not None:
            self._line(0.0, text)
        elif (verb := current()) is not None:
            verb.say(text)

    def _text(self) -> str:
        count = f"{self.count} kernel{'s' if self.count != 1 else ''} so far"
        return f"compiling {self._area}, once on this machine: {count}"

    def _open(self, kernel: Any) -> None:
        """Begin a line where nobody asked for progress; it is silent until one is due."""
        stream = unasked()
        self._area = self._name or _area(kernel)
        if self._progress is None:  # else compiling is the work itself
            compile_time.begin()
        alone = self._progress is None and current() is None
        if alone and _ours(kernel) and stream is not None:
            self._line = CompileLine(stream, compile_time.spent - self._before, self._spoken)
            self._line(0.0, self._text())
            self._closing.enter_context(self._line)

    def _close(self) -> None:
        if compile_time.under_way:
            compile_time.end()
        line, self._line = self._line, None
        self._closing.close()
        if line is not None:
            self._spoken = max(self._spoken, line.spoken)


listener = Compiling()
_listening: list[Compiling] = []


def listen() -> None:
    """Start listening, at the first kernel that is not on disk: a warm start costs nothing."""
    if not _listening:
        _listening.append(listener)
        register("numba:compile", listener)


def _area(kernel: Any) -> str:
    """Return the area of a kernel: ``sdpgrind.locus._trace`` belongs to locus."""
    parts = _module(kernel)
    return parts[1] if parts[0] == "sdpgrind" and len(parts) > 1 else parts[0]


def _ours(kernel: Any) -> bool:
    """Whether a kernel is no function of the user's own, or of numba's."""
    return _module(kernel)[0] in ("sdpgrind", "centering", "hwsim")


def _module(kernel: Any) -> list[str]:
    """Return the words of a kernel's module; one made by `exec` may have none."""
    name: str = kernel.py_func.__module__ or "numba"
    return name.split(".")
