"""Samples of a profile with prior knowledge, the input of its steps."""

import dataclasses
from functools import cached_property

from centering.roundness._part_frame import into_part
from centering.roundness._roller import RollerError
from centering.roundness._sampling import turns_of
from sdpgrind.base.checks import Floats

CONDITION_MAX = 1e3  # chosen: condition above which a fit is refused: errors may grow by as much


@dataclasses.dataclass(frozen=True, eq=False)
class Samples:
    """Samples, first circle (radius, x, y; mm), removed runout, known noise; tip radius < 0 in a bore.

    `noise_given`: whether the noise was given, not found in residuals.
    """

    angle: Floats
    reading: Floats
    tip_radius: float
    circle: Floats
    runout: RollerError | None
    noise_sd: float | None
    noise_given: bool = False

    @cached_property
    def turns(self) -> float:
        """Turns covered by the angles."""
        return turns_of(self.angle)

    @cached_property
    def part_angle(self) -> Floats:
        """Part angles about the first circle, rad."""
        return self.about(self.circle, self.tip_radius)[0]

    def about(self, circle: Floats, tip_radius: float) -> tuple[Floats, Floats]:
        """Part angle (rad) and deviation (mm) of each sample about a circle."""
        part_angle, distance = into_part(self.angle, self.reading, tip_radius, circle[1:])
        return part_angle, distance - tip_radius - circle[0]
