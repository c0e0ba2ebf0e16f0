"""One part of a machine that keeps wall time: physics by ticks, commands at the tick after they came."""

import copy
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from hwsim._live.wall import take_safe
from hwsim._part.clock import exact
from hwsim._processor.tasks import NANOSECONDS
from hwsim.faults._machine import shown_faults
from hwsim.opcua._driver import Refused
from hwsim.protocols import FOREVER, Machine

_LAG = NANOSECONDS // 10  # ns; chosen: a pause of the computer is made up for, a slow plant is not


class ShownSample(NamedTuple):
    """What a machine shows at one moment."""

    part: int
    reading: Mapping[str, Any]
    held: Mapping[str, Any]
    sequence: int
    time: float  # s
    event: int
    done: bool
    latched: str  # why it was made safe; "": it was not
    outcome: Mapping[str, Any] | None  # of a part that has ended
    shift: float = 0.0  # error of its clock, s
    cut: bool = False  # whether its link is cut


class PacedPart:
    """A part in wall time; it is touched by one thread.

    Its time stands still before the first command, and where nothing is under way after an event: a machine
    that waits for its operator.
    """

    def __init__(self, part: int, machine: Machine, tick: float, speed: float, samples: int) -> None:
        self.part, self.machine = part, machine
        self.latched, self.slip = "", 0  # ns
        self.waiting, self.begun = True, False
        self._tick, self._rate = exact("tick", tick), Fraction(speed)
        self._samples = samples  # ticks between samples of the machine's own computer
        self._anchor = 0  # ns at which its time was 0
        self._sequence = self._told = self._events = 0  # samples, number told of them, events
        self._held: dict[str, Any] = {}
        self._fresh: dict[str, Any] = {}  # commands that its computer has not taken yet
        self.reading = machine.step({}, 0)

    @property
    def over(self) -> bool:
        """Whether the part is finished or latched."""
        return self.machine.done or bool(self.latched)

    def go(self, now: int) -> None:
        """Let time run from the present tick."""
        if self.waiting:
            self._anchor = now - self._wall(self.machine.time)
            self.waiting, self.begun = False, True

    def _wall(self, ticks: int) -> int:
        """Wall time (ns) of a number of ticks."""
        return int(ticks * self._tick * NANOSECONDS / self._rate)

    def _due(self, now: int, *, up: bool = False) -> int:
        """Ticks of the machine by now, in whole samples."""
        passed = (now - self._anchor) * self._rate / (NANOSECONDS * self._tick * self._samples)
        return int(-(-passed // 1) if up else passed // 1) * self._samples

    def until_next(self, now: int) -> float:
        """Wall time until its next sample, s; 0 where samples are nearer than a microsecond."""
        nearest = self._wall(self.machine.time + self._samples)
        return max(0, self._anchor + nearest - now) / NANOSECONDS

    def advance(self, now: int, *, up: bool = False, limit: int = FOREVER) -> bool:
        """Advance to the present, or to the next sample; stop at an event. Return whether there was one.

        `limit`: ticks beyond which it does not go.
        """
        if self.waiting or self.over:
            return False
        late = now - self._anchor - self._wall(self.machine.time) - _LAG
        if late > 0:
            self.slip += late
            self._anchor += late
        ticks = min(self._due(now, up=up), limit) - self.machine.time
        if ticks <= 0:
            return False
        self._fresh = {}
        try:
            return self._step(ticks)
        except Exception as error:  # of the user's own plant: the machine's thread and watchdog outlive it
            self.latched = f"the machine failed: {type(error).__name__}: {error}"
            return False

    def _step(self, ticks: int) -> bool:
        """Advance by some ticks, or to an event; return whether there was one."""
        self.reading = self.machine.step({}, ticks)
        if not self.machine.event:
            return False
        self._events += 1
        self.waiting = not self.machine.done and self._idle()
        return True

    def _idle(self) -> bool:
        """Whether nothing is under way: a copy does not move for ever."""
        twin = copy.deepcopy(self.machine)
        before = twin.time
        twin.step({}, FOREVER)
        return twin.time == before and not twin.done

    def take(self, command: Mapping[str, Any], now: int) -> None:
        """Take commands at the next tick; `Refused` with the machine's own sentence."""
        self.advance(now, up=True)
        if self.latched:
            raise Refused(f"the machine was made safe ({self.latched}): it waits for a new part")
        if self.machine.done:
            raise Refused("the part is finished")
        self.apply(command, now)

    def apply(self, command: Mapping[str, Any], now: int) -> None:
        """Apply commands at the present tick, and let time run."""
        fresh = {**self._fresh, **command} if self._samples > 1 else dict(command)
        try:
            self.reading = self.machine.step(fresh, 0)
        except Exception as error:
            raise Refused(str(error)) from None
        self._fresh = fresh
        self._held |= command
        self.go(now)

    def latch(self, safe: Mapping[str, Any], reason: str, now: int) -> None:
        """Make the machine safe at its present tick, for good."""
        self.advance(now)
        if self.over:
            return
        self.latched = reason
        try:
            take_safe(self.machine, safe, self._samples)
            self.reading = self.machine.step({}, 0)
        except Exception as error:
            self.latched = f"{reason}; the safe command was refused: {error}"
        self._held |= safe

    def _outcome(self) -> Mapping[str, Any]:
        """Outcome of a part that is over; empty where the machine is too broken to tell it."""
        try:
            told: Mapping[str, Any] = self.machine.outcome()
        except Exception as error:
            self.latched = self.latched or f"the machine failed: {type(error).__name__}: {error}"
            return {}
        return told

    def sample(self) -> ShownSample:
        """Take the next sample, as the faults of the machine leave it."""
        machine, faults = self.machine, shown_faults(self.machine)
        self._sequence += 1
        self._told = max(self._told, self._sequence - faults.lag)
        outcome = self._outcome() if self.over else None
        latched = self.latched or faults.lost
        return ShownSample(
            self.part,
            self.reading,
            dict(self._held),
            self._told,
            float(machine.time * self._tick) + faults.shift,
            self._events,
            machine.done and not latched,
            latched,
            outcome,
            faults.shift,
            faults.cut,
        )
