"""A plant and controllers that one can work out by hand."""

from dataclasses import dataclass
from math import nan
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class Tank:
    """Level falls by `flow` and a random leak, its hidden truth; event when an alarm level is passed; ends
    empty.
    """

    level: float = 10.0
    tick: float = 0.1
    alarm: float = 5.0
    leak: float = 0.0
    measures: ClassVar = {"level": "mm", "temperature": "K"}
    accepts: ClassVar = {"flow": "mm/s", "close": ""}
    outcomes: ClassVar = {"level": "mm", "leak": "mm/s", "levels": ("mm", "tick"), "time": "s"}
    description: ClassVar = {"colour": "red"}

    def start(self, rng):
        return Water(self, self.leak * rng.random())

    def with_tick(self, tick):
        return Tank(self.level, tick, self.alarm, self.leak)


@dataclass(frozen=True)
class FixedTank(Tank):
    """A tank whose tick cannot be changed."""

    with_tick = None


class Water:
    def __init__(self, tank, leak):
        self.tank, self.leak, self.level, self.flow = tank, leak, tank.level, 0.0
        self.time, self.done, self.event = 0, False, False
        self.levels = []
        self.calls = []

    def step(self, command, ticks):
        self.calls.append((dict(command), ticks))
        if "flow" in command:
            self.flow = command["flow"]
        if command.get("close"):
            self.done = True
        if ticks:
            self._flow(ticks)
        return {"level": self.level}  # the thermometer is broken: no reading

    def _flow(self, ticks):
        self.event = False
        for _ in range(ticks if self.flow or self.leak else 0):
            if self.done or self.event:
                return
            before = self.level
            self.level -= (self.flow + self.leak) * self.tank.tick
            self.time += 1
            self.levels.append(self.level)
            self.event = before > self.tank.alarm >= self.level
            self.done = self.level <= 1e-9
        if not (self.flow or self.leak) and ticks < 2**60:
            self.time += ticks

    def outcome(self):
        return {
            "level": self.level,
            "leak": self.leak,
            "levels": self.levels,
            "time": self.time * self.tank.tick,
        }


class Drain:
    """Opens the tap at every step; remembers what it saw."""

    tier = "tap"
    reads: ClassVar = {"level": "mm"}
    commands: ClassVar = {"flow": "mm/s"}
    reports: ClassVar = {"end": "s"}

    def __init__(self, flow=2.0, period=None):
        self.flow, self.period, self.seen, self.steps = flow, period, [], 0
        self.level = nan

    def reset(self):
        self.steps = 0

    def step(self, *, level, temperature=nan, **others):
        self.steps += 1
        self.level = level
        self.seen.append((level, temperature))
        return {"flow": self.flow}

    def report(self):
        return {"end": self.level / self.flow}


class Faster:
    """Adaptation: a little more flow after each part, by what was left of it (its state is a sum)."""

    def __init__(self):
        self.total = 0.0

    def next(self, controller, part_log):
        self.total += float(part_log.outcome.leak[0])
        return Drain(controller.flow + 0.1 + 0.01 * self.total, controller.period)


def noisy_tank():
    return Tank(leak=0.5)


def rng_of(seed):
    return np.random.default_rng(seed)
