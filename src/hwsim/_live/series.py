"""A run on a machine with a clock: signals, pauses, one part after the other, the safe command first."""

import copy
import gc
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from types import FrameType
from typing import Any

import numpy as np

from hwsim._live import timing
from hwsim._live.live import Aborted, Live
from hwsim._live.machine import LiveMachine, TrippedError
from hwsim._live.prompt import hurry, leave
from hwsim._live.wall import WallMachine, samples_of, take_safe
from hwsim._log.labels import LIVE_COLUMNS, LIVE_PREFIX
from hwsim._part.clock import Clock
from hwsim._part.part import LivePart, PartLoop
from hwsim._part.routes import controllers
from hwsim.protocols import Controller, Machine, Plant
from sdpgrind.base import checks
from sdpgrind.base.warned import warn

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def check_live(live: Live, plant: Plant, controller: Controller) -> None:
    """Refuse a live run whose safe command the plant does not take, or that would log a name twice."""
    _check_safe(live, plant)
    for name in live.stuck:
        if name not in plant.measures:
            raise checks.refuse("stuck", f"of measurements of the plant: {', '.join(plant.measures)}", name)
    if not hasattr(plant, "start_live"):
        _refuse_of_real(live, type(plant).__name__)
    if any(hasattr(each, "tripped") for each in (controller, *controllers(controller).values())):
        raise ValueError(
            "controller must not be a Watchdog in a live run: Live has the safe command and a deadline"
        )
    if twice := [name for name in LIVE_COLUMNS if name in plant.measures]:
        raise ValueError(f"the plant must not measure {twice[0]}, which a live run writes")


def _check_safe(live: Live, plant: Plant) -> None:
    """Refuse a safe command that the plant does not know, or outside a range that it tells."""
    ranges = getattr(plant, "ranges", {})
    for name, value in live.safe.items():
        if name not in plant.accepts:
            raise checks.refuse(
                "safe", f"of commands that the plant accepts: {', '.join(plant.accepts)}", name
            )
        low, high = ranges.get(name, (value, value))
        checks.within(f"safe[{name!r}]", value, low, high, plant.accepts[name])
    own = getattr(plant, "safe", None) or {}
    if not live.shadow and any(live.safe.get(name) != value for name, value in own.items()):
        warn(f"safe differs from the machine's own safe command, {dict(own)}; got {live.safe}")


def _refuse_of_real(live: Live, plant: str) -> None:
    """Refuse on a simulated plant what only a machine with a clock of its own can do."""
    if live.shadow:
        raise ValueError(f"live must not be in shadow on a simulated {plant}: it has no control of its own")
    if live.gate:
        raise ValueError(f"gate must be False on a simulated {plant}, which is in this process")
    if live.stale is not None or live.stuck:
        name = "stuck" if live.stuck else "stale"
        raise ValueError(f"{name} must not be given on a simulated {plant}: its readings never stand still")


@contextmanager
def operated(live: Live) -> Iterator[None]:
    """Begin and end a run; signals that would end the process abort it in between."""
    live.begin()
    former = {}
    if threading.current_thread() is threading.main_thread():
        former = {number: signal.signal(number, _aborting(live)) for number in _SIGNALS}
    with _frozen():
        hurry()
        try:
            yield
        finally:
            leave()
            for number, handler in former.items():
                signal.signal(number, handler)
            live.end()


@contextmanager
def _frozen() -> Iterator[None]:
    """Keep what was imported out of the collector: a full collection takes longer than a step may."""
    if gc.get_freeze_count():  # by the user, whose choice stays
        yield
        return
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _aborting(live: Live) -> Any:
    def handle(number: int, frame: FrameType | None) -> None:
        name = signal.Signals(number).name
        if live.reason is not None and live.tripped:  # safe already, and the controller does not return
            raise KeyboardInterrupt(name)
        live.abort(name, who=name)

    return handle


def rehearse(plant: Plant, controller: Controller, clock: Clock, live: Live) -> None:
    """Try the first step of a part on copies: machine code is loaded before the clock counts."""
    own = copy.deepcopy(controller)
    own.reset()
    if not hasattr(plant, "start_live"):
        loop = PartLoop(plant, plant.start(np.random.default_rng(0)), own, clock)
        loop.try_first_step(advance=True)
        _try_safe(plant, copy.deepcopy(loop.machine), live)
    elif hasattr(plant, "look"):
        with suppress(Exception):  # of readings between two parts, which no part begins with
            PartLoop(plant, _Looked(plant), own, clock).try_first_step()


def _try_safe(plant: Plant, machine: Machine, live: Live) -> None:
    """Refuse a safe command that a simulated machine refuses."""
    try:
        take_safe(machine, live.safe, samples_of(plant))
    except Exception as error:
        raise ValueError(f"safe must be a command that the machine takes at any moment: {error}") from error


class _Looked:
    """A machine that is only measured."""

    time, done, event = 0, False, False

    def __init__(self, plant: Any) -> None:
        self._plant = plant

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        reading: Mapping[str, Any] = self._plant.look()
        return reading

    def outcome(self) -> Mapping[str, Any]:
        return {}


def run_live(
    plant: Plant, controller: Controller, clock: Clock, rng: np.random.Generator, live: Live
) -> LivePart:
    """Run one part against the clock; `Aborted`, with its rows, once the machine is safe."""
    live.tripped = False
    begun = datetime.now(UTC).isoformat(timespec="milliseconds")
    controller.reset()
    machine = _started(plant, controller, clock, rng, live)
    try:
        loop = PartLoop(plant, machine, controller, clock)
        timing.attach(loop, machine)
        try:
            loop.run()
            machine.close()  # a finished part cannot be late any more
            if machine.trip is not None:
                raise TrippedError  # the safe command ended the part
            return _part(plant, loop, machine, begun)
        except BaseException as error:
            machine.make_safe(_reason(error))
            raise _aborted(plant, loop, machine, begun, live) from _cause(error)
    finally:
        machine.close()


def _started(
    plant: Plant, controller: Controller, clock: Clock, rng: np.random.Generator, live: Live
) -> LiveMachine:
    periods = [
        clock.ticks(f"period of {name}", each.period)
        for name, each in controllers(controller).items()
        if each.period is not None
    ]
    period = min(periods, default=None)
    start = getattr(plant, "start_live", None)
    if start is not None:
        machine: LiveMachine = start(rng, live, period)
        return machine
    return WallMachine(plant.start(rng), clock.tick, period, live, samples_of(plant))


def _reason(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".removesuffix(": ")


def _cause(error: BaseException) -> BaseException | None:
    return None if isinstance(error, TrippedError) else error


def _aborted(plant: Plant, loop: PartLoop, machine: LiveMachine, begun: str, live: Live) -> Aborted:
    if machine.taken:
        loop.answered()
    untold = ""
    try:
        part = _part(plant, loop, machine, begun)
    except Exception as error:  # of the machine's outcome; the rows are kept
        part = LivePart(loop.tables(), _figures(plant, loop, machine, begun))
        untold = f"; its outcome cannot be told: {error}"
    return Aborted(_said(machine, live) + untold, part)


def _said(machine: LiveMachine, live: Live) -> str:
    """What became of the part, and of the machine as far as it is known."""
    assert machine.trip is not None  # it was told to be safe, or listened to no longer
    reason, limit = machine.trip.reason, getattr(machine, "watchdog", 0.0)
    number = f"part {live.part} was"
    if live.shadow:
        return f"{number} not listened to until its end: {reason}"
    if machine.trip.by == "machine":
        return f"{number} aborted: {reason}"
    if machine.trip.by:
        return f"{number} aborted and the machine made safe: {reason}"
    within = f" within {limit:g} s" if limit else ", within its own time limit"
    return (
        f"{number} aborted, and it is not known whether the machine is safe: {reason}; "
        f"its own watchdog must make it safe{within}"
    )


def _part(plant: Plant, loop: PartLoop, machine: LiveMachine, begun: str) -> LivePart:
    part = loop.result(finished=machine.trip is None)
    return LivePart(part.tables, {**part.outcome, **_figures(plant, loop, machine, begun)})


def _figures(plant: Plant, loop: PartLoop, machine: LiveMachine, begun: str) -> dict[str, Any]:
    """Figures of the run; where the plant has an outcome of the same name, as ``live_overruns``."""
    own = getattr(plant, "outcomes", {})
    told = timing.outcome(loop, machine, begun)
    return {f"{LIVE_PREFIX}{name}" if name in own else name: value for name, value in told.items()}
