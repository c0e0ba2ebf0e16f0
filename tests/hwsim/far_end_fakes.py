"""The other end of a link in memory: samples as a test sets them, and the lists that came."""

from dataclasses import replace
from math import nan

from asyncua import ua

from hwsim.opcua._declaration import Declaration
from hwsim.opcua._sample import ReadSample
from hwsim.opcua._thread import LoopThread

GOOD, BAD = ua.StatusCode(0), ua.StatusCode(ua.StatusCodes.BadInvalidState)
PLAIN = ReadSample({}, 5, nan, 0, False, 1, 0, "", 0, False, 0, 0.0, 0)


def declared(**changes):
    """What the machine declares: an axis with a tick of 10 ms in wall time."""
    told = Declaration(
        "Axis", {"place": "mm"}, {"velocity": "mm/s", "stop": ""}, {"place": "mm"}, {}, {}, 0.01,
        {"velocity": (-10.0, 10.0)}, 1.0, 0.2, False, False,
    )  # fmt: skip
    return replace(told, **changes)


class FarLink:
    """A link whose answers a test gives: a status, or an error that is raised."""

    url = "opc.tcp://far:4840"

    def __init__(self, thread=False):
        self.loop = LoopThread("far link") if thread else None
        self.sample, self.moving = PLAIN, True  # `moving`: the sequence moves with each sample
        self.states, self.written, self.reads = [GOOD], 0, 0
        self.before_write = self.before_read = None  # coroutine functions

    async def read(self, parameters):
        self.reads += 1
        if self.before_read is not None:
            await self.before_read()
        if self.moving:
            self.sample = self.sample._replace(sequence=self.sample.sequence + 1)
        return self.sample

    async def write(self, parameters):
        self.written += 1
        if self.before_write is not None:
            await self.before_write()
        return self.states


class FarMachine:
    """A machine behind it (`RemoteMachine`): `sent` has each list, command and heartbeat."""

    table = None

    def __init__(self, link):
        self.link, self.sent, self.said, self.told = link, [], "no", {"place": 3.0}
        self.refused = []  # commands and statuses it was asked about

    def nodes(self, names):
        return [ua.NodeId(name, 2) for name in names]

    def seen(self, names, told, asked):
        return told._replace(at=asked)

    def written(self, command, beat):
        self.sent.append((dict(command), beat))
        return {}

    async def refusal(self, command, state):
        self.refused.append((dict(command), state))
        return self.said

    async def outcome(self, part):
        return self.told if part == self.link.sample.part else {}

    async def operator(self):
        return False, 0, ""


def failing(error, at=1):
    """A coroutine function that raises from its `at`-th call on."""
    calls = []

    async def call():
        calls.append(1)
        if len(calls) >= at:
            raise error

    return call
