"""Address space of a served plant: objects, variables, units and ranges, methods."""

import gc
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from math import nan
from typing import Any, Final

from asyncua import Server, ua
from asyncua.common.node import Node
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData
from asyncua.server.internal_server import InternalServer

from hwsim.opcua._declaration import Declaration

URI: Final = "urn:sdpgrind:hwsim"
_UNECE = "http://www.opcfoundation.org/UA/units/un/cefact"
# source: UNECE Recommendation 20, common codes
_CODES = {
    "": "C62", "mm": "MMT", "um": "4H", "s": "SEC", "N": "NEW", "W": "WTT", "J": "JOU", "kg": "KGM",
    "A": "AMP", "rad": "C81", "rad/s": "2A", "rad/s^2": "2B", "mm/s": "C16", "N m": "NU", "K": "KEL",
}  # fmt: skip
_PART: Final = {
    "sequence": ua.VariantType.UInt64,
    "time": ua.VariantType.Double,
    "event": ua.VariantType.UInt64,
    "done": ua.VariantType.Boolean,
}
_PRODUCED: Final[dict[str, tuple[Any, ua.VariantType]]] = {
    "part": (0, ua.VariantType.Int64),
    "parts": (0, ua.VariantType.Int64),
    "outcome": ("", ua.VariantType.String),
    "outcomes": ([], ua.VariantType.String),
    "aborted": ("", ua.VariantType.String),
    "aborts": (0, ua.VariantType.UInt32),
    "stops": (0, ua.VariantType.UInt32),
    "paused": (False, ua.VariantType.Boolean),
    "operator": ("", ua.VariantType.String),
    "refused": ("", ua.VariantType.String),
    "slip": (0.0, ua.VariantType.Double),
}
_standard: dict[ua.NodeId, NodeData] = {}  # nodes of the standard, filled once a process: they take seconds


class _Shared(NodeData):  # type: ignore[misc]  # asyncua is not followed
    """A node of the standard, for all servers of the process: never changed."""

    __slots__ = ()


class _Nodes(dict[ua.NodeId, NodeData]):
    """Nodes of a server: one of the standard is copied when it is first asked for: 40 of 6000 (measured)."""

    def __getitem__(self, key: ua.NodeId) -> NodeData:
        node = super().__getitem__(key)
        if isinstance(node, _Shared):
            node = self[key] = _copied(node)
        return node

    def get(self, key: ua.NodeId, default: Any = None) -> Any:
        try:
            return self[key]
        except KeyError:
            return default


class StandardNodes(InternalServer):  # type: ignore[misc]  # asyncua is not followed
    """An internal server whose standard nodes are copied from the first one of the process."""

    async def load_standard_address_space(self, shelf_file: Any = None) -> None:
        """Fill the address space with the nodes of the standard."""
        if not _standard:
            collecting = gc.isenabled()
            gc.disable()  # half of the time would go to the search for garbage among 100 000 live objects
            try:
                await super().load_standard_address_space(shelf_file)
                keys = self.aspace.keys()
                _standard.update({key: _shared(self.aspace[key]) for key in keys})
            finally:
                (gc.enable if collecting else gc.disable)()
        self.aspace._nodes = _Nodes(_standard)  # as asyncua does with a shelf, from which it reads on demand

    async def stop(self) -> None:
        """Stop, and let go of the nodes, which refer to each other and would wait for a full collection."""
        await super().stop()
        self.aspace.clear()


def _shared(node: NodeData) -> _Shared:
    """The node itself, as one of all servers."""
    shared = _Shared(node.nodeid)
    shared.attributes, shared.references, shared.call = node.attributes, node.references, node.call
    return shared


def _copied(node: NodeData) -> NodeData:
    """A node with attributes and references of its own; their values are never changed in place."""
    copied = NodeData(node.nodeid)
    copied.attributes = {name: AttributeValue(each.value) for name, each in node.attributes.items()}
    copied.references, copied.call = list(node.references), node.call
    return copied


class Space:
    """The nodes of one plant; `show` writes their values, in the thread of the server."""

    def __init__(self, server: Server, namespace: int, plant: str) -> None:
        self.namespace = namespace
        self._plant, self._server = plant, server
        self._aspace: AddressSpace = server.iserver.aspace
        self._types: dict[str, ua.VariantType] = {}
        self._values: dict[str, AttributeValue] = {}

    def node_id(self, path: str) -> ua.NodeId:
        """Node id of a path such as ``Monitoring.height``, the same at each start of a server."""
        return node_id(self.namespace, self._plant, path)

    async def show(self, path: str, value: Any, at: datetime | None = None) -> None:
        """Write the value of a variable; those who subscribed to it are told."""
        told = ua.DataValue(
            ua.Variant(value, self._types[path], is_array=isinstance(value, list)),
            SourceTimestamp=at or datetime.now(UTC),
        )
        attribute = self._values[path]
        if attribute.datachange_callbacks:
            await self._aspace.write_attribute_value(self.node_id(path), ua.AttributeIds.Value, told)
        else:
            attribute.value = told

    @property
    def commands(self) -> list[str]:
        """Paths of the commands, without the heartbeat."""
        return [path for path in self._types if path.startswith("Commands.") and path != "Commands.heartbeat"]

    def cut_connections(self) -> None:
        """Close the connections of all clients, without a word."""
        for client in () if self._server.bserver is None else self._server.bserver.clients:
            if client.transport is not None:
                client.transport.abort()

    def value(self, path: str) -> Any:
        """Return the value of a variable."""
        told = self._aspace.read_attribute_value(self.node_id(path), ua.AttributeIds.Value)
        assert told.Value is not None
        return told.Value.Value

    def _name(self, name: str) -> ua.QualifiedName:
        return ua.QualifiedName(name, self.namespace)

    async def object(self, above: Node, path: str) -> Node:
        """Add an object."""
        return await above.add_object(self.node_id(path), self._name(path.rpartition(".")[2] or path))

    async def variable(self, above: Node, path: str, value: Any, kind: ua.VariantType) -> Node:
        """Add a variable that clients may read."""
        self._types[path] = kind
        name = self._name(path.rpartition(".")[2])
        variant = ua.Variant(value, kind, is_array=isinstance(value, list))
        node = await above.add_variable(self.node_id(path), name, variant)
        self._values[path] = self._aspace[self.node_id(path)].attributes[ua.AttributeIds.Value]
        return node

    async def quantity(
        self, above: Node, path: str, unit: str, ends: tuple[float, float] | None, *, table: bool = False
    ) -> Node:
        """Add a number, or a table, with its unit and its range."""
        node = await self.variable(above, path, nan, ua.VariantType.Double)
        if table:
            await node.write_value_rank(ua.ValueRank.Any)
        property_ = self.node_id(f"{path}.EngineeringUnits"), ua.QualifiedName("EngineeringUnits", 0)
        await node.add_property(*property_, unit_information(unit))
        if ends is not None:
            property_ = self.node_id(f"{path}.EURange"), ua.QualifiedName("EURange", 0)
            await node.add_property(*property_, ua.Range(*ends))
        return node

    async def method(
        self,
        above: Node,
        name: str,
        call: Callable[..., Any],
        inputs: Mapping[str, ua.VariantType],
        outputs: Mapping[str, ua.VariantType],
    ) -> None:
        """Add a method; arguments whose name ends with ``[]`` are arrays."""
        of = [[_argument(*each) for each in arguments.items()] for arguments in (inputs, outputs)]
        await above.add_method(self.node_id(name), self._name(name), call, *of)


def node_id(namespace: int, plant: str, path: str) -> ua.NodeId:
    """Node id of a path of a plant."""
    return ua.NodeId(f"{plant}.{path}", namespace)


def unit_information(unit: str) -> ua.EUInformation:
    """Return a unit with its UNECE code where it has one, -1 otherwise; the text is always there."""
    code = _CODES.get(unit)
    number = -1 if code is None else int.from_bytes(code.encode())
    text = ua.LocalizedText(unit or "1")
    return ua.EUInformation(NamespaceUri=_UNECE, UnitId=number, DisplayName=text, Description=text)


def _argument(name: str, kind: ua.VariantType) -> ua.Argument:
    argument = ua.Argument(Name=name.removesuffix("[]"), DataType=ua.NodeId(kind.value))
    argument.ValueRank = ua.ValueRank.OneDimension if name.endswith("[]") else ua.ValueRank.Scalar
    return argument


async def filled(space: Space, server: Server, told: Declaration, tables: Sequence[str]) -> Node:
    """Add objects and variables of a plant and return its object."""
    machines = await server.nodes.objects.add_object(
        ua.NodeId("Machines", space.namespace), ua.QualifiedName("Machines", space.namespace)
    )
    plant = await machines.add_object(
        ua.NodeId(told.plant, space.namespace), ua.QualifiedName(told.plant, space.namespace)
    )
    await _identification(space, plant, told)
    for name, value in (("MachineryItemState", "NotExecuting"), ("MachineryOperationMode", "Processing")):
        await space.variable(plant, name, value, ua.VariantType.String)
    monitoring = await space.object(plant, "Monitoring")
    for name, unit in told.measures.items():
        await space.quantity(monitoring, f"Monitoring.{name}", unit, None, table=True)
    part = await space.object(plant, "Part")  # not in Monitoring: a plant may measure a time of its own
    for name, kind in _PART.items():
        await space.variable(part, f"Part.{name}", kind is ua.VariantType.Boolean or 0, kind)
    commands = await space.object(plant, "Commands")
    for name, unit in told.accepts.items():
        node = await space.quantity(
            commands, f"Commands.{name}", unit, told.ranges.get(name), table=name in tables
        )
        await node.set_writable()
    heartbeat = await space.variable(commands, "Commands.heartbeat", 0, ua.VariantType.UInt32)
    await heartbeat.set_writable()
    production = await space.object(plant, "Production")
    for name, (first, kind) in _PRODUCED.items():
        await space.variable(production, f"Production.{name}", first, kind)
    return plant


async def _identification(space: Space, plant: Node, told: Declaration) -> None:
    """Add who the machine is, the job, and the declaration."""
    identification = await space.object(plant, "Identification")
    who = {
        "Manufacturer": "sdpgrind",
        "Model": told.plant,
        "SerialNumber": "simulated",
        "ProductInstanceUri": f"{URI}:{told.plant}",
        "SoftwareRevision": "1",
    }
    for name, text in {**who, "declaration": told.to_json()}.items():
        await space.variable(identification, f"Identification.{name}", text, ua.VariantType.String)
    job = await space.object(identification, "Identification.job")
    for name, entry in told.job.items():
        value, unit = entry if isinstance(entry, tuple) and len(entry) == 2 else (entry, "")
        text = f"{value} {unit}".rstrip()
        await space.variable(job, f"Identification.job.{name}", text, ua.VariantType.String)
