"""Maps of the unit square onto the parameters of a surface, for curves with their first two derivatives."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._equal_area import equal_area
from sdpgrind.finishing.surface._creases import refuse_creases
from sdpgrind.finishing.surface._surface import Surface

MAPPINGS = ("parametric", "equal_area")


class Mapping(Protocol):
    """From curves in the unit square to curves in the parameters."""

    def carried(self, jets: Floats) -> Floats:
        """Carry (a, b) with two derivatives by a curve's t, (m, 3, 2), over into (u, v) with theirs."""

    def sides(self, places: Floats) -> Floats:
        """Carry places (m, 2) over into (u, v) with their derivatives by a and by b, (m, 3, 2)."""


@dataclass(frozen=True)
class Parametric:
    """The square stretched onto the domain, as in the source."""

    low: Floats
    high: Floats

    def carried(self, jets: Floats) -> Floats:
        """Carry jets of (a, b) over into jets of (u, v)."""
        image = jets * (self.high - self.low)
        image[:, 0] = np.minimum(image[:, 0] + self.low, self.high)  # rounding may step over the end
        return image

    def sides(self, places: Floats) -> Floats:
        """Carry places (m, 2) over into (u, v) with their derivatives by a and by b, (m, 3, 2)."""
        image = np.empty((len(places), 3, 2))
        image[:, 0] = np.minimum(places * (self.high - self.low) + self.low, self.high)
        image[:, 1:] = np.diag(self.high - self.low)
        return image


def mapping_of(name: str, surface: Surface) -> Mapping:
    """Return a mapping by its name."""
    if name == "equal_area":
        refuse_creases(surface, name)
        return equal_area(surface)
    low, high = np.transpose(surface.domain)
    return Parametric(low, high)
