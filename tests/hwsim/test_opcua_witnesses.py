"""Other clients than ours: the tools of asyncua, and open62541 as a second stack."""

import subprocess
import sys
from pathlib import Path

import pytest
from opcua_fakes import Axis, served

TOOLS = Path(sys.executable).parent


@pytest.fixture(scope="module")
def server():
    with served(Axis(length=60.0)) as server:
        yield server


def tool(name, server, *arguments):
    command = [str(TOOLS / name), "-u", server.url, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_list_of_nodes(server):
    said = tool("uals", server, "-n", "ns=2;s=Axis", "-d", "2").stdout
    for name in (
        "Identification",
        "Monitoring",
        "Commands",
        "Production",
        "Start",
        "Abort",
        "place",
        "heartbeat",
    ):
        assert name in said, said


def test_a_value_is_read_and_a_command_written(server):
    assert tool("uaread", server, "-n", "ns=2;s=Axis.Monitoring.place").stdout.strip() == "0.0"
    assert tool("uaread", server, "-n", "ns=2;s=Axis.Identification.Model").stdout.strip() == "Axis"
    refused = tool("uawrite", server, "-n", "ns=2;s=Axis.Commands.velocity", "-t", "double", "20.0")
    assert "BadOutOfRange" in refused.stdout + refused.stderr
    early = tool("uawrite", server, "-n", "ns=2;s=Axis.Commands.velocity", "-t", "double", "2.0")
    assert "BadInvalidState" in early.stdout + early.stderr  # no part was started
    said = tool("uaread", server, "-n", "ns=2;s=Axis.Production.refused").stdout.strip()
    assert said == "a part must be started before it is commanded"


SCRIPT = """
import sys, o6
client = o6.Client(sys.argv[1])
client.connect()
print(client.read("ns=2;s=Axis.Monitoring.place"))
for speed in (20.0, 2.0):
    print(client.write("ns=2;s=Axis.Commands.velocity", speed).name)
client.disconnect()
"""


def test_open62541_reads_and_is_refused_alike(server):
    pytest.importorskip("o6")  # in a process of its own: its licence ends one after 10 minutes
    command = [sys.executable, "-c", SCRIPT, server.url]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.splitlines()[-3:] == ["0.0", "BAD_OUT_OF_RANGE", "BAD_INVALID_STATE"], done.stderr
