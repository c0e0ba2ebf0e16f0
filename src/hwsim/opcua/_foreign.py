"""A foreign machine with a table of nodes: units converted at the edge, every fault of the table at once."""

import os
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from math import nan
from typing import Any, Final, NamedTuple

from asyncua import ua

from hwsim._live.live import Live
from hwsim.command._toml import Table, read
from hwsim.opcua._counters import SampleCounters
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._kinds import COUNT, EITHER, KINDS, NUMBER, SWITCH, commanded, variant
from hwsim.opcua._link import ClientLink, reads, writes
from hwsim.opcua._sample import ReadSample, good, read_number, spread
from sdpgrind.base import checks, unit_text

_OURS: Final = (
    "1", "mm", "s", "mm/s", "mm/s^2", "N", "W", "rad", "rad/s", "rad/s^2", "mm^3/s", "mm^2", "kg", "A", "J",
)  # fmt: skip
_TICK, _TIMEOUT = 1e-3, 0.0  # s; chosen: fine enough for any period; a machine's watchdog is not known
_EXCHANGES, _BEGUN = 20, 5.0  # chosen: a median of them is steady; s, chosen: a part begins within it
_COUNTS = 1 << 15  # chosen: what the smallest usual whole number of a machine holds


class NodePlace(NamedTuple):
    """A node of a measurement or a command."""

    node: str
    unit: str  # of the library
    factor: float  # from the machine's unit to that of the library
    sample: str | None = None
    ends: tuple[float, float] | None = None  # in the library's unit


class Nodes(NamedTuple):
    """A table of nodes."""

    measures: Mapping[str, NodePlace]
    commands: Mapping[str, NodePlace]
    machine: Mapping[str, str]  # heartbeat, event, done, start, aborted
    name: str
    tick: float


def read_nodes(path: str | os.PathLike[str]) -> Nodes:
    """Read a table of nodes; ValueError names file and key."""
    file = checks.path("nodes", path)
    try:
        return read(file, _nodes)
    except OSError as error:
        raise ValueError(
            f"nodes must be a TOML file with a table of nodes; {file}: {error.strerror}"
        ) from None


def nodes_of(told: Sequence[Any]) -> Nodes:
    """A table of nodes that was written as JSON."""
    measures, commands, machine, name, tick = told
    return Nodes(_restored(measures), _restored(commands), machine, name, tick)


def _restored(told: Mapping[str, Sequence[Any]]) -> dict[str, NodePlace]:
    places = {name: NodePlace(*each) for name, each in told.items()}
    return {
        name: p if p.ends is None else p._replace(ends=(p.ends[0], p.ends[1])) for name, p in places.items()
    }


def _nodes(table: Table) -> Nodes:
    of_machine = table.table("machine")
    machine = {key: str(of_machine.take(key)) for key in _KEYS if key in _NEEDED or of_machine.has(key)}
    tick = of_machine.number("tick", "s") if of_machine.has("tick") else _TICK
    name = str(of_machine.take("name")) if of_machine.has("name") else "machine"
    of_machine.done()
    places = [_places(table.maybe(key)) for key in ("measures", "commands")]
    return Nodes(places[0], places[1], machine, name, tick)


_KEYS: Final = ("heartbeat", "event", "done", "start", "aborted")
_NEEDED: Final = ("done",)


def _places(table: Table) -> dict[str, NodePlace]:
    return {name: _place(table.table(name)) for name in table.entries}


def _place(table: Table) -> NodePlace:
    written = str(table.take("unit")) or "1"
    unit = _library_unit(table.path("unit"), written)
    factor = unit_text.factor(written, unit)
    node, ends = str(table.take("node")), None
    sample = str(table.take("sample")) if table.has("sample") else None
    if table.has("min") or table.has("max"):
        ends = _end(table, "min", written, unit), _end(table, "max", written, unit)
        if ends[0] >= ends[1]:
            name, low, high = table.path("min"), table.entries["min"], table.entries["max"]
            raise ValueError(f"{name} must be < {table.path('max')} = {high!r}; got {low!r}")
    table.done()
    return NodePlace(node, unit, factor, sample, ends)


def _end(table: Table, key: str, written: str, unit: str) -> float:
    """An end of a range with its unit: a bare number may be in that of the machine or of the library."""
    given = table.take(key)
    if unit and given != 0 and unit_text.bare(given):  # 0 is 0 in both
        raise ValueError(
            f'{table.path(key)} must be a text with its unit, such as "{given} {written}"; got {given!r}'
        )
    return table.number(key, unit)


def _library_unit(name: str, written: str) -> str:
    """The library's unit of the kind of a written one."""
    try:
        exponents = unit_text.parse(written).exponents
    except ValueError as error:
        raise ValueError(f'{name} must be a unit, "" for none; got {written!r}: {error}') from None
    for unit in _OURS:
        if unit_text.parse(unit).exponents == exponents:
            return "" if unit == "1" else unit
    return written


class ForeignMachine:
    """A machine that is not served by `hwsim.serve` (`RemoteMachine`)."""

    def __init__(self, link: ClientLink, nodes: Nodes) -> None:
        self.link, self._nodes = link, nodes
        self._types: dict[str, ua.VariantType] = {}
        self._part, self._was_done = 0, True
        self._sequence, self._event = -1, 0  # the last ones that were told
        self._counters = SampleCounters()
        self._samples = tuple(dict.fromkeys(p.sample for p in nodes.measures.values() if p.sample))
        self._rest = tuple(key for key in ("event", "done", "aborted") if key in nodes.machine)

    @property
    def table(self) -> Nodes:
        """Table of its nodes."""
        return self._nodes

    def began(self, part: int) -> None:
        """Note a part that another session has started."""
        self._part = part

    @classmethod
    async def found(cls, link: ClientLink, nodes: Nodes) -> "ForeignMachine":
        """Look at every node of the table; ValueError with all faults."""
        machine = cls(link, nodes)
        if faults := [fault async for fault in machine._faults()]:
            raise ValueError("\n".join(["nodes do not fit the machine:", *(f"- {each}" for each in faults)]))
        return machine

    async def _faults(self) -> Any:
        for key, node, writes_, holds in self._all():
            fault = await self._fault(node, write=writes_, holds=holds)
            if fault:
                yield f"{key} = {node!r} {fault}"

    def _all(self) -> Iterator[tuple[str, str, bool, str]]:
        """Key, node, whether it is written, what it must hold."""
        for name, place in self._nodes.measures.items():
            yield f"measures.{name}.node", place.node, False, NUMBER if place.unit else EITHER
            if place.sample:
                yield f"measures.{name}.sample", place.sample, False, COUNT
        for name, place in self._nodes.commands.items():
            holds = NUMBER if place.unit else EITHER
            yield f"commands.{name}.node", place.node, "heartbeat" in self._nodes.machine, holds
        for key, node in self._nodes.machine.items():
            holds = SWITCH if key in ("done", "aborted") else COUNT
            yield f"machine.{key}", node, key in ("heartbeat", "start"), holds

    async def _fault(self, node: str, *, write: bool, holds: str) -> str:
        try:
            identifier = ua.NodeId.from_string(node)
        except ua.UaError:
            return 'must be a node id such as "ns=3;s=DB1.Size"'
        attributes = ua.AttributeIds.Value, ua.AttributeIds.UserAccessLevel
        asked = [ua.ReadValueId(NodeId=identifier, AttributeId=attribute) for attribute in attributes]
        value, level = await self.link.read(ua.ReadParameters(NodesToRead=asked))
        if value.StatusCode is not None and value.StatusCode.value == ua.StatusCodes.BadNodeIdUnknown:
            return "is missing at the machine"
        if not good(value):
            return f"is not readable: {value.StatusCode.name if value.StatusCode else 'no value'}"
        kind = self._types[node] = value.Value.VariantType
        if isinstance(value.Value.Value, list):
            return f"must be {holds}; it is an array of {kind.name}"
        if kind.name not in KINDS[holds]:
            return f"must be {holds}; it is a {kind.name}"
        bits = level.Value.Value if good(level) else 0
        return "is not writable" if write and not bits & (1 << ua.AccessLevel.CurrentWrite) else ""

    async def declaration(self) -> Declaration:
        """Return what the table declares."""
        nodes = self._nodes
        return Declaration(
            nodes.name,
            {name: place.unit for name, place in nodes.measures.items()},
            {name: place.unit for name, place in nodes.commands.items()},
            {},
            {},
            {},
            nodes.tick,
            {name: place.ends for name, place in nodes.commands.items() if place.ends is not None},
            1.0,
            _TIMEOUT,
            "heartbeat" not in nodes.machine,
            False,
        )

    def check(self, told: Declaration, live: Live, period: int | None) -> None:
        """Refuse to command a machine without a heartbeat, and to wait for events that it does not tell."""
        if told.own and not live.shadow:
            raise ValueError(
                "live must be in shadow, hwsim.Live(shadow=True): "
                "machine.heartbeat is missing, and a machine without a watchdog is not commanded"
            )
        if period is None and "event" not in self._nodes.machine:
            raise ValueError(
                "the controller must have a period: machine.event is missing, so no event is told"
            )

    async def round_trip(self) -> float:
        """Median time of an exchange, s."""
        times = []
        for _ in range(_EXCHANGES):
            begun = time.perf_counter()
            await self._read("done")
            times.append(time.perf_counter() - begun)
        return statistics.median(times)

    async def _read(self, key: str) -> Any:
        (told,) = await self.link.read(reads([self._id(self._nodes.machine[key])]))
        return read_number(told)

    @staticmethod
    def _id(node: str) -> ua.NodeId:
        return ua.NodeId.from_string(node)

    async def start(self, part: int, seed: str) -> None:
        """Write the number of the part to its node, and wait until the machine has begun it."""
        if "start" in self._nodes.machine:
            node = self._nodes.machine["start"]
            number = variant(self._types[node], part % _COUNTS)
            state = (await self.link.write(writes({self._id(node): number})))[0]
            if state.is_bad():
                raise ValueError(f"the machine at {self.link.url} began no part: {state.name}")
        until = time.monotonic() + _BEGUN
        while await self._read("done"):
            if time.monotonic() > until:
                raise ValueError(
                    f"machine.done must fall when a part begins; it stood for {_BEGUN:g} s"
                    + (
                        ""
                        if "start" in self._nodes.machine
                        else ": without machine.start no part is asked for"
                    )
                )
        self._part = part

    async def last_part(self) -> int:
        """Number at the node of the start, where an earlier session may have left one; else parts seen."""
        if "start" in self._nodes.machine:
            return int(await self._read("start"))
        done = await self._read("done")
        if done != done:  # not known: nothing has changed
            return self._part
        self._part += self._was_done and not done
        self._was_done = bool(done)
        return self._part

    async def outcome(self, part: int) -> dict[str, Any]:
        """Return what tells that there is no more to come: such a machine tells no outcome."""
        return {"bad_quality": nan}

    async def operator(self) -> tuple[bool, int, str]:
        """Return no act: a pause or an abort at the machine is seen as the end of the part."""
        return False, 0, ""

    def nodes(self, names: Mapping[str, str]) -> list[ua.NodeId]:
        """Nodes of one sample."""
        of = {name: self._nodes.measures[name].node for name in names if name in self._nodes.measures}
        actual = {f"{name}_actual": place.node for name, place in self._nodes.commands.items()}
        listed = [(of | actual)[name] for name in names]
        return [self._id(node) for node in (*listed, *self._samples, *self._of_machine())]

    def _of_machine(self) -> list[str]:
        return [self._nodes.machine[key] for key in self._rest]

    def seen(self, names: Mapping[str, str], told: Sequence[ua.DataValue], asked: int) -> ReadSample:
        """Return the sample of a list that was read, in the library's units."""
        measured, rest = told[: len(names)], [read_number(each) for each in told[len(names) :]]
        reading = {n: self._factor(n) * read_number(each) for n, each in zip(names, measured, strict=True)}
        of = dict(zip(self._rest, rest[len(self._samples) :], strict=True))
        if not any(each != each for each in rest):  # else it is no new sample, and goes stale
            counts = dict(zip(self._samples, map(int, rest), strict=False))
            self._sequence = self._counters.look(counts, self._types) if counts else asked
            self._event = int(of.get("event", 0))
        stopped = _true(of.get("aborted", 0))
        return ReadSample(
            reading,
            self._sequence,
            nan,
            self._event,
            _true(of["done"]),
            self._part,
            int(stopped),
            "it says so" if stopped else "",
            0,
            False,
            asked,
            spread(measured),
            sum(not good(each) for each in measured),
        )

    def _factor(self, name: str) -> float:
        place = self._nodes.measures.get(name) or self._nodes.commands[name.removesuffix("_actual")]
        return place.factor

    def written(self, command: Mapping[str, Any], beat: int | None) -> dict[ua.NodeId, ua.Variant]:
        """Values of a write list, in the machine's units and types."""
        places = self._nodes.commands
        values = {
            self._id(places[name].node): commanded(name, places[name], value, self._types[places[name].node])
            for name, value in command.items()
        }
        if beat is not None:
            node = self._nodes.machine["heartbeat"]
            values[self._id(node)] = variant(self._types[node], beat % _COUNTS)
        return values

    async def refusal(self, command: Mapping[str, Any], state: ua.StatusCode) -> str:
        """Why the machine did not take a list; "": the part ended meanwhile."""
        if _true(await self._read("done")):
            return ""
        return f"the machine refused {dict(command)!r}: {state.name}"


def _true(told: Any) -> bool:
    """Whether a switch is known to be on; NaN, of a quality that is not good, is not."""
    return bool(told == told and told)
