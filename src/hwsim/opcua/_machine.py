"""What a live part needs of the machine at the other end of a link."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from asyncua import ua

from hwsim._live.live import Live
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._link import ClientLink
from hwsim.opcua._sample import ReadSample


class RemoteMachine(Protocol):
    """A served machine, or a foreign one with a table of nodes."""

    link: ClientLink

    @property
    def table(self) -> Any:
        """Table of its nodes, as `hwsim.opcua._foreign.nodes_of` reads it from JSON; None: it has none."""

    def began(self, part: int) -> None:
        """Note a part that another session has started."""

    async def declaration(self) -> Declaration:
        """Read what the machine declares."""

    def check(self, told: Declaration, live: Live, period: int | None) -> None:
        """Refuse a run that the machine does not take."""

    async def round_trip(self) -> float:
        """Median time of an exchange, s."""

    async def start(self, part: int, seed: str) -> None:
        """Start a part."""

    async def last_part(self) -> int:
        """Number of the last part that was begun."""

    async def outcome(self, part: int) -> dict[str, Any]:
        """Read the outcome of a part; empty where there is none."""

    async def operator(self) -> tuple[bool, int, str]:
        """Whether the machine is paused, how often it was asked to abort, and why the last part was."""

    def nodes(self, names: Mapping[str, str]) -> list[ua.NodeId]:
        """Nodes of one sample."""

    def seen(self, names: Mapping[str, str], told: Sequence[ua.DataValue], asked: int) -> ReadSample:
        """Return the sample of a list that was read."""

    def written(self, command: Mapping[str, Any], beat: int | None) -> dict[ua.NodeId, ua.Variant]:
        """Values of a write list: commands, and the heartbeat unless None."""

    async def refusal(self, command: Mapping[str, Any], state: ua.StatusCode) -> str:
        """Why the machine did not take a list; "": the part ended meanwhile."""
