"""Protocol of a machine in a live run, beyond `hwsim.protocols.Machine`."""

from typing import Protocol, runtime_checkable

from hwsim._live.forwarding import Trip
from hwsim.protocols import Machine


class TrippedError(Exception):
    """A live machine was made safe while it was stepped; its reason is the machine's `trip`."""


@runtime_checkable
class LiveMachine(Machine, Protocol):
    """A part on a machine with a clock: `step` blocks until the release or the event."""

    @property
    def released(self) -> int:
        """Monotonic time (ns) at which the steps of this moment were released."""

    @property
    def sampled(self) -> int:
        """Monotonic time (ns) at which the last measurements were taken."""

    @property
    def taken(self) -> bool:
        """Whether the machine has taken the last command."""

    @property
    def trip(self) -> Trip | None:
        """Why the machine was made safe; None: it was not."""

    def make_safe(self, reason: str) -> None:
        """Write the safe command now, unless it was written, and take no other command of this part."""

    def close(self) -> None:
        """End the part: its threads stop, nothing is written any more."""
