"""A centering machine without errors, a controller that one can work out by hand, and ways to look inside a
part.
"""

from math import atan2, cos, hypot, isfinite, pi, sin, sqrt
from typing import ClassVar

import numpy as np
from centering_machine_inside import slots

from centering import PushScatter, preset
from hwsim import CenteringMachine, Ring

STILL = PushScatter(0.0, 0.0, 0.0, 0.0, 0.0)
RADIUS = 89.5


def problem(name="printed", **changes):
    return preset(name).replace(**changes)


def exact(of=None, **changes):
    """A machine that does and tells everything truly, at once."""
    plain = {"scatter": STILL, "errors": None, "scheduler": None, "tip_radius": 0.0}
    return CenteringMachine(of or problem(), **{**plain, **changes})


def at(x, y=0.0, radius=RADIUS):
    """A ring whose centre is there on the table."""
    return Ring(radius, hypot(x, y), atan2(y, x))


def started(machine, speed=0.0, seed=0):
    """A part, the table turning at a speed from the start."""
    part = machine.start(np.random.default_rng(seed))
    part._state[slots.SPEED] = part._state[slots.SPEED_SET] = speed
    return part


def running(part, speed):
    """The same part, its slide going toward the axis at that speed already: a profile that begins with it
    runs from the start.
    """
    part._state[slots.VELOCITY] = speed
    return part


def center(part):
    """Where the centre truly is: along the probe line and across it (in the sense of rising spindle angle),
    mm.
    """
    state = part._state
    x, y, angle = state[slots.X], state[slots.Y], state[slots.ANGLE]
    return x * cos(angle) + y * sin(angle), y * cos(angle) - x * sin(angle)


def constant(speed, duration):
    return np.array([[duration, speed, 0.0]])


def move(distance, speed, acceleration=2560.0):
    """Rest to rest, by rows."""
    if distance < speed**2 / acceleration:
        speed = sqrt(distance * acceleration)
    ramp = speed / acceleration
    return np.array(
        [[ramp, 0.0, acceleration], [distance / speed - ramp, speed, 0.0], [ramp, speed, -acceleration]]
    )[[0, 2] if distance / speed - ramp <= 1e-12 else [0, 1, 2]]


class Follower:
    """Follows the rim with the probe, measures a turn, pushes at the high point once a turn, and stops when
    it is near.
    """

    period = 0.01
    tier = "push"
    reads: ClassVar = {"angle": "rad", "slide": "mm", "probe": "mm", "pushing": ""}
    commands: ClassVar = {"velocity": "mm/s", "profile": "s, mm/s, mm/s^2", "profile_angle": "rad", "retract": "", "finished": "",
                          "spindle_speed": "rad/s"}  # fmt: skip

    def __init__(self, pushes=2, speed=2.0):
        self.pushes, self.speed = pushes, speed

    def reset(self):
        self.rim, self.since, self.made = [], 0.0, 0

    def step(self, *, angle, slide, probe, pushing, **others):
        if not self.rim:
            self.since = angle
        if isfinite(probe) and not pushing:
            self.rim.append((angle, slide + probe))
        following = {
            "spindle_speed": self.speed,
            "velocity": -25.0 * (probe + 7.928) if isfinite(probe) else 0.0,
        }
        if pushing or angle - self.since < 2 * pi:
            return following
        return following | self._act(np.array(self.rim), angle)

    def _act(self, rim, angle):
        design = np.column_stack([np.ones(len(rim)), np.cos(rim[:, 0]), np.sin(rim[:, 0])])
        _, x, y = np.linalg.lstsq(design, rim[:, 1], rcond=None)[0]
        if self.made >= self.pushes:
            return {"retract": 1.0, "finished": 1.0}
        self.made, self.rim = self.made + 1, []
        ahead = (atan2(y, x) - angle - 0.3) % (2 * pi)
        self.since = angle + ahead + 0.5
        return {
            "velocity": 0.0,
            "profile": move(7.0 + 0.9 * hypot(x, y), 40.0),
            "profile_angle": angle + ahead,
        }
