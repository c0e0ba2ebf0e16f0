"""Other clients than ours: the tools of asyncua, and open62541 as a second stack."""

import logging
import subprocess
import sys

import pytest
from asyncua import tools
from opcua_fakes import Axis, served


@pytest.fixture(scope="module")
def server():
    with served(Axis(length=60.0)) as server:
        yield server


@pytest.fixture
def tool(server, monkeypatch, capsys):
    """A tool of the terminal, in this process, which has imported it: what it prints."""
    monkeypatch.setattr(logging, "basicConfig", lambda level: None)

    def run(name, *arguments):
        monkeypatch.setattr(sys, "argv", [name, "-u", server.url, *arguments])
        with pytest.raises(SystemExit):
            getattr(tools, name)()
        return capsys.readouterr().out

    return run


def test_a_list_of_nodes(tool):
    said = tool("uals", "-n", "ns=2;s=Axis", "-d", "2")
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


def test_a_value_is_read_and_a_command_written(tool):
    assert tool("uaread", "-n", "ns=2;s=Axis.Monitoring.place").strip() == "0.0"
    assert tool("uaread", "-n", "ns=2;s=Axis.Identification.Model").strip() == "Axis"
    assert "BadOutOfRange" in tool("uawrite", "-n", "ns=2;s=Axis.Commands.velocity", "-t", "double", "20.0")
    early = tool("uawrite", "-n", "ns=2;s=Axis.Commands.velocity", "-t", "double", "2.0")
    assert "BadInvalidState" in early  # no part was started
    said = tool("uaread", "-n", "ns=2;s=Axis.Production.refused").strip()
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
