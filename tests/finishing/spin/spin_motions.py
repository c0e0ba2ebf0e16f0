"""Motions of a UR10 over a sphere whose tool may turn about its own axis."""

from functools import cache

import numpy as np

from sdpgrind import finishing

PLACE = (650.0, -25.0, 100.0)
SPHERE = finishing.surface.sphere_surface(25.0)
TILTED = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0, tilt=0.5))
STRAIGHT = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))


def problem(robot=TILTED, pitch=24.0, **changes):
    """Zigzag over the sphere, face-on with 24 turns, but for changes."""
    fields = {"contact_angle": np.pi / 2, "placement": PLACE, "spin": 24} | changes
    return finishing.FinishingProblem(finishing.zigzag(SPHERE, pitch=pitch), robot=robot, **fields)


@cache
def planned(**changes):
    """Motion of a problem; the same for the same changes."""
    return finishing.plan(problem(**changes))
