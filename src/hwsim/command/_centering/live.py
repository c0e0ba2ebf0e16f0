"""Live view of a cycle: the centre on a log-polar chart of plain text, on a terminal only."""

import copy
import functools
import sys
import time
from collections.abc import Callable, Mapping
from math import cos, isfinite, log10, pi, sin
from typing import Any, TextIO

from centering import CenteringProblem
from centering.cycle import CycleState
from sdpgrind.base.units import UM

_ROWS, _COLUMNS = 21, 43  # chosen: a character is about twice as high as wide
_SPARE = 0.5  # decades from the middle to the tolerance; chosen: a ring of a few characters
_DOTS = 240  # in a circle; chosen: no gap at the edge of the chart
_FRAME = 0.1  # machine time between frames, s; chosen: more frames flicker


class Chart:
    """Centre of a part on a log-polar chart: rings of dots at decades, of ``o`` at the tolerance.

    Digits: the centre before push 1, 2, ...; ``@``: the current centre.
    """

    def __init__(self, tolerance: float, offset_max: float) -> None:
        self._low = log10(tolerance) - _SPARE
        self._span = log10(offset_max) - self._low
        self._paper = [[" "] * _COLUMNS for _ in range(_ROWS)]
        decade = -6
        while decade <= log10(offset_max):
            self._circle(10.0**decade, ".")
            decade += 1
        self._circle(offset_max, ".")
        self._circle(tolerance, "o")
        self._mark(0.0, 0.0, "+")

    def drawn(self, places: list[tuple[float, float]]) -> list[str]:
        """Lines of the chart with centres (mm, rad), the last one current."""
        paper = self._paper
        self._paper = [row.copy() for row in paper]
        for k, (offset, angle) in enumerate(places[:-1], 1):
            self._mark(offset, angle, str(k % 10))
        if places:
            self._mark(*places[-1], "@")
        lines, self._paper = ["".join(row).rstrip() for row in self._paper], paper
        return lines

    def _circle(self, offset: float, sign: str) -> None:
        if log10(offset) > self._low:
            for k in range(_DOTS):
                self._mark(offset, 2 * pi * k / _DOTS, sign)

    def _mark(self, offset: float, angle: float, sign: str) -> None:
        share = 0.0 if offset <= 0.0 else (log10(offset) - self._low) / self._span
        r = min(max(share, 0.0), 1.0)
        row = round((_ROWS - 1) / 2 * (1 - r * sin(angle)))
        self._paper[row][round((_COLUMNS - 1) / 2 * (1 + r * cos(angle)))] = sign


class LiveView:
    """Show the reports of a controller in the time of the machine, on a terminal only.

    `stream` is standard error by default; `wait` waits for a time, s.
    """

    def __init__(
        self,
        problem: CenteringProblem,
        stream: TextIO | None = None,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._chart = Chart(problem.tolerance, problem.offset_max)
        self._wait = wait
        self._tall = 0  # lines of the last frame
        self._begin()

    def _begin(self) -> None:
        """Begin a part."""
        self._shown, self._start = -1.0, time.monotonic()
        self._pushes, self._places = 0, list[tuple[float, float]]()

    def __call__(self, now: float, report: Mapping[str, float]) -> None:
        """Show a report at a time of the part (s)."""
        if not self._stream.isatty():
            return
        if now < self._shown:
            self._begin()
        self._note(report)
        state = CycleState(int(report["state"]))
        if self._shown < 0.0 or now - self._shown >= _FRAME or state.over:
            self._shown = now
            self._frame(now, state, report)

    def _note(self, report: Mapping[str, float]) -> None:
        """Note the centre, and whether it was pushed."""
        offset, angle = report.get("offset", float("nan")), report.get("offset_angle", float("nan"))
        if not (isfinite(offset) and isfinite(angle)):
            return
        moved = int(report["pushes"]) != self._pushes
        self._pushes = int(report["pushes"])
        if moved or not self._places:
            self._places.append((offset, angle))
        self._places[-1] = offset, angle

    def _frame(self, now: float, state: CycleState, report: Mapping[str, float]) -> None:
        """Redraw, not before the machine's time."""
        if (early := self._start + now - time.monotonic()) > 0.0:
            self._wait(early)
        offset = f"{UM * self._places[-1][0]:10.2f} µm" if self._places else "not known yet"
        told = f"{now:6.2f} s  {state.name.lower():9} push {self._pushes:2d}  offset {offset}"
        lines = [*self._chart.drawn(self._places), told]
        up = f"\x1b[{self._tall}A" if self._tall else ""
        self._stream.write("\r" + up + "".join(f"{line}\x1b[K\n" for line in lines))
        self._stream.flush()
        self._tall = len(lines)


def watched(controller: Any, view: LiveView) -> Any:
    """Return the same controller with its reports shown; logs and journals see the original class."""
    kind = type(controller)

    @functools.wraps(kind.step)
    def step(self: Any, **measured: Any) -> Any:
        command = kind.step(self, **measured)
        view(measured["time"], self.report())
        return command

    names = {
        "step": step,
        "__module__": kind.__module__,
        "__qualname__": kind.__qualname__,
        "__doc__": kind.__doc__,
    }
    seen = copy.copy(controller)
    seen.__class__ = type(kind.__name__, (kind,), names)
    return seen
