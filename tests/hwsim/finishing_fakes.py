"""A small finishing job, what it takes to run it, and controllers that one can work out by hand."""

from functools import cache

import numpy as np

import hwsim
from hwsim.plants._finishing import machine as _finishing_machine
from sdpgrind import finishing

AXIS = finishing.TorqueAxis()
SIDE = 6.4  # mm


@cache
def problem(order=2, **options):
    """A Hilbert path on a flat specimen; without friction unless it is asked for."""
    path = finishing.hilbert(finishing.surface.flat_surface(SIDE), order, mapping="parametric")
    return finishing.FinishingProblem(path, **{"friction_ratio": 0.0, **options})


@cache
def line(side=50.0, **options):
    """Five straight passes over four fifths of a flat square, along x, and short steps along y."""
    path = finishing.zigzag(finishing.surface.flat_surface(side), pitch=0.2 * side)
    return finishing.FinishingProblem(path, **{"friction_ratio": 0.0, **options})


@cache
def motion(of):
    return finishing.plan(of)


def controller(of, kind="pidff", **options):
    return finishing.TorqueController(AXIS, motion(of), **{"normal_force": 1.11, "kind": kind, **options})


def truth(of, **changes):
    """As believed, with a table that is always where it shall be; changes of the axis by name."""
    axis = AXIS.replace(**{name: changes.pop(name) for name in list(changes) if hasattr(AXIS, name)})
    return hwsim.CellTruth(
        axis, **{"friction_ratio": of.friction_ratio, "table": None, "roughness_error": 0.0, **changes}
    )


def cell(of, **changes):
    """A cell with a truth that is changed by name."""
    return hwsim.FinishingCell(of, truth=truth(of, **changes))


def lever(of, friction_ratio=0.0, forward=1.0):
    """Torque over normal force, N m/N, for a share of the feed along the azimuth."""
    side = 1.0 if of.pushed else -1.0
    return (
        1e-3
        * of.lever_arm
        * (np.cos(of.contact_angle) - side * friction_ratio * np.sin(of.contact_angle) * forward)
    )


def by_the_loop(monkeypatch):
    """Let parts go step by step, as under any controller."""
    monkeypatch.setattr(_finishing_machine.FinishingPart, "whole", lambda self, controller: None)


class Steady:
    """A current and an override that are held, after a motion was given."""

    def __init__(self, current, override, profile=None, period=1e-3):
        self.current, self.override, self.profile, self.period = current, override, profile, period

    def reset(self):
        self.begun = False

    def step(self, **measured):
        command = {"current": self.current, "feed_override": self.override}
        if not self.begun and self.profile is not None:
            command["motion"] = self.profile
        self.begun = True
        return command
