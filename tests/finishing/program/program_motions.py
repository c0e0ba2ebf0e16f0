"""Four motions of a UR10 that programs have to follow."""

from functools import cache

import numpy as np

from sdpgrind import finishing, units

PLACE = (650.0, -25.0, 100.0)
UR10 = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
IRB2400 = finishing.robot("irb2400").replace(tool=finishing.tool(length=150.0, axis="x"))
DIE = finishing.surface.nominal_surface()


def loop():
    """A closed loop of eight sides on a plate, rounded: a tool turned into the feed makes a full turn."""
    angle = np.pi / 4 * np.arange(10) + 0.2
    nodes = 0.5 + 0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return finishing.Path(finishing.surface.flat_surface(30.0), nodes).blended(0.3)


PROBLEMS = {
    "corners": {"path": finishing.zigzag(DIE, pitch=16.0), "placement": (*PLACE, 0.3)},
    "blends": {"path": finishing.zigzag(DIE, pitch=16.0).blended(0.3)},
    "full turn": {"path": loop(), "heading": "feed_aligned", "contact_angle": units.deg(80)},
    "near pi": {"path": finishing.hilbert(DIE, 2), "contact_angle": units.deg(90)},
}


SMALL = {"path": finishing.hilbert(DIE, 1), "contact_angle": units.deg(90)}
"""A short one, for many checks."""


@cache
def planned(name):
    """Motion of one of the four problems, or the small one."""
    fields = SMALL if name == "small" else PROBLEMS[name]
    return finishing.plan(finishing.FinishingProblem(**{"robot": UR10, "placement": PLACE} | fields))
