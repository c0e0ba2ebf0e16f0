"""Vectors of the tool at every contact over a range of azimuths on the work, with a bound of their motion.

With a fixed heading the tool at contact i turns about the normal n when the azimuth b on the work changes.
With l = (cos b, sin b, 0) the heading is h = (l - (n.l) n)/|...|. Projection on the tangent plane keeps
``(l x l') . n = n_z``, so h turns about n at the rate t' = n_z/(1 - (n.l)^2) per b. A vector v that is fixed
in the tool moves by dv/db = t' n x v, and as seen in a frame that turns with the azimuth by

    dv/db = (t' n - z) x v,    |dv/db| <= |v| sqrt(t'^2 - 2 t' n_z + 1) = |v| sqrt(n_z^2 (k^2 - 2 k) + 1)

with k = 1/(1 - (n.l)^2) >= 1, in which the root rises. On a level surface (n = z, k = 1) it is 0: the whole
path turns with the tool. Over a range of azimuths the greatest k gives the bound that proofs use.
"""

import math
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.placement._task import PlacingTask

FIRST = 16  # chosen: ranges of azimuths at first; those that do not suffice are halved


class AzimuthRange(NamedTuple):
    """Azimuths on the work from centre - half to centre + half, rad."""

    centre: float
    half: float

    def halves(self) -> tuple["AzimuthRange", "AzimuthRange"]:
        """Both halves."""
        quarter = self.half / 2
        return AzimuthRange(self.centre - quarter, quarter), AzimuthRange(self.centre + quarter, quarter)

    def middle(self) -> "AzimuthRange":
        """The azimuth in the middle alone."""
        return AzimuthRange(self.centre, 0.0)


class SweptVectors(NamedTuple):
    """Vectors at every contact, in a frame that turns with the azimuth (m, 3), and their greatest motion."""

    vectors: Floats
    off: Floats


def ranges(task: PlacingTask) -> list[AzimuthRange]:
    """Ranges that hold all azimuths which the problem leaves free."""
    if not task.turns_freely:
        return [AzimuthRange(0.0, 0.0)]
    half = math.pi / FIRST
    return [AzimuthRange((2 * k + 1) * half, half) for k in range(FIRST)]


def swept(task: PlacingTask, over: AzimuthRange, vector: Floats) -> SweptVectors:
    """Return a vector fixed in the tool frame P (3,), at every contact, over a range of azimuths.

    For all azimuths in the range each vector differs from the returned one by at most ``off``, in the frame
    that turns about z with the azimuth; units are those of the vector.
    """
    n, level = task.normal, np.array([math.cos(over.centre), math.sin(over.centre), 0.0])
    if task.turns_freely:
        along = level - (n @ level)[:, None] * n
        size = np.linalg.norm(along, axis=1)
        along = along / np.maximum(size, np.finfo(float).tiny)[:, None]
    else:
        along = task.tangent
    c, s, side = math.cos(task.hold.contact_angle), math.sin(task.hold.contact_angle), task.hold.side
    found = vector[0] * (-s * along - side * c * n) + vector[1] * np.cross(n, along)
    found = found + vector[2] * (side * c * along - s * n)
    return SweptVectors(turned_back(found, over.centre), _moved(task, over) * float(np.linalg.norm(vector)))


def turned_back(vectors: Floats, angle: float) -> Floats:
    """Vectors (m, 3) in a frame that is turned about z by an angle, rad."""
    c, s = math.cos(angle), math.sin(angle)
    out: Floats = vectors @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return out


def _moved(task: PlacingTask, over: AzimuthRange) -> Floats:
    """Greatest motion of a unit vector at every contact; at most 2, from one end to the other."""
    if over.half == 0.0:
        return np.zeros(len(task.normal))
    n = task.normal
    apart = np.arctan2(n[:, 1], n[:, 0]) - over.centre
    apart = np.abs(apart - math.pi * np.round(apart / math.pi))  # from the normal's azimuth or its opposite
    nearest = np.cos(np.maximum(apart - over.half, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        k = 1.0 / (1.0 - (n[:, 0] ** 2 + n[:, 1] ** 2) * nearest**2)
        rate = np.sqrt(np.maximum(n[:, 2] ** 2 * (k * k - 2 * k) + 1.0, 0.0))
    rate = np.where(np.isfinite(rate) & (k > 0), rate, math.inf)
    out: Floats = np.minimum(rate * over.half, 2.0)
    return out
