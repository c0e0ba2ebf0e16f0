"""Free sliding distance against push speed as a rising table; shorter or slower pushes that allow for it."""

import dataclasses
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from centering.push._contact.reaction import Pushable, parameter_rows, pushed
from centering.push._contact.reaction_kernels import FREE_SLIDE, TRAVEL
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats

_SPEED_MAX = 120.0  # mm/s; source: greatest speed of the slide, Mears (3.3)
_SPEEDS = 600  # chosen: nodes; fewer spoil the interpolation, more cost time at the first call
_PERIODS = 3.0  # chosen: periods of part on contact in which the first contact surely ends
_BISECTIONS = 60  # derived: halvings after which the interval is below rounding


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FreeSlideTable:
    """Free sliding distance against push speed; `free_slide_table` makes it.

    The tip pushes at constant speed from first touch. Up to a threshold speed the part never leaves it.

    Parameters
    ----------
    speed, distance : array, (n,)
        Push speeds, mm/s, rising from the threshold; free sliding distances, mm, rising from 0.

    Examples
    --------
    >>> from centering import preset
    >>> table = free_slide_table(preset("printed").model)
    >>> round(float(table.distance_at(100.0 / 3.0)), 4), float(table.distance_at(10.0))  # mm
    (0.8599, 0.0)
    >>> round(table.threshold_speed, 3), round(float(table.speed_for(0.1)), 2)  # mm/s
    (10.186, 13.14)
    """

    speed: Floats
    distance: Floats

    @property
    def threshold_speed(self) -> float:
        """Greatest speed at which the part does not leave the tip, mm/s."""
        return float(self.speed[0])

    def distance_at(self, speed: npt.ArrayLike) -> Floats:
        """Return the free sliding distance, mm.

        Parameters
        ----------
        speed : array-like
            Push speeds, mm/s, within the table.

        Raises
        ------
        ValueError
            When a speed is < 0 or above the table.
        """
        v = checks.finite_array("speed", speed, "mm/s")
        if np.any(v < 0.0) or np.any(v > self.speed[-1]):
            raise checks.refuse("speed", f"in [0, {self.speed[-1]:g}]", v, "mm/s")
        return np.asarray(np.interp(v, self.speed, self.distance))

    def speed_for(self, distance: npt.ArrayLike) -> Floats:
        """Return the greatest push speed that slides no further than a distance, mm/s; the threshold for 0.

        Parameters
        ----------
        distance : array-like
            Distances, mm, within the table.

        Raises
        ------
        ValueError
            When a distance is < 0 or above the table.
        """
        d = checks.finite_array("distance", distance, "mm")
        if np.any(d < 0.0) or np.any(d > self.distance[-1]):
            raise checks.refuse("distance", f"in [0, {self.distance[-1]:g}]", d, "mm")
        return np.asarray(np.interp(d, self.distance, self.speed))

    def augmented_stroke(self, stroke: float, speed: float) -> float:
        """Return the stroke less the free slide at a speed, mm; at least 0.

        Parameters
        ----------
        stroke, speed : float
            Wanted travel of the part, mm; push speed, mm/s.

        Raises
        ------
        ValueError
            When the stroke is not > 0, or the speed not in the table.
        """
        return max(checks.positive("stroke", stroke, "mm") - float(self.distance_at(speed)), 0.0)

    def augmented_speed(self, stroke: float, speed: float) -> float:
        """Return the speed, lowered so that the part slides no further than the stroke, mm/s.

        Parameters
        ----------
        stroke, speed : float
            Wanted travel of the part, mm; greatest push speed, mm/s.

        Raises
        ------
        ValueError
            When an argument is not > 0.
        """
        wanted = checks.positive("stroke", stroke, "mm")
        v = checks.positive("speed", speed, "mm/s")
        return v if wanted >= self.distance[-1] else min(v, float(self.speed_for(wanted)))

    def __repr__(self) -> str:
        ends = f"{self.threshold_speed:.4g} to {self.speed[-1]:.4g} mm/s"
        return f"FreeSlideTable({ends}: 0 to {self.distance[-1]:.4g} mm)"


def free_slide_table(model: Pushable, *, speed_max: float = _SPEED_MAX) -> FreeSlideTable:
    """Return the free sliding distance against the push speed; tables of the last 64 models are cached.

    For a part that never leaves the tip the table has one speed, `speed_max`, with distance 0.

    Parameters
    ----------
    model : PushModel
        Model of part and contact.
    speed_max : float
        Greatest speed of the table, mm/s.

    Raises
    ------
    ValueError
        When the speed is not > 0.

    Examples
    --------
    >>> from centering import preset
    >>> free_slide_table(preset("identified").model)
    FreeSlideTable(4.821 to 120 mm/s: 0 to 6.24 mm)
    """
    law = parameter_rows(model)[0]
    return _table(tuple(law.tolist()), checks.positive("speed_max", speed_max, "mm/s"))


@lru_cache(maxsize=64)
def _table(law: tuple[float, ...], speed_max: float) -> FreeSlideTable:
    parameters = np.array(law)
    if _slides(parameters, np.array([speed_max]))[0] <= 0.0:
        return FreeSlideTable(lasting([speed_max]), lasting([0.0]))
    threshold = _threshold(parameters, speed_max)
    dense = np.linspace(0.0, 1.0, _SPEEDS) ** 2  # nodes crowd at the threshold, where the distance is steep
    speed = threshold + (speed_max - threshold) * dense
    distance = np.maximum.accumulate(np.concatenate(((0.0,), _slides(parameters, speed[1:]))))
    return FreeSlideTable(lasting(speed), lasting(distance))


def _threshold(parameters: Floats, speed_max: float) -> float:
    """Greatest speed without a free slide, by bisection."""
    low, high = 0.0, speed_max
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if _slides(parameters, np.array([middle]))[0] > 0.0:
            high = middle
        else:
            low = middle
    return low


def _slides(parameters: Floats, speed: Floats) -> Floats:
    """Longest free slide at each speed, mm."""
    mass, stiffness, damping, static, coulomb, _ = parameters
    contact = _PERIODS * 2.0 * np.pi * np.sqrt(mass / stiffness) + (static + damping * speed) / (
        stiffness * speed
    )
    flight = 4.0 * mass * (speed + static / np.sqrt(mass * stiffness)) / coulomb
    pushes = [TipProfile.constant_speed(v, t) for v, t in zip(speed, contact + flight, strict=True)]
    return pushed(parameters, pushes, TRAVEL)[:, FREE_SLIDE]
