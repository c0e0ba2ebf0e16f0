"""Exit statuses of commands: one table from exceptions to statuses, one line of text for each."""

import os
import signal
import sys
import tempfile
import threading
import traceback
from argparse import Namespace
from types import FrameType
from typing import Any, Final, TextIO

from hwsim.command._in_words import as_text

OK: Final = 0
FAILED: Final = 1  # chosen: a part broken off or aborted, a page changed, a limit not known to be kept
WRONG_INPUT: Final = 2  # source: argparse; a file that cannot be checked as well
ENVIRONMENT: Final = 3  # chosen: disk, permission, memory, another run, a damaged file
OUR_FAULT: Final = 70  # source: EX_SOFTWARE of sysexits.h
_OF_SIGNALS: Final = 128  # source: a shell adds the number of the signal
INTERRUPTED: Final = int(_OF_SIGNALS + signal.SIGINT)
_CALLBACK = 0.05  # s; chosen: longer than a callback, too short to be felt


class Terminated(BaseException):
    """SIGTERM, as KeyboardInterrupt is SIGINT."""


def of_signal(name: str | None) -> int | None:
    """Exit status of a run that a signal (SIGINT, SIGTERM) aborted; None: it was none."""
    known = {each.name: _OF_SIGNALS + each for each in (signal.SIGINT, signal.SIGTERM)}
    return known.get(name or "")


def catch_signals() -> None:
    """Turn SIGINT and SIGTERM into exceptions, so that files are closed and what began is said."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, _terminate)
    sys.unraisablehook = _send_again


def _send_again(ignored: "sys.UnraisableHookArgs") -> None:
    """Send a signal again that came in a callback of the compiler: Python drops exceptions there."""
    sent = {KeyboardInterrupt: signal.SIGINT, Terminated: signal.SIGTERM}
    if (number := sent.get(ignored.exc_type)) is None:
        sys.__unraisablehook__(ignored)
        return
    again = threading.Timer(_CALLBACK, _signal_main_thread, (number,))
    again.daemon = True
    again.start()


def _signal_main_thread(number: int) -> None:
    """Send the main thread a signal that ends its wait; `_thread.interrupt_main` is heard only after it."""
    if sys.platform == "win32":  # signals there are of the whole process
        signal.raise_signal(number)
        return
    main = threading.main_thread().ident
    assert main is not None
    signal.pthread_kill(main, number)


def ignore_signals() -> None:
    """Let the end of a command be written: a second signal changes nothing any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated


def _table() -> tuple[tuple[type[BaseException], int], ...]:
    """First class that fits -> status; imported here, where something went wrong already."""
    import sqlite3

    from hwsim._live.live import Aborted
    from hwsim._log.journal import SecondWriterError
    from sdpgrind.base.damaged import DamagedFileError

    return (
        (Aborted, FAILED),
        (SecondWriterError, ENVIRONMENT),
        (DamagedFileError, ENVIRONMENT),
        (FileNotFoundError, WRONG_INPUT),
        (FileExistsError, WRONG_INPUT),
        (IsADirectoryError, WRONG_INPUT),
        (NotADirectoryError, WRONG_INPUT),
        (OSError, ENVIRONMENT),
        (sqlite3.Error, ENVIRONMENT),
        (MemoryError, ENVIRONMENT),
        (ImportError, ENVIRONMENT),
        (ValueError, WRONG_INPUT),
        (KeyboardInterrupt, INTERRUPTED),
        (Terminated, _OF_SIGNALS + signal.SIGTERM),
    )


def ended(error: BaseException, arguments: Namespace | None = None) -> int:
    """Say in a line, or one a fault, on standard error what ended a command, and return its exit status."""
    status = next((number for cls, number in _table() if isinstance(error, cls)), OUR_FAULT)
    say(_sentence(error, status, arguments))
    return status


def _sentence(error: BaseException, status: int, arguments: Namespace | None) -> str:
    if isinstance(error, KeyboardInterrupt | Terminated):
        word = "interrupted" if isinstance(error, KeyboardInterrupt) else "terminated"
        return word + _what_stays(arguments)
    if isinstance(error, MemoryError):
        return f"out of memory{f' ({error})' if str(error) else ''}: fewer parts or a coarser grid need less"
    if status == OUR_FAULT:
        return (
            f"a fault of this program, {type(error).__name__}: {_one_line(error)}; "
            f"where it is stands in {_kept(error)}"
        )
    return _one_line(error)


def _what_stays(arguments: Namespace | None) -> str:
    """What an interrupted command leaves: only one that runs parts goes on, from its folder."""
    if not hasattr(arguments, "parts"):
        return ""
    if getattr(arguments, "out", None) is None:
        return "; nothing is kept: with --out DIR the same command goes on from there"
    return "; the same command with the same --out goes on from here"


def _one_line(error: BaseException) -> str:
    notes = ", ".join(getattr(error, "__notes__", []))
    lines = (" ".join(line.split()) for line in str(error).split("\n- "))
    text = "\n- ".join(lines)  # several faults: a line each
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}"  # without the number of the error
    text = as_text(text)
    return f"{text} ({notes})" if notes else text


def _kept(error: BaseException) -> str:
    """Write the traceback to a file and return its path, or that it could not be written."""
    try:
        handle, path = tempfile.mkstemp(prefix="hwsim-fault-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.writelines(traceback.format_exception(error))
    except OSError as refused:
        return f"no file ({refused})"
    return path


def say(text: str) -> None:
    """Print a line on standard error; where nobody reads it, or its disk is full, the work goes on."""
    print_to_end(f"hwsim: {text}\n")


def print_to_end(text: str = "") -> None:
    """Print a text, or the rest of one, on standard error; forget it where that cannot be written."""
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except OSError:
        _forget_output(sys.stderr)


class UnreadOutput:
    """A stream that forgets what is written once its reader has closed it, so that the work goes on.

    A disk that is full is an error at the write and at the flush behind it: argparse catches the first.

    Parameters
    ----------
    stream : file
        Stream that it stands for: standard output.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._lost: OSError | None = None

    def write(self, text: str) -> int:
        """Write a text, or forget it."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            _forget_output(self._stream)
            return len(text)
        except OSError as error:
            self._lose(error)
            raise

    def flush(self) -> None:
        """Write what is kept, or forget it."""
        if self._lost is not None:
            raise self._lost
        try:
            self._stream.flush()
        except BrokenPipeError:
            _forget_output(self._stream)
        except OSError as error:
            self._lose(error)
            raise

    def _lose(self, error: OSError) -> None:
        """Note an error, and let the interpreter close the stream at its end without another one."""
        error.filename = "standard output"
        self._lost = error
        _forget_output(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _forget_output(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that the interpreter does not fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
