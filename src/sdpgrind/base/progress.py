"""Progress of long work: one line on a terminal, silent everywhere else."""

import sys
import time
from typing import Protocol, TextIO


class Progress(Protocol):
    """What long work tells about itself: a callable taking the share done (0..1) and a short text."""

    def __call__(self, share: float, text: str) -> None:
        """Take note that `share` (0..1) of the work called `text` is done."""


class TerminalLine:
    """Redraw one line on a terminal, once the work has lasted `patience` seconds.

    Parameters
    ----------
    stream : file, optional
        Where to write; standard error by default. Nothing is written when it is not a terminal.
    patience : float
        Seconds of silence, so that quick work stays quiet.
    """

    def __init__(self, stream: TextIO | None = None, patience: float = 1.0) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._begin = time.monotonic()
        self._patience = patience
        self._shown = False

    def __call__(self, share: float, text: str) -> None:
        """Show `share` (0..1) and `text`."""
        if not self._stream.isatty() or time.monotonic() - self._begin < self._patience:
            return
        self._shown = True
        self._stream.write(f"\r\x1b[K{100 * share:3.0f} % {text}")
        if share >= 1:
            self._stream.write("\r\x1b[K")
        self._stream.flush()


def silent(share: float, text: str) -> None:
    """Show nothing."""
