"""A bead, a disc, and small controllers for the force table."""

from typing import ClassVar

import numpy as np

import hwsim
from sdpgrind.weldbead import GrindingProcess
from sdpgrind.weldbead.passes import Contour, PassProblem, TiltedDisc

STEADY = hwsim.CoefficientScatter(0.0, 0.0, 0.0)
PROCESS = GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)


def disc(process=PROCESS, **changes):
    return TiltedDisc(process, **{"relaxed_angle": np.deg2rad(20.0), "rotational_stiffness": 6e5} | changes)


def problem(length=40.0, height=1.0, wave=0.0, **changes):
    x = np.linspace(0, length, round(10 * length) + 1)
    bead = Contour(x, height + wave * np.sin(2 * np.pi * x / 20))
    return PassProblem(disc(**changes), bead, mean_cut=0.1, feed_rate=20.0)


class Passes:
    """Commands so many passes, then stops."""

    period = None
    reads: ClassVar = {"height": "mm"}
    commands: ClassVar = {"start": "", "feed_rate": "mm/s", "stop": ""}

    def __init__(self, number, feed_rate=20.0):
        self.number, self.feed_rate = number, feed_rate

    def reset(self):
        self.begun = 0

    def step(self, **measured):
        self.begun += 1
        return {"stop": 1.0} if self.begun > self.number else {"start": 1.0, "feed_rate": self.feed_rate}


class Held:
    """Holds the platform where it is told to, or a force by plain integral action."""

    period = 1 / 60
    reads: ClassVar = {
        "force": "N",
        "friction_force": "N",
        "disk_speed": "rad/s",
        "pass_time": "s",
        "phase": "",
    }
    commands: ClassVar = {"platform_command": "mm"}

    def __init__(self, position, force=None, gain=0.002):
        self.position, self.force, self.gain = position, force, gain

    def reset(self):
        self.now = self.position

    def step(self, *, force, phase, **others):
        if phase == 1.0:
            self.now = self.position
        elif self.force is not None and force == force:
            self.now += self.gain * (self.force - force)
        return {"platform_command": self.now}


class Tiers:
    period = None

    def __init__(self, **tiers):
        self.tiers = tiers

    def reset(self):
        for tier in self.tiers.values():
            tier.reset()

    def step(self, **measured):
        return {}


def platform(tip_height, process=PROCESS):
    """Platform position that has the tip of the relaxed disc at a height."""
    return -(tip_height + process.disk_radius * np.sin(np.deg2rad(20.0)))


def quiet(given, **options):
    """A stand without runout, stiction, noise or scatter."""
    from sdpgrind.weldbead.force import SensorChain, table_drive

    still = hwsim.devices.Gauge()
    calm = {
        "pass_scatter": STEADY,
        "runout": 0.0,
        "drive": table_drive(),
        "sensor": SensorChain(noise_sd=0.0, quantum=0.0),
        "speed_gauge": still,
        "feed_gauge": still,
        "table_gauge": still,
        "scanner": hwsim.devices.Scanner(noise_sd=0.0),
    }
    return hwsim.ForceTableStand(given, **calm | options)
