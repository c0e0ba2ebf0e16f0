"""Progress of long work: one line on a terminal, silent elsewhere."""

import sys
import time
from typing import Protocol, TextIO


class Progress(Protocol):
    """Callable with the completed share (0..1) and a short text."""

    def __call__(self, share: float, text: str) -> None:
        """Note that `share` (0..1) of the work `text` is done."""


class TerminalLine:
    """One redrawn line on a terminal, after `patience` seconds of work; `stream` None: standard error."""

    def __init__(self, stream: TextIO | None = None, patience: float = 1.0) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._begin = time.monotonic()
        self._patience = patience

    def __call__(self, share: float, text: str) -> None:
        """Show `share` (0..1) and `text`."""
        if not self._stream.isatty() or time.monotonic() - self._begin < self._patience:
            return
        redraw(f"{100 * share:3.0f} % {text}", self._stream)
        if share >= 1:
            redraw("", self._stream)


def redraw(text: str, stream: TextIO | None = None) -> None:
    """Replace the line on a terminal; stream None: standard error."""
    stream = sys.stderr if stream is None else stream
    stream.write(f"\r\x1b[K{text}")
    stream.flush()


def silent(share: float, text: str) -> None:
    """Show nothing."""
