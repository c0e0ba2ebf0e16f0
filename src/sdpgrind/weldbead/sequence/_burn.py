"""Burn limits: each gives the interval of admissible normal force."""

from collections.abc import Callable, Mapping
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import physics
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.weldbead.sequence._process import GrindingProcess


class BurnLimit(Protocol):
    """Law that keeps the work from burning: an interval of normal force, N, at each feed, mm/s."""

    def interval(self, process: GrindingProcess, feed_rate: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return the least and greatest admissible normal force, N, of a process at a feed, mm/s.

        The least exceeds the greatest where no force is admissible.
        """

    def margin(
        self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike
    ) -> Floats:
        """Return the margin, N or W, of a process at a force, N, and a feed, mm/s; < 0: it burns."""


@described("weldbead.force_burn_limit")
class ForceBurnLimit(Described):
    """Normal force at most C_B sqrt(V); Brown (1988), (5.11).

    Parameters
    ----------
    burn_coefficient : float
        C_B, N/(mm/s)^(1/2).

    Raises
    ------
    ValueError
        When the coefficient is not positive.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> low, high = ForceBurnLimit(16.0).interval(process, feed_rate=4.0)
    >>> float(low), float(high)
    (0.0, 32.0)
    """

    burn_coefficient: float = quantity("N/(mm/s)^(1/2)", above=0)

    def interval(self, process: GrindingProcess, feed_rate: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return the least and greatest normal force, N, of a process at a feed, mm/s."""
        high = np.asarray(self.burn_coefficient * np.sqrt(np.asarray(feed_rate, dtype=float)))
        return np.zeros(high.shape), high

    def margin(
        self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike
    ) -> Floats:
        """Return the margin, N, of a process at a normal force, N, and a feed, mm/s; < 0: it burns."""
        return np.asarray(self.interval(process, feed_rate)[1] - np.asarray(normal_force, dtype=float))


@described("weldbead.power_burn_limit")
class PowerBurnLimit(Described):
    """Power at the contact at most C sqrt(V): Ivers. Without droop it equals a limit of force.

    Parameters
    ----------
    burn_coefficient : float
        C, W/(mm/s)^(1/2).

    Raises
    ------
    ValueError
        When the coefficient is not positive.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> float(PowerBurnLimit(204.0).interval(process, feed_rate=4.0)[1])
    32.0
    """

    burn_coefficient: float = quantity("W/(mm/s)^(1/2)", above=0)

    def interval(self, process: GrindingProcess, feed_rate: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return the least and greatest normal force, N, of a process at a feed, mm/s; inf: a weak drive."""
        high = process.force_of_power(self.burn_coefficient * np.sqrt(np.asarray(feed_rate, dtype=float)))
        return np.zeros_like(high), high

    def margin(
        self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike
    ) -> Floats:
        """Return the margin, W, of a process at a normal force, N, and a feed, mm/s; < 0: it burns."""
        allowed = self.burn_coefficient * np.sqrt(np.asarray(feed_rate, dtype=float))
        return np.asarray(allowed - process.grinding_power(normal_force))


@described("weldbead.malkin_burn_limit")
class MalkinBurnLimit(Described):
    """Energy per area of work at most u0 d + B (D d)^(1/4) V^(-1/2), d the mean cut; Brown (1988), (4.3).

    With an idle power light cuts burn too, as their contact is too short to carry it off: the admissible
    forces form an interval, which may be empty.

    Parameters
    ----------
    u0 : float
        Energy carried away by the chips, J/mm^3.
    B : float
        Heat that the surface can take up, J/(mm^2 s^(1/2)).
    diameter : float
        Wheel diameter, mm.

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> process = GrindingProcess(10.0, 20.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> low, high = MalkinBurnLimit.published(diameter=170.0).interval(process, feed_rate=10.0)
    >>> float(low.round(4)), float(high.round(3))
    (1.5686, 269.88)
    """

    u0: float = quantity("J/mm^3", above=0)
    B: float = quantity("J/(mm^2 s^(1/2))", above=0)
    diameter: float = quantity("mm", above=0, usual=(5.0, 3000.0), typical=170)

    @classmethod
    def published(cls, diameter: float) -> Self:
        """Return the limit with Malkin's printed coefficients for a wheel diameter, mm."""
        return cls(*physics.malkin_burn_coefficients(), diameter)

    def interval(self, process: GrindingProcess, feed_rate: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return the least and greatest force, N, of a process at a feed, mm/s; inf and 0: none."""
        feed = np.asarray(feed_rate, dtype=float)
        depths = np.array([self._depths(process, rate) for rate in feed.ravel()]).reshape(*feed.shape, 2)
        forces = process.normal_force(np.where(np.isfinite(depths), depths, 0.0), feed[..., None])
        low, high = np.moveaxis(np.where(np.isfinite(depths), forces, np.inf), -1, 0)
        return low, np.where(np.isinf(low), 0.0, high)

    def _depths(self, process: GrindingProcess, feed_rate: float) -> physics.BurnOnset:
        """Return the depths, mm, between which (K1 - u0) d + K2/(w V) - c d^(1/4) <= 0."""
        steep = process.specific_energy - self.u0
        idle = process.idle_power / (process.bead_width * feed_rate)
        carried = self.B * self.diameter**0.25 / feed_rate**0.5

        def surplus(root: float) -> float:  # a polynomial in the fourth root of the depth
            return float((steep * root**3 - carried) * root + idle)

        if steep <= 0:
            far = _beyond(surplus)
            return physics.depths_between(surplus, far, far)
        best = (carried / (4 * steep)) ** (1 / 3)
        return physics.depths_between(surplus, best, 2 * best)

    def margin(
        self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike
    ) -> Floats:
        """Return the margin, W, of a process at a normal force, N, and a feed, mm/s; < 0: it burns."""
        feed = np.asarray(feed_rate, dtype=float)
        allowed = physics.BurningLimit(self.u0, self.B).power(
            depth_of_cut=process.mean_cut(normal_force, feed), work_speed=feed,
            equivalent_diameter=self.diameter, width=process.bead_width,
        )  # fmt: skip
        return np.asarray(allowed - process.grinding_power(normal_force))


def _beyond(surplus: Callable[[float], float]) -> float:
    """Return a place where a falling function is negative."""
    end = 1.0
    while surplus(end) > 0:
        end *= 2
    return end


BURN_LIMITS: Mapping[str, type[BurnLimit]] = {
    "force": ForceBurnLimit,
    "power": PowerBurnLimit,
    "malkin": MalkinBurnLimit,
}
"""Burn limits by the names that files give them."""
NAMES = tuple(cls.__name__ for cls in BURN_LIMITS.values())
