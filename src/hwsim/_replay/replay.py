"""A recording under way: from instant to instant, until a command differs."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any, NamedTuple

from hwsim._part.clock import Clock
from hwsim._part.motions import as_table, digest, digest_name, is_table
from hwsim._replay.difference import difference
from hwsim.protocols import FOREVER


class Instant(NamedTuple):
    """One moment of a recording."""

    time: float  # s
    reading: Mapping[str, Any]
    commands: Mapping[str, Any]
    event: bool
    missed: bool = False  # releases before it passed by, in a run against the clock


class Replay:
    """See `hwsim.protocols.Machine`; without a clock each step goes to the next instant."""

    def __init__(self, instants: Sequence[Instant], clock: Clock | None) -> None:
        self.time, self.done, self.event = 0, False, False
        self._instants, self._clock = instants, clock
        self._at, self._here, self._steps = 0, True, 0  # last instant; whether it is now
        self._difference: tuple[float, str, Any, Any] | None = None

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, Any]:
        """Compare a command with the recorded one and go on to the next measurement."""
        if ticks and not self.done:
            self._compare(command)
            if not self.done:
                self._go_on(ticks)
        return dict(self._instants[self._at].reading)

    def _compare(self, command: Mapping[str, Any]) -> None:
        recorded: Mapping[str, Any] = self._instants[self._at].commands if self._here else {}
        given = {name.removesuffix("_command"): as_table(value) for name, value in command.items()}
        self._steps += bool(recorded or given)
        digests = {digest_name(name): digest(value) for name, value in given.items() if is_table(value)}
        given |= {name: value for name, value in digests.items() if name in recorded}
        for name in dict.fromkeys((*recorded, *given)):
            differs = difference(recorded.get(name, nan), given.get(name, nan))
            if differs is not None:
                where, old, new = differs
                self._difference, self.done = (self._now, name + where, old, new), True
                return
        self.done = self._here and self._at == len(self._instants) - 1

    @property
    def _now(self) -> float:
        """Time, s."""
        if self._here or self._clock is None:
            return self._instants[self._at].time
        return self._clock.seconds(self.time)

    def _go_on(self, ticks: int) -> None:
        """Go on to the next instant, or by `ticks` where it comes later."""
        following = self._at + 1
        if self._clock is None:
            self.time += ticks if ticks < FOREVER else 1
        else:
            due = self._clock.nearest(self._instants[following].time)
            self._here = due <= self.time + ticks or self._instants[following].missed
            self.time = due if self._here else self.time + ticks
        if self._here:
            self._at = following
            self.done = following == len(self._instants) - 1 and not self._instants[following].commands
        self.event = self._here and self._instants[self._at].event

    def outcome(self) -> dict[str, Any]:
        """Result of the comparison; see `hwsim.Recording`."""
        time, name, recorded, commanded = self._difference or (nan, "", nan, nan)
        different = {
            "difference_time": time,
            "difference_name": name,
            "recorded": recorded,
            "commanded": commanded,
        }
        return {"same": float(self._difference is None), "steps": float(self._steps), **different}
