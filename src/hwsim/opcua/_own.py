"""A machine with its own control: it makes one part after the other, and clients only listen."""

import copy
import time
from collections.abc import Mapping
from typing import Any

from hwsim._part.clock import Clock, exact
from hwsim._part.part import PartLoop
from hwsim.opcua._course import PacedPart
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._driver import Refused
from hwsim.opcua._paced import Paced
from hwsim.opcua._shown import Shown
from hwsim.protocols import Controller, Plant
from sdpgrind.base.rng import Seed

_BETWEEN = 0.25  # s between two parts; chosen: a client that reads each 50 ms sees the end and the beginning


class Stopped(Exception):  # noqa: N818  a part that was ended
    """The part was ended from outside."""


class OwnControl(Paced):
    """The parts of a machine under its own controller."""

    def __init__(
        self, plant: Plant, told: Declaration, shown: Shown, rng: Seed, controller: Controller
    ) -> None:
        self._controller = controller
        self._clock = Clock(exact("tick", told.tick))
        super().__init__(plant, told, shown, rng)

    def _start(self, part: int, seed: str) -> None:
        raise Refused("the machine's own control starts its parts")

    def _take(self, command: Mapping[str, Any]) -> None:
        raise Refused("the machine's own control commands it")

    def _work(self) -> None:
        while not self._over.is_set():
            self._wait(_BETWEEN)
            latched = self._course is not None and self._course.latched
            if not (latched or self._shown.produced.paused):
                self._one_part()

    def _one_part(self) -> None:
        """Make a part."""
        machine = self._started("")
        controller = copy.deepcopy(self._controller)
        controller.reset()
        course = self._begin(self._number + 1, machine)
        try:
            PartLoop(self._plant, _OwnPart(self, course), controller, self._clock).run()
        except Stopped:
            return
        except Exception as error:
            self._latch(f"{type(error).__name__}: {error}")
            return
        if hasattr(self._plant, "after"):
            self._plant = self._plant.after(machine.outcome())

    def paced(self, course: PacedPart, command: Mapping[str, Any], ticks: int) -> None:
        """Apply a command, show it, and advance in wall time."""
        course.apply(command, time.monotonic_ns())
        self._show(course)
        limit = course.machine.time + ticks
        while course.machine.time < limit and not course.over:
            self._wait(self._pause_until_next())
            if self._over.is_set() or course.latched:
                raise Stopped
            if course.advance(time.monotonic_ns(), limit=limit):
                break
            self._show(course)
        if course.machine.done:
            self._show(course)


class _OwnPart:
    """A part as its own control sees it (`hwsim.protocols.Machine`)."""

    def __init__(self, control: OwnControl, course: PacedPart) -> None:
        self._control, self._course = control, course

    @property
    def time(self) -> int:
        return self._course.machine.time

    @property
    def done(self) -> bool:
        return self._course.machine.done

    @property
    def event(self) -> bool:
        return self._course.machine.event

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        if ticks:
            self._control.paced(self._course, command, ticks)
        return self._course.reading

    def outcome(self) -> Mapping[str, Any]:
        return self._course.machine.outcome()
