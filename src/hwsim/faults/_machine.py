"""A machine under a fault: samples are counted, the fault strikes some of them; and what it shows outside."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from hwsim.protocols import Machine


class ShownFaults(NamedTuple):
    """What the faults of a machine do to the server that shows it, see `hwsim.serve`."""

    lag: int = 0  # samples by which its last sample is late
    shift: float = 0.0  # of its clock, s
    cut: bool = False  # whether its link is cut
    lost: str = ""  # why it ended without a word; "": it did not


def shown_faults(machine: Machine) -> ShownFaults:
    """What the faults of a machine do to its server; nothing on a machine without faults."""
    return machine.shown_faults if isinstance(machine, FaultyMachine) else ShownFaults()


def inside(machine: Machine) -> Machine:
    """The machine behind all faults, as its own watchdog commands it."""
    while isinstance(machine, FaultyMachine):
        machine = machine.inner
    return machine


class FaultyMachine:
    """A part under a fault (`hwsim.protocols.Machine`).

    Each step that moves time or ends at an event gives a new sample; another reads the present one again.
    """

    def __init__(self, machine: Machine, seen: str) -> None:
        self.inner = machine
        self._seen, self._count = seen, 0  # name and number of struck samples
        self._sample, self._read_at = -1, -1  # number of the present sample; its time, ticks

    @property
    def time(self) -> int:
        """Ticks since the start of the part."""
        return self.inner.time

    @property
    def done(self) -> bool:
        """Whether the part is finished."""
        return self.inner.done

    @property
    def event(self) -> bool:
        """Whether the last step ended at an event."""
        return self.inner.event

    @property
    def shown_faults(self) -> ShownFaults:
        """What the faults do to the server of this machine."""
        return shown_faults(self.inner)

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, Any]:
        """Step the machine inside and return its measurements as the fault leaves them."""
        reading = dict(self._advanced(command, ticks))
        again = ticks > 0 and self.event and not self.done  # two events may be at one time
        if fresh := self.time != self._read_at or again:
            self._sample, self._read_at = self._sample + 1, self.time
        struck = self._strikes(reading, fresh)
        self._count += fresh and struck
        return self._changed(reading) if struck else reading

    def _advanced(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        return self.inner.step(command, ticks)

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        """Whether the fault strikes the present sample; `fresh`: it is read for the first time."""
        return False

    def _changed(self, reading: dict[str, Any]) -> dict[str, Any]:
        """Measurements of a struck sample."""
        return reading

    def outcome(self) -> dict[str, Any]:
        """Outcome of the machine inside, and how many samples were struck."""
        return {**self.inner.outcome(), self._seen: float(self._count)}
