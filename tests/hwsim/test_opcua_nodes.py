"""A foreign machine with a table of nodes: units at the edge, a heartbeat, faults of the table."""

import asyncio
import threading
import time

import numpy as np
import pytest
from asyncua import Server, ua
from opcua_fakes import Drive, live

import hwsim
from hwsim.opcua._counters import SampleCounters, moved
from hwsim.opcua._foreign import ForeignMachine, read_nodes
from hwsim.opcua._kinds import ends
from hwsim.opcua._space import StandardNodes

pytestmark = pytest.mark.usefixtures("nothing_collected")
TABLE = """
[measures.place]
node = "ns=2;s=DB.Place"
unit = "um"
sample = "ns=2;s=DB.Counter"

[commands.velocity]
node = "ns=2;s=DB.Speed"
unit = "m/min"
min = "-600 mm/min"
max = "600 mm/min"

[machine]
heartbeat = "ns=2;s=DB.Life"
done = "ns=2;s=DB.Done"
start = "ns=2;s=DB.Start"
"""
KINDS = {
    "Place": (250.0, ua.VariantType.Float),
    "Counter": (0, ua.VariantType.UInt32),
    "Speed": (0.0, ua.VariantType.Float),
    "Life": (0, ua.VariantType.Int16),
    "Start": (0, ua.VariantType.Int32),
    "Done": (True, ua.VariantType.Boolean),
    "Event": (0, ua.VariantType.UInt32),
    "Steps": (0, ua.VariantType.Int16),
    "Name": ("grinder", ua.VariantType.String),
    "Real": (1.0, ua.VariantType.Double),
    "List": ([1.0, 2.0], ua.VariantType.Double),
}


class Foreign:
    """A PLC that counts samples and ends a part after `samples` of them."""

    def __init__(self, samples=20):
        self.samples, self.speeds, self.lives, self.starts = samples, [], set(), []
        self.bad = {}  # sample of a part -> node and its quality from then on
        self.over, ready = threading.Event(), threading.Event()
        self.thread = threading.Thread(target=lambda: asyncio.run(self._serve(ready)))
        self.thread.start()
        ready.wait()

    async def _serve(self, ready):
        server = Server(iserver=StandardNodes())
        await server.init()
        server.set_endpoint("opc.tcp://127.0.0.1:0")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        await server.register_namespace("urn:plc")
        nodes = {}
        for name, (value, kind) in KINDS.items():
            node = await server.nodes.objects.add_variable(
                ua.NodeId(f"DB.{name}", 2), ua.QualifiedName(name, 2), value, kind
            )
            if name in ("Speed", "Life", "Start", "Steps"):
                await node.set_writable()
            nodes[name] = node
        await server.start()
        self.url, left, last = f"opc.tcp://127.0.0.1:{server.bserver.port}", 0, 0
        ready.set()
        for count in range(10**6):
            await asyncio.sleep(0.01)
            if self.over.is_set():
                break
            started = await nodes["Start"].read_value()
            if started != last:
                last, left = started, self.samples
                self.starts.append(started)
                await nodes["Done"].write_value(False)
            self.speeds.append(await nodes["Speed"].read_value())
            self.lives.add(await nodes["Life"].read_value())
            await nodes["Counter"].write_value(count, ua.VariantType.UInt32)
            left -= 1
            if (told := self.bad.get(self.samples - left)) is not None:
                name, status = told
                value = ua.Variant(0 if name == "Event" else False, KINDS[name][1])
                await nodes[name].write_value(ua.DataValue(value, StatusCode=ua.StatusCode(status)))
            if left == 0:
                await nodes["Done"].write_value(True)
        server.iserver.time_task.cancel()
        server.iserver.time_task = None
        await server.stop()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.over.set()
        self.thread.join()


@pytest.fixture(scope="module")
def plc():
    with Foreign() as plc:
        yield plc


def table(tmp_path, text=TABLE):
    path = tmp_path / "grinder.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("gate", [False, True])
def test_a_foreign_machine_runs_in_the_units_of_the_library(plc, tmp_path, gate):
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path), security="none")
    assert dict(plant.measures) == {"place": "mm"} and dict(plant.accepts) == {"velocity": "mm/s"}
    np.testing.assert_allclose(plant.ranges["velocity"], (-10.0, 10.0), rtol=1e-15)
    assert hwsim.check(plant, Drive()) and plant.look() == {"place": 0.25}
    log = hwsim.run(plant, Drive(), parts=2, live=live(safe={"velocity": 0.0}, deadline=1.0, gate=gate))
    assert log.outcome.aborted.values.tolist() == [0.0, 0.0]
    first = plc.starts[-2]
    assert plc.starts[-2:] == [first, first + 1]
    assert set(log["controller"].place.values) == {0.25} and len(plc.lives) > 4
    assert np.float32(1.001 * 60 / 1000) in np.float32(plc.speeds)
    plant.close()


@pytest.mark.parametrize(("name", "more"), [("Done", ""), ("Event", 'event = "ns=2;s=DB.Event"\n')])
def test_what_is_not_known_is_no_end_and_no_event(plc, tmp_path, name, more):
    plc.bad = {6: (name, ua.StatusCodes.BadCommunicationError), 12: (name, ua.StatusCodes.Good)}
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, TABLE + more), security="none")
    log = hwsim.run(plant, Drive(), live=live(safe={"velocity": 0.0}, stale=2.0))
    plc.bad = {}
    assert log.outcome.aborted.values.tolist() == [0.0]
    assert log["controller"].time.values[-1] > 0.14  # the part takes 0.2 s or more, and was bad from 0.06 s
    plant.close()


LIMITS = 'min = "-600 mm/min"\nmax = "600 mm/min"\n'


@pytest.mark.parametrize(
    ("node", "odd", "said"),
    [
        ("Speed", 1e39, r"velocity must be in \[-3.40282e\+38, 3.40282e\+38\] .* is of Float; got 1e\+39"),
        ("Steps", 4e4, r"velocity must be in \[-32768, 32767\] .* is of Int16; got 40000"),
        ("Steps", [1.0, 2.0], r"velocity must be a number; got array\(\[1., 2.\]\)"),
    ],
)
def test_what_a_node_does_not_hold_is_refused_and_the_machine_made_safe(plc, tmp_path, node, odd, said):
    text = TABLE.replace(LIMITS, "").replace("m/min", "mm/s").replace("DB.Speed", f"DB.{node}")
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    with pytest.raises(hwsim.Aborted, match=said) as error:
        hwsim.run(plant, Drive(lambda: {"velocity": odd}), live=live(safe={"velocity": 0.0}))
    assert error.value.log.outcome.safe_by.values.tolist() == ["runner"]
    plant.close()


def test_a_safe_command_that_a_node_does_not_hold_is_refused_before_a_part(plc, tmp_path):
    text = TABLE.replace(LIMITS, "").replace("m/min", "mm/s").replace("DB.Speed", "DB.Steps")
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    begun = len(plc.starts)
    with pytest.raises(ValueError, match=r"velocity must be in .* got -40000"):
        hwsim.run(plant, Drive(), live=live(safe={"velocity": -4e4}))
    assert len(plc.starts) == begun
    plant.close()


@pytest.mark.parametrize("name", ["SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"])
def test_ends_of_types(name):
    kind = ua.VariantType[name]
    bits = {"SByte": 8, "Byte": 8}.get(name) or int(name.lstrip("UInt"))
    whole = 0 if name[0] in "UB" else 1
    assert ends(kind) == (-whole * 2 ** (bits - 1), 2 ** (bits - whole) - 1)


@pytest.mark.parametrize(
    ("name", "before", "now", "steps"),
    [
        ("UInt32", 2**32 - 1, 0, 1),
        ("UInt32", 7, 7, 0),
        ("UInt32", 7, 9, 2),
        ("UInt32", 1000, 0, -1000),
        ("Int16", 32767, -32768, 1),
        ("Int16", -1, 3, 4),
        ("Int16", 0, -32768, -32768),  # half of its numbers: not on its way round any more
        ("UInt16", 0, 32767, 32767),
        ("Byte", 255, 1, 2),
        ("SByte", 100, -128, 28),
        ("UInt64", 2**64 - 1, 1, 2),
    ],
)
def test_a_counter_that_runs_over_has_moved_on(name, before, now, steps):
    assert moved(ua.VariantType[name], before, now) == steps


def test_the_slowest_counter_tells_what_is_new():
    counters, kinds = SampleCounters(), {"a": ua.VariantType.UInt16, "b": ua.VariantType.Byte}
    given = [(65535, 254), (65535, 254), (0, 254), (2, 254), (2, 255), (3, 0), (3, 1), (4, 0), (5, 1)]
    told = [counters.look({"a": a, "b": b}, kinds) for a, b in given]
    assert told == [0, 0, 0, 0, 1, 2, 2, 1, 2]  # b went back in the last but one


@pytest.mark.parametrize(("status", "last"), [(ua.StatusCodes.BadNoCommunication, 0), (0, 1)])
def test_a_counter_of_a_bad_quality_tells_no_new_sample(tmp_path, status, last):
    machine = ForeignMachine(None, read_nodes(table(tmp_path)))
    machine._types = {"ns=2;s=DB.Counter": ua.VariantType.UInt32}
    place, done = (ua.DataValue(ua.Variant(value)) for value in (1.0, False))
    counters = [
        ua.DataValue(ua.Variant(count, ua.VariantType.UInt32), StatusCode=ua.StatusCode(state))
        for count, state in ((2**32 - 1, 0), (0, status))
    ]
    seen = [machine.seen({"place": ""}, [place, counter, done], 0) for counter in counters]
    assert [each.sequence for each in seen] == [0, last] and not seen[-1].done


def failing(machine, name, after):
    """Let one call of a method of a machine raise in the link's thread."""
    method, calls = getattr(machine, name), []

    def call(*given):
        if threading.current_thread() is not threading.main_thread():
            calls.append(given)
            if len(calls) == after:
                raise ArithmeticError("odd")
        return method(*given)

    setattr(machine, name, call)


@pytest.mark.parametrize(("method", "gate"), [("written", False), ("seen", False), ("seen", True)])
def test_an_error_of_a_task_makes_the_machine_safe(plc, tmp_path, method, gate):
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path), security="none")
    failing(plant._remote, method, after=6)
    with pytest.raises(hwsim.Aborted, match="ArithmeticError: odd") as said:
        hwsim.run(plant, Drive(), live=live(safe={"velocity": 0.0}, gate=gate))
    assert said.value.log.outcome.safe_by.values.tolist() == ["gate" if gate else "link"]
    until = time.monotonic() + 5.0
    while plc.speeds[-1] != 0.0 and time.monotonic() < until:
        time.sleep(0.01)
    assert plc.speeds[-1] == 0.0
    plant.close()


def test_another_session_goes_on_with_a_new_number(plc, tmp_path):
    for _ in range(2):  # a machine takes commands again only for a number that it has not seen
        plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path), security="none")
        hwsim.run(plant, Drive(), live=live(safe={"velocity": 0.0}))
        plant.close()
    assert plc.starts[-1] == plc.starts[-2] + 1


def test_a_machine_without_a_heartbeat_is_listened_to_only(plc, tmp_path):
    text = TABLE.replace('heartbeat = "ns=2;s=DB.Life"\n', "")
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    with pytest.raises(ValueError, match=r"live must be in shadow, .*: machine.heartbeat is missing"):
        hwsim.run(plant, Drive(), live=live(safe={"velocity": 0.0}))
    assert str(hwsim.check(plant, Drive())).splitlines()[1:] == [
        "- the machine is listened to only, hwsim.Live(shadow=True): machine.heartbeat is missing"
    ]
    assert plant.listening().measures == {"place": "mm", "velocity_actual": "mm/s"}
    plant.close()


def test_a_controller_of_events_needs_an_event_node(plc, tmp_path):
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path), security="none")
    with pytest.raises(ValueError, match=r"the controller must have a period: machine.event is missing"):
        hwsim.run(plant, Drive(period=None), live=live(safe={"velocity": 0.0}))
    plant.close()


def test_all_faults_of_a_table_are_told_at_once(plc, tmp_path):
    changes = {
        "DB.Place": "DB.Plaice",
        "DB.Counter": "DB.Real",
        "DB.Speed": "DB.Name",
        "DB.Life": "DB.Counter",
    }
    text = TABLE
    for old, new in changes.items():
        text = text.replace(f'{old}"', f'{new}"')
    with pytest.raises(ValueError) as error:
        hwsim.OpcuaPlant(
            plc.url, nodes=table(tmp_path, text.replace("ns=2;s=DB.Start", "DB.Start")), security="none"
        )
    assert str(error.value).splitlines() == [
        "nodes do not fit the machine:",
        "- measures.place.node = 'ns=2;s=DB.Plaice' is missing at the machine",
        "- measures.place.sample = 'ns=2;s=DB.Real' must be a whole number; it is a Double",
        "- commands.velocity.node = 'ns=2;s=DB.Name' must be a number; it is a String",
        "- machine.heartbeat = 'ns=2;s=DB.Counter' is not writable",
        "- machine.start = 'DB.Start' must be a node id such as \"ns=3;s=DB1.Size\"",
    ]


def test_types_are_told_with_the_other_faults(plc, tmp_path):
    """A part that ends when a power in kW is not 0 would be finished at any time, without a safe command."""
    text = TABLE.replace("DB.Done", "DB.Real").replace("DB.Speed", "DB.Done").replace("DB.Place", "DB.List")
    text += 'aborted = "ns=2;s=DB.Real"\nevent = "ns=2;s=DB.Done"\n'
    with pytest.raises(ValueError) as error:
        hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    assert str(error.value).splitlines()[1:] == [
        "- measures.place.node = 'ns=2;s=DB.List' must be a number; it is an array of Double",
        "- commands.velocity.node = 'ns=2;s=DB.Done' must be a number; it is a Boolean",
        "- machine.event = 'ns=2;s=DB.Done' must be a whole number; it is a Boolean",
        "- machine.done = 'ns=2;s=DB.Real' must be true or false, or a whole number; it is a Double",
        "- machine.aborted = 'ns=2;s=DB.Real' must be true or false, or a whole number; it is a Double",
    ]


def test_no_unit_is_a_unit(tmp_path):
    """`""`, the library's own word, and "1"; there an end of a range needs none, and the node may be a bit."""
    for written in ("", "1"):
        text = TABLE.replace("m/min", written, 1).replace("-600 mm/min", "0").replace('"600 mm/min"', "1")
        place = read_nodes(table(tmp_path, text)).commands["velocity"]
        assert place.unit == "" and place.factor == 1.0 and place.ends == (0.0, 1.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('unit = "um"\n', "", "measures.place.unit is missing"),
        ('unit = "um"', 'unit = "cubits"', "measures.place.unit must be a unit, \"\" for none; got 'cubits'"),
        ('done = "ns=2;s=DB.Done"\n', "", "machine.done is missing"),
        ('max = "600 mm/min"\n', "", "commands.velocity.max is missing"),
        (
            '"600 mm/min"',
            "3",
            'commands.velocity.max must be a text with its unit, such as "3 m/min"; got 3',
        ),
        (
            '"-600 mm/min"',
            '"3"',
            "commands.velocity.min must be a text with its unit, such as \"3 m/min\"; got '3'",
        ),
        (
            '"-600 mm/min"',
            '"0.6 m/min"',
            "commands.velocity.min must be < commands.velocity.max = '600 mm/min'; got '0.6 m/min'",
        ),
        ('unit = "um"', 'unit = "h um/"', "measures.place.unit must be a unit, \"\" for none; got 'h um/'"),
        ("sample =", "samples =", "measures.place.samples is not a key; is measures.place.sample meant?"),
    ],
)
def test_a_wrong_table_names_file_and_key(tmp_path, old, new, said):
    with pytest.raises(ValueError) as error:
        hwsim.OpcuaPlant(
            "opc.tcp://127.0.0.1:9", nodes=table(tmp_path, TABLE.replace(old, new)), security="none"
        )
    assert f"grinder.toml: {said}" in str(error.value)


def test_missing_limits_are_told(plc, tmp_path):
    text = TABLE.replace('min = "-600 mm/min"\n', "").replace('max = "600 mm/min"\n', "")
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    assert str(hwsim.check(plant, Drive())).splitlines()[1:] == [
        "- nodes gives no min and max of velocity: only the machine's own limits are kept",
        "- nodes gives no machine.aborted: it is not seen whether the machine latches, and one that does not may "
        "take a command that a stalled network delivers late",
    ]
    plant.close()


def test_a_machine_that_tells_its_latch_has_no_note_of_it(plc, tmp_path):
    text = TABLE + 'aborted = "ns=2;s=DB.Event"\n'
    plant = hwsim.OpcuaPlant(plc.url, nodes=table(tmp_path, text), security="none")
    assert plant.notes == ()
    plant.close()


def test_a_table_that_is_not_there(tmp_path):
    with pytest.raises(ValueError, match=r"nodes must be a TOML file .*; .*no.toml: No such file"):
        hwsim.OpcuaPlant("opc.tcp://127.0.0.1:9", nodes=tmp_path / "no.toml", security="none")


def test_a_machine_that_is_not_ours_needs_a_table(plc):
    with pytest.raises(
        ValueError, match=f"nodes must be given for {plc.url}, which is no machine of hwsim.serve"
    ):
        hwsim.OpcuaPlant(plc.url, security="none")


def test_servers_share_no_node_of_the_standard():
    """Nodes of the standard are copied when they are first asked for: no server may write into those of all."""

    async def levels():
        servers = [Server(iserver=StandardNodes()) for _ in range(2)]
        for server in servers:
            await server.init()
        first, other = (server.get_node(ua.ObjectIds.Server_ServiceLevel) for server in servers)
        await first.write_value(7, ua.VariantType.Byte)
        await first.delete_reference(ua.ObjectIds.Server, ua.ObjectIds.HasProperty, forward=False)
        return [(await node.read_value(), len(await node.get_references())) for node in (first, other)]

    (level, references), other = asyncio.run(levels())
    assert level == 7 and other == (255, references + 1)
