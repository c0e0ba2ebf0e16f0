"""Progress of long work: shares that never fall, for a terminal, a pipe, or a function of the caller.

`reported` makes of the argument ``progress=`` of a verb what the verb calls; kernels that are compiled in the
meantime speak through the same (`current`). Lines that nobody asked for go to `unasked`.
"""

import functools
import logging
import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, ParamSpec, Protocol, Self, TextIO, TypeVar, cast

from sdpgrind.base import checks

EVERY = 9.0  # s between lines in a pipe; chosen: a busy machine still keeps silence below 10 s
_FIRST = 5.0  # s until the first line in a pipe that nobody asked for; chosen: then a user wonders
_REDRAW = 1.0  # s between lines on a terminal without news; chosen: the time left goes on
_LEAST = 0.03  # chosen: share from which on a time left is shown; a smaller one says little

logger = logging.getLogger("sdpgrind")
logger.addHandler(logging.NullHandler())


class Progress(Protocol):
    """Callable with the completed share (0..1) and a short text."""

    def __call__(self, share: float, text: str) -> None:
        """Note that `share` (0..1) of the work `text` is done."""


ProgressOption = Progress | bool | None
"""What ``progress=`` of a verb takes: a callable, True (a line with the time left) or None (the default)."""


class Told:
    """Passes shares that never fall on to `to`; `asked`: whether the user gave it."""

    def __init__(self, to: Progress, *, asked: bool = True) -> None:
        self.share, self.to, self.asked = 0.0, to, asked

    def __call__(self, share: float, text: str) -> None:
        """Note that `share` (0..1) is done."""
        self.share = max(self.share, min(float(share), 1.0))
        self.to(self.share, text)

    def say(self, text: str) -> None:
        """Tell what is being done, without a new share."""
        self.to(self.share, text)


class Portions:
    """Stages of a work, each with its portion of the whole; later stages may become more or fewer."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self._done = progress, 0.0

    def next(self, weight: float, later: float = 0.0) -> Progress:
        """Return the progress of the next stage; `weight` and `later`: work in it, and in all after it."""
        begin = self._done
        self._done += (1.0 - begin) * weight / (weight + later)
        return portion(self._progress, begin, self._done)


def portion(progress: Progress, begin: float, end: float) -> Progress:
    """Return the progress of a stage that lasts from `begin` to `end` (shares of the whole)."""

    def tell(share: float, text: str) -> None:
        progress(begin + (end - begin) * share, text)

    return tell


def unasked() -> TextIO | None:
    """Return the stream of lines that nobody asked for: standard error; None: nobody reads it or wants them.

    ``logging.getLogger("sdpgrind").setLevel("WARNING")`` silences them, as it silences the stages.
    """
    return _read_stream(sys.stderr) if logger.level <= logging.INFO else None


def _read_stream(stream: TextIO | None) -> TextIO | None:
    """Return the stream; None: it is closed, or the process began without it."""
    return None if stream is None or getattr(stream, "closed", False) else stream


class UnaskedLine:
    """A line for long work: on a terminal redrawn after a second, elsewhere printed every few seconds.

    Without a thread, as most plans are short: a step without news is silent.
    """

    def __init__(self) -> None:
        self._stream = unasked()
        self._terminal = self._stream is not None and self._stream.isatty()
        self._due = time.monotonic() + (_REDRAW if self._terminal else _FIRST)

    def __call__(self, share: float, text: str) -> None:
        """Show `share` (0..1) and `text`."""
        if self._stream is None or time.monotonic() < self._due:
            return
        line = f"{100 * share:3.0f} % {text}"
        with suppress(OSError, ValueError):  # nobody reads any more
            if self._terminal:
                redraw(line if share < 1 else "", self._stream)
            else:
                print(line, file=self._stream, flush=True)
                self._due = time.monotonic() + EVERY


class CompileTime:
    """CPU time (s) that compiling beside the work took in this process so far."""

    def __init__(self) -> None:
        self._ended, self._begin = 0.0, -1.0

    def begin(self) -> None:
        """Note that compiling begins."""
        self._begin = time.process_time()

    def end(self) -> None:
        """Note that compiling ends."""
        self._ended, self._begin = self.spent, -1.0

    @property
    def under_way(self) -> bool:
        """Whether something is being compiled now."""
        return self._begin >= 0

    @property
    def spent(self) -> float:
        """Time so far, s."""
        return self._ended + (time.process_time() - self._begin if self.under_way else 0.0)


compile_time = CompileTime()


class Speaker:
    """A line with share, work and seconds left: redrawn on a terminal, printed every few seconds elsewhere.

    A thread repeats it in a long step, so that there is no silence; `every`: seconds between two lines;
    `shown`: False for none; `known`: CPU times (s) that the work and compiling for it are known to take, 0:
    unknown. Known compiling has its part of the share; unknown compiling moves neither share nor time left.
    """

    def __init__(
        self,
        stream: TextIO | None = None,
        every: float | None = None,
        *,
        shown: bool = True,
        known: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._stream = _read_stream(stream if stream is not None else sys.stderr)
        self._terminal = self._stream is not None and self._stream.isatty()
        self._every = every if every is not None else _REDRAW if self._terminal else EVERY
        self.spoken = -math.inf  # time of the last line, s
        self._patience = self._every  # s until the first line
        self._share, self._text, (self._whole, self._compiling) = 0.0, "starting", known
        self._begin, self._before = time.monotonic(), (time.process_time(), compile_time.spent)
        self._at_news = 0.0  # CPU time of the work when the share last changed, s
        self._shown, self._ended = shown and self._stream is not None, threading.Event()
        self._thread = threading.Thread(target=self._repeat, daemon=True)

    def __enter__(self) -> Self:
        if self._shown:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        if self._shown:
            self._thread.join()
            if self._terminal and self.spoken > -math.inf:
                with suppress(OSError, ValueError):  # nobody reads any more
                    redraw("", self._stream)

    def __call__(self, share: float, text: str) -> None:
        """Set `share` (0..1) and `text`."""
        if share != self._share:
            self._at_news = self._worked()
        self._share, self._text = share, text

    def _compiled(self) -> float:
        return compile_time.spent - self._before[1]

    def _worked(self) -> float:
        """CPU time without compiling, s."""
        return time.process_time() - self._before[0] - self._compiled()

    def line(self) -> str:
        """Return the line: share, work, and the time left where it can be told."""
        share, known = self._share, self._compiling
        if known and share < 1:
            share = (share * self._whole + min(self._compiled(), known)) / (self._whole + known)
        told = _LEAST <= share < 1 and (known or not compile_time.under_way)
        seconds = round(self._left()) if told else 0
        left = f"; about {seconds} s to go" if seconds else ""
        return f"{100 * share:3.0f} % {self._text}{left}"

    def _left(self) -> float:
        """Time left, s, by what was needed until the last news; early on by the known times.

        It counts down in a step without news, to 0 where that takes longer than expected. On a machine as
        busy as now. Imports and compiling are no part of the share: 14 s left were told as 95 s.
        """
        share, worked, compiled = self._share, self._worked(), self._compiled()
        pace = (time.monotonic() - self._begin) / max(worked + compiled, 1e-3)
        left = pace * self._at_news * (1 / share - 1) if share else 0.0
        if self._whole:
            left = share * left + (1 - share) ** 2 * self._whole * max(1.0, pace)
        left = max(left - pace * (worked - self._at_news), 0.0)
        return left + max(1.0, pace) * max(self._compiling - compiled, 0.0)

    def _repeat(self) -> None:
        wait = self._patience
        with suppress(OSError, ValueError):  # nobody reads any more
            while not self._ended.wait(wait):
                self._speak()
                wait = self._every

    def _speak(self) -> None:
        self.spoken = time.monotonic()
        if self._terminal:
            redraw(self.line(), self._stream)
        else:
            print(self.line(), file=self._stream, flush=True)


def redraw(text: str, stream: TextIO | None = None) -> None:
    """Replace the line on a terminal; stream None: standard error."""
    stream = sys.stderr if stream is None else stream
    stream.write(f"\r\x1b[K{text}")
    stream.flush()


def silent(share: float, text: str) -> None:
    """Show nothing."""


_current: ContextVar[Told | None] = ContextVar("_current", default=None)


def current() -> Told | None:
    """Return the progress that the user gave to the verb under way; None: he gave none."""
    told = _current.get()
    return told if told is not None and told.asked else None


@contextmanager
def reported(progress: ProgressOption, default: Callable[[], Progress] = UnaskedLine) -> Iterator[Progress]:
    """Make the progress that a verb calls of its argument; `default` makes that of None."""
    if progress is True:
        with Speaker() as line, reported(line) as told:
            yield told
        return
    if progress is not None:
        checks.able(
            "progress", progress, "True, None or a function of the share done (0..1) and a text", "__call__"
        )
    outer = _current.get()
    if progress is None and outer is not None and (outer.to is not silent or default is not UnaskedLine):
        yield Told(silent)  # the verb outside tells
        return
    asked = progress is not None and (outer is None or outer.asked)  # else a verb of ours gave it
    told = Told(default() if progress is None else cast("Progress", progress), asked=asked)
    before = _current.set(told)
    try:
        yield told
    finally:
        _current.reset(before)


_NO_OPTIONS = ("problem", "progress", "executor", "throw")  # arguments that leave a plan as it is
P = ParamSpec("P")
R = TypeVar("R")


def reporting(verb: Callable[P, R]) -> Callable[P, R]:
    """Decorate a verb: its `progress` is then a function; None: a line for long work.

    A plan that it returns remembers the options given to the verb, so that it can be solved again.
    """
    speaking = _with(verb, UnaskedLine)

    @functools.wraps(verb)
    def remembered(*args: P.args, **kwargs: P.kwargs) -> R:
        found = speaking(*args, **kwargs)
        if hasattr(found, "_options"):
            given = {name: value for name, value in kwargs.items() if name not in _NO_OPTIONS}
            options = getattr(found, "_repeat", None) or given
            object.__setattr__(found, "_options", options)  # a plan is frozen
        return found

    return remembered


def quiet(verb: Callable[P, R]) -> Callable[P, R]:
    """Decorate a verb as `reporting` does; None: no progress is shown."""
    return _with(verb, lambda: silent)


def _with(verb: Callable[P, R], default: Callable[[], Progress]) -> Callable[P, R]:
    @functools.wraps(verb)
    def told(*args: P.args, **kwargs: P.kwargs) -> R:
        given: Any = kwargs.get("progress")
        with reported(given, default) as tell:
            begin, name = time.monotonic(), f"{verb.__module__.partition('._')[0]}.{verb.__name__}"
            logger.info("%s begins", name)
            found = verb(*args, **{**kwargs, "progress": tell})  # type: ignore[arg-type]
            logger.info("%s took %.1f s", name, time.monotonic() - begin)
            return found

    return told
