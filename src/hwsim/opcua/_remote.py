"""A machine served by `hwsim.serve`, as its client sees it: names of nodes, and parts in lockstep."""

import json
import statistics
import time
from collections.abc import Mapping, Sequence
from typing import Any, Final

from asyncua import ua

from hwsim._live.live import Live
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._link import ClientLink, reads
from hwsim.opcua._packing import outcome_of, packed, unpacked
from hwsim.opcua._sample import ReadSample, checked, good, number, read_number, spread
from hwsim.opcua._space import URI, node_id

_OF_PART: Final = ("Part.sequence", "Part.time", "Part.event", "Part.done")
_OF_MACHINE: Final = (
    "Production.part",
    "Production.aborts",
    "Production.aborted",
    "Production.stops",
    "Production.paused",
)
_EXCHANGES = 20  # chosen: a median of them is steady


class Remote:
    """The nodes of a served machine."""

    def __init__(self, link: ClientLink, namespace: int, plant: str) -> None:
        self.link, self._namespace, self._plant = link, namespace, plant
        self.object = ua.NodeId(plant, namespace)

    @classmethod
    async def found(cls, link: ClientLink) -> "Remote":
        """Find the machine at a link."""
        try:
            namespace = await link.client.get_namespace_index(URI)
            machines = await link.node(ua.NodeId("Machines", namespace)).get_children()
        except (ua.UaError, ValueError):
            raise ValueError(
                f"nodes must be given for {link.url}, which is no machine of hwsim.serve"
            ) from None
        return cls(link, namespace, str(machines[0].nodeid.Identifier))

    def node_id(self, path: str) -> ua.NodeId:
        """Node id of a path such as ``Monitoring.height``."""
        return node_id(self._namespace, self._plant, path)

    @property
    def table(self) -> None:
        """No table of nodes: it tells them."""

    def began(self, part: int) -> None:
        """Note a part that another session has started: its number is read."""

    async def values(self, *paths: str) -> list[Any]:
        """Read variables in one message."""
        told = await self.link.read(reads([self.node_id(path) for path in paths]))
        return [None if each.Value is None else each.Value.Value for each in told]

    async def declaration(self) -> Declaration:
        """Read what the plant declares."""
        (text,) = await self.values("Identification.declaration")
        return Declaration.from_json(text)

    async def start(self, part: int, seed: str) -> None:
        """Start a part."""
        arguments = ua.Variant(part, ua.VariantType.Int64), ua.Variant(seed, ua.VariantType.String)
        (refused,) = await self.link.call(self.object, self.node_id("Start"), *arguments)
        if refused:
            raise ValueError(f"the machine at {self.link.url} began no part: {refused}")

    async def round_trip(self) -> float:
        """Median time of an exchange, s."""
        times = []
        for _ in range(_EXCHANGES):
            begun = time.perf_counter()
            await self.values("Part.sequence")
            times.append(time.perf_counter() - begun)
        return statistics.median(times)

    async def outcome(self, part: int) -> dict[str, Any]:
        """Read the outcome of a part, the last one or one of the last 64; empty where there is none."""
        (newest,) = await self.values("Production.outcome")
        if newest and (told := json.loads(newest))["part"] == part:
            return outcome_of(told["outcome"])
        (kept,) = await self.values("Production.outcomes")
        parts = [json.loads(text) for text in kept or ()]
        return next((outcome_of(told.get("outcome", {})) for told in parts if told["part"] == part), {})

    def nodes(self, names: Mapping[str, str]) -> list[ua.NodeId]:
        """Nodes of one sample: measurements, then what `seen` tells."""
        return [self.node_id(path) for path in (*names.values(), *_OF_PART, *_OF_MACHINE)]

    def seen(self, names: Mapping[str, str], told: Sequence[ua.DataValue], asked: int) -> ReadSample:
        """Return the sample of a list that was read."""
        measured, rest = told[: len(names)], told[len(names) :]
        reading = {name: read_number(each) for name, each in zip(names, measured, strict=True)}
        values: Any = [None if each.Value is None else each.Value.Value for each in rest]
        bad = sum(not good(each) for each in measured)
        return ReadSample._make([reading, *values, asked, spread(measured), bad])

    def written(self, command: Mapping[str, Any], beat: int | None) -> dict[ua.NodeId, ua.Variant]:
        """Values of a write list: commands, and the heartbeat unless None."""
        values = {self.node_id(f"Commands.{name}"): number(value) for name, value in command.items()}
        if beat is not None:
            values[self.node_id("Commands.heartbeat")] = ua.Variant(beat % (1 << 32), ua.VariantType.UInt32)
        return values

    async def refusal(self, command: Mapping[str, Any], state: ua.StatusCode) -> str:
        """Why the machine did not take a list; "": the part ended meanwhile."""
        said, done = await self.values("Production.refused", "Part.done")
        if done:
            return ""
        if state.value == ua.StatusCodes.BadInvalidState and said:
            return str(said)
        return f"the machine refused {dict(command)!r}: {state.name}"

    async def operator(self) -> tuple[bool, int, str]:
        """Whether the machine is paused, how often it was asked to abort, and why the last part was."""
        paused, stops, reason = await self.values(
            "Production.paused", "Production.stops", "Production.aborted"
        )
        return paused, stops, reason

    async def last_part(self) -> int:
        """Number of the last part that was begun."""
        (part,) = await self.values("Production.part")
        return int(part)

    def check(self, told: Declaration, live: Live, period: int | None) -> None:
        """Refuse to command a machine with its own control."""
        if told.own and not live.shadow:
            raise ValueError(
                "live must be in shadow, hwsim.Live(shadow=True): "
                f"the machine at {self.link.url} has its own control"
            )


class LockstepPart:
    """A part that advances by the steps of this client (`hwsim.protocols.Machine`)."""

    def __init__(self, remote: Remote, told: Declaration) -> None:
        self.time, self.done, self.event = 0, False, False
        self._remote, self._method = remote, remote.node_id("Advance")
        self._measures, self._accepts = tuple(told.measures), told.accepts

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, Any]:
        """Take a command, advance, measure: one message each way."""
        sent = {name: checked(name, value, self._accepts[name]) for name, value in command.items()}
        values = ua.Variant(packed(tuple(self._accepts), sent), ua.VariantType.Double, is_array=True)
        number = ua.Variant(ticks, ua.VariantType.Int64)
        link = self._remote.link
        flat, self.time, self.event, self.done, refused = link.loop.run(
            link.call(self._remote.object, self._method, values, number)
        )
        if refused:
            raise ValueError(refused)
        return unpacked(self._measures, flat or ())

    def outcome(self) -> dict[str, Any]:
        """Read the outcome of the part."""
        return self._remote.link.loop.run(self._remote.outcome(0))
