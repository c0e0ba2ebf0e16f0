"""Controllers that go wrong in one step of a part, for runs against the clock."""

import os
import signal
import time

from hwsim_fakes import Drain

PERIOD = 0.02  # s; a busy machine delays a step by some ms


class Failing(Drain):
    """Opens the tap at every step, and does what it is told to do wrong at the fifth."""

    def __init__(self, wrong, at=5, flow=10.0, period=PERIOD):
        super().__init__(flow, period)
        self.wrong, self.at = wrong, at

    def step(self, **read):
        command = super().step(**read)
        return command if self.steps != self.at else self.wrong() or command


def broken():
    raise KeyError("sensor")


def leaving():
    raise SystemExit(3)


def not_a_number():
    return {"flow": float("nan")}


def unknown():
    return {"flaw": 1.0}


def asleep(seconds):
    return lambda: time.sleep(seconds)


def looping():
    end = time.monotonic() + 0.2
    while time.monotonic() < end:
        pass


def sent(number):
    return lambda: os.kill(os.getpid(), number)


INTERRUPT, TERMINATE = sent(signal.SIGINT), sent(signal.SIGTERM)
