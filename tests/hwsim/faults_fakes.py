"""A machine that counts its samples, and the rows of its readings under each fault, in plain lists."""

from dataclasses import dataclass
from math import nan
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class Counter:
    """Reads 1, 2, 3 ... as ``x`` and ``y``, its time as ``clock``, and random numbers; ends after `steps` ticks.

    Every fifth tick is an event where `events`; then it stands still until a command comes.
    """

    steps: int = 40
    tick: float = 0.1
    events: bool = False
    measures: ClassVar = {"x": "mm", "y": "N", "clock": "s", "noise": "mm"}
    accepts: ClassVar = {"speed": "mm/s", "stop": ""}
    outcomes: ClassVar = {"place": "mm", "truth": "mm"}
    job: ClassVar = {"length": (5.0, "mm")}
    safe: ClassVar = {"speed": 0.0}

    def start(self, rng):
        return Counting(self, *rng.spawn(2))

    def with_tick(self, tick):
        return Counter(self.steps, tick, self.events)


class Counting:
    def __init__(self, counter, of_truth, of_noise):
        self.counter, self.truth, self.rng = counter, float(of_truth.random()), of_noise
        self.time, self.done, self.event = 0, False, False
        self.speed, self.place, self.samples, self.waiting = 0.0, 0.0, 1, True
        self.taken, self.noise = [], float(of_noise.random())

    def step(self, command, ticks):
        if command:
            self.taken.append((self.time, dict(command)))
            self.waiting = False
        self.speed = command.get("speed", self.speed)
        self.done = self.done or bool(command.get("stop"))
        if ticks and not self.done:
            self._go_on(ticks)
        time = self.time * self.counter.tick
        return {"x": float(self.samples), "y": float(self.samples), "clock": time, "noise": self.noise}

    def _go_on(self, ticks):
        self.event = False
        if self.counter.events:
            if self.waiting and ticks >= 2**62:
                return
            ticks = ticks if self.waiting else min(ticks, 5 - self.time % 5)
        ticks = min(ticks, self.counter.steps - self.time)
        self.time += ticks
        self.samples += 1
        self.place += ticks * self.speed
        self.noise = float(self.rng.random())
        self.done = self.time >= self.counter.steps
        if self.counter.events and not self.waiting and self.time % 5 == 0:
            self.event = self.waiting = True

    def outcome(self):
        return {"place": self.place, "truth": self.truth}


class Steady:
    """Commands one speed each period, and keeps what it read."""

    commands: ClassVar = {"speed": "mm/s"}

    def __init__(self, period=0.1):
        self.period, self.read = period, []

    def reset(self):
        self.read = []

    def step(self, **measured):
        self.read.append(measured)
        return {"speed": 1.0 + 0.1 * len(self.read)}


def readings(plant, steps=6, of="x", seed=0):
    """A measurement at samples 0, 1, 2 ... of a part that is stepped tick by tick."""
    machine = plant.start(np.random.default_rng(seed))
    return [machine.step({}, k > 0)[of] for k in range(steps)]


# rows of faults on rows, sample by sample; the obvious twin of the machines
def dead_time(row, samples):
    return [nan] * min(samples, len(row)) + row[: max(0, len(row) - samples)]


def repeated(row, at):
    return [row[k - 1] if k in at else value for k, value in enumerate(row)]


def dropped(row, at):
    return [nan if k in at else value for k, value in enumerate(row)]


def stuck(row, at):
    return [row[min(k, at)] for k in range(len(row))]


def added(row, at, by):
    return [value + by if k in at else value for k, value in enumerate(row)]
