"""A plant that keeps wall time in a thread of its own, with the watchdog of a machine."""

import asyncio
import queue
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np

from hwsim._processor.tasks import NANOSECONDS
from hwsim.opcua._course import PacedPart
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._driver import Answer, Refused
from hwsim.opcua._packing import seeded
from hwsim.opcua._shown import Shown
from hwsim.protocols import Machine, Plant
from sdpgrind.base.rng import Seed, generator

SLICE = 0.01  # s between samples; chosen: half a period of 20 Hz at most, 3 % of a core
_SOONEST = 0.002  # s between looks at a machine; chosen: samples of 500 Hz and more are shown at 100 Hz
_IDLE = 0.05  # s; chosen: what is asked between two parts is done at once all the same


class Paced:
    """The parts of a plant in wall time, one after the other (`Driver`)."""

    def __init__(self, plant: Plant, told: Declaration, shown: Shown, rng: Seed) -> None:
        self._plant: Any = plant
        self._told, self._shown = told, shown
        self._safe: Mapping[str, float] = plant.safe  # type: ignore[attr-defined]  # checked by `serve`
        self._rng = generator(rng)
        self._samples = int(getattr(plant, "sample_ticks", 1))
        self._timeout = round(told.timeout * NANOSECONDS)
        self._course: PacedPart | None = None
        self._number, self._beats, self._beaten = 0, -1, 0
        self._jobs: queue.SimpleQueue[tuple[Future[None], Callable[..., None], tuple[Any, ...]]] = (
            queue.SimpleQueue()
        )
        self._over = threading.Event()
        self._show_first()
        self._thread = threading.Thread(target=self._work, name="hwsim machine", daemon=True)
        self._thread.start()

    def _show_first(self) -> None:
        """Show a part that is not begun; machine code that advances it is loaded on the way."""
        machine = self._plant.start(np.random.default_rng(0))
        self._shown.reading(machine.step({}, 0))
        machine.step({}, self._samples)

    async def start(self, part: int, seed: str) -> None:
        """Start a part."""
        await self._do(self._start, part, seed)

    async def advance(self, values: Sequence[float], ticks: int) -> Answer:
        """Refuse: this machine has its own time."""
        raise Refused("a machine with its own time is not advanced; write its commands")

    async def take(self, command: Mapping[str, Any]) -> None:
        """Take commands."""
        await self._do(self._take, command)

    def beat(self, count: int) -> None:
        """Note a heartbeat that moved."""
        if count != self._beats:
            self._beats, self._beaten = count, time.monotonic_ns()

    async def pause(self, paused: bool) -> None:
        """Begin no part, or go on."""
        await self._shown.produced.hold(paused)

    async def abort(self, reason: str) -> None:
        """Make the machine safe and latch it."""
        await self._do(self._latch, reason)
        await self._shown.settled()

    async def reset(self) -> None:
        """Forget a part that is over."""
        await self._do(self._forget)

    def close(self) -> None:
        """Stop the thread."""
        self._over.set()
        self._thread.join()

    async def _do(self, work: Callable[..., None], *arguments: Any) -> None:
        """Let the thread of the machine do something; it does so to the end, whoever has left meanwhile.

        A client that leaves cancels what waits for its answers: a job that were cancelled with it could not
        be answered, and would end the thread, the watchdog with it.
        """
        done: Future[None] = Future()
        self._jobs.put((done, work, arguments))
        await asyncio.shield(asyncio.wrap_future(done))

    def _work(self) -> None:
        """Thread of the machine."""
        while not self._over.is_set():
            self._wait(min(self._pause_until_next(), self._until_late()))
            self._turn()

    def _pause_until_next(self) -> float:
        if self._course is None or self._course.over:
            return _IDLE
        left = self._course.until_next(time.monotonic_ns())
        return left if not self._course.waiting and _SOONEST <= left < SLICE else SLICE

    def _until_late(self) -> float:
        """Time until the heartbeat is late, s: the watchdog waits for no sample."""
        if self._course is None or self._course.over:
            return _IDLE
        return max(0, self._beaten + self._timeout + 1 - time.monotonic_ns()) / NANOSECONDS

    def _wait(self, seconds: float) -> None:
        """Do what was asked for, for some time."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0 and not self._over.is_set():
            try:
                done, work, arguments = self._jobs.get(timeout=left)
            except queue.Empty:
                return
            try:
                work(*arguments)
                done.set_result(None)
            except BaseException as error:
                done.set_exception(error)

    def _turn(self) -> None:
        """Look at the heartbeat, advance, show."""
        course = self._course
        if course is None or course.over:
            return
        now = time.monotonic_ns()
        self._watch(course, now)
        if self._beats >= 0:
            course.go(now) if not course.begun else None
        while course.advance(now):
            pass
        self._show(course)

    def _watch(self, course: PacedPart, now: int) -> None:
        """Make the machine safe when its operator's heartbeat stands still."""
        if now - self._beaten > self._timeout and not course.over:
            course.latch(self._safe, f"no heartbeat for more than {self._told.timeout:g} s", now)

    def _show(self, course: PacedPart) -> None:
        self._shown.show(course.sample(), course.slip / NANOSECONDS)

    def _start(self, part: int, seed: str) -> None:
        if self._shown.produced.paused:
            raise Refused("the machine is paused: no part is begun")
        if self._course is not None and not self._course.over:
            raise Refused(f"part {self._number} is under way")
        if part <= self._number:
            raise Refused(f"part must be > {self._number}, a new number; got {part}")
        try:
            machine = self._started(seed)
        except ValueError as error:
            raise Refused(str(error)) from None
        self._show(self._begin(part, machine))

    def _started(self, seed: str) -> Machine:
        rng, past = seeded(seed) if seed else (self._rng.spawn(1)[0], [])
        plant = self._plant
        for outcome in past:
            plant = plant.after(outcome)
        machine: Machine = plant.start(rng)
        return machine

    def _begin(self, part: int, machine: Machine) -> PacedPart:
        assert self._told.speed is not None
        self._number, self._beats, self._beaten = part, -1, time.monotonic_ns()
        self._course = PacedPart(part, machine, self._told.tick, self._told.speed, self._samples)
        return self._course

    def _take(self, command: Mapping[str, Any]) -> None:
        course, now = self._course, time.monotonic_ns()
        if course is None:
            raise Refused("a part must be started before it is commanded")
        self._watch(course, now)
        try:
            course.take(command, now)
        except Refused:
            self._show(course)  # first: who is refused looks whether the part is finished
            raise
        if course.over:
            self._show(course)

    def _latch(self, reason: str) -> None:
        if self._course is not None and not self._course.over:
            self._course.latch(self._safe, reason, time.monotonic_ns())
            self._show(self._course)

    def _forget(self) -> None:
        if self._course is not None and not self._course.over:
            raise Refused(f"part {self._number} is under way; Abort ends it")
        self._course = None
