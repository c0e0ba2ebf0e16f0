"""Static cut: mean removal of a disc pressed on a bead and fed along it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind import physics
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, another_unit, described, quantity, units_of
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.base.warned import warn

RIM_MAX = 125e3  # mm/s, chosen: bonded discs run at 80 m/s, few at 100; one in rev/min for rad/s is beyond
# J/mm^3 and 1, chosen: steel takes 5 to 60 and 0.2 to 0.6; beyond, a value is in another unit
ENERGIES, RATIOS = (0.1, 1000.0), (0.01, 3.0)
_LEAST_POWER = 1.0  # W, chosen: a grinder whose idle power is less, but not 0, is told in kW


class Coefficients(NamedTuple):
    """C1 (mm^2/N), C2 (mm^2/s), C3 (1/s, at free speed) of cut = (C1 C3 F + C2)/V; Brown (1988), (4.6)."""

    C1: float
    C2: float
    C3: float


@described("weldbead.process")
class GrindingProcess(Described):
    """Grinding of a bead with a disc; Brown (1988), (4.4) to (4.8), in J, W, N, mm, s.

    The power at the contact is 1e-3 mu R F (omega0 - beta mu R F) W. Its excess over the idle power removes
    metal.

    Parameters
    ----------
    specific_energy : float
        Energy K1 to remove a volume, J/mm^3.
    idle_power : float
        Power K2 that removes nothing, W.
    friction_ratio : float
        Ratio mu of tangential to normal force, unit 1.
    disk_radius : float
        Disc radius R, mm.
    free_speed : float
        Disc speed omega0 without load, rad/s.
    speed_droop : float
        Loss of speed beta per shaft torque, rad/(s N mm); 0: a stiff drive.
    bead_width : float
        Width w of the bead, mm.

    Raises
    ------
    ValueError
        When a value is not finite, an idle power or a droop is negative, another value is not positive, or
        the rim of the disc is faster than any (125 m/s).

    Examples
    --------
    >>> process = GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    >>> float(process.mean_cut(normal_force=50.0, feed_rate=12.5))
    0.344
    """

    specific_energy: float = quantity("J/mm^3", above=0)
    idle_power: float = quantity("W", at_least=0)
    friction_ratio: float = quantity("1", above=0)
    disk_radius: float = quantity("mm", above=0, usual=(5.0, 1000.0), typical=90)
    free_speed: float = quantity("rad/s", above=0, usual=(10.0, 5000.0), typical=500)
    speed_droop: float = quantity("rad/(s N mm)", at_least=0)
    bead_width: float = quantity("mm", above=0, usual=(0.5, 500.0), typical=12)

    def _check(self) -> None:
        rim = self.disk_radius * self.free_speed
        if rim > RIM_MAX:
            raise ValueError(
                f"free_speed must be in rad/s, some 500; the rim of a disc of {self.disk_radius:g} mm would"
                f" run at {rim / 1e3:.4g} m/s, {RIM_MAX / 1e3:g} at most; units.rpm(...) for rev/min;"
                f" got {self.free_speed!r}"
            )

    def _torque(self, normal_force: npt.ArrayLike) -> Floats:
        force = np.asarray(normal_force, dtype=float)
        return np.asarray(physics.disk_torque(force, self.friction_ratio, self.disk_radius))

    def disk_speed(self, normal_force: npt.ArrayLike) -> Floats:
        """Return the disc speed, rad/s, under a normal force, N; 0: stalled. Brown (4.8)."""
        return np.asarray(
            np.maximum(physics.disk_speed(self._torque(normal_force), self.free_speed, self.speed_droop), 0.0)
        )

    def grinding_power(self, normal_force: npt.ArrayLike) -> Floats:
        """Return the power at the contact, W, of a normal force, N; 0: stalled. Brown (4.4c)."""
        return np.asarray(
            np.maximum(physics.disk_power(self._torque(normal_force), self.free_speed, self.speed_droop), 0.0)
        )

    def removal_rate(self, normal_force: npt.ArrayLike) -> Floats:
        """Return the removal rate, mm^3/s, of a normal force, N; never negative. Brown (4.4a)."""
        power = self.grinding_power(normal_force)
        return np.asarray(np.maximum(physics.removal_rate(power, self.specific_energy, self.idle_power), 0.0))

    def mean_cut(self, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike) -> Floats:
        """Return the mean depth, mm, at a normal force, N, and a feed, mm/s; never < 0. Brown (4.5)."""
        return self.removal_rate(normal_force) / (self.bead_width * np.asarray(feed_rate, dtype=float))

    def force_of_power(self, grinding_power: npt.ArrayLike) -> Floats:
        """Return the smaller normal force, N, that makes a grinding power, W; inf: none does."""
        power = np.asarray(grinding_power, dtype=float)
        reached = power <= self.peak_power
        torque = physics.torque_of_power(np.where(reached, power, 0.0), self.free_speed, self.speed_droop)
        return np.where(reached, torque / (self.friction_ratio * self.disk_radius), np.inf)

    def normal_force(self, mean_cut: npt.ArrayLike, feed_rate: npt.ArrayLike) -> Floats:
        """Return the least normal force, N, of a mean cut, mm, at a feed, mm/s; inf: none reaches it."""
        rate = self.bead_width * np.asarray(mean_cut, dtype=float) * np.asarray(feed_rate, dtype=float)
        return self.force_of_power(self.idle_power + self.specific_energy * rate)

    @property
    def threshold_force(self) -> float:
        """Normal force whose power is the idle power, N; less removes nothing. inf: none reaches it."""
        return float(self.force_of_power(self.idle_power))

    @property
    def peak_force(self) -> float:
        """Normal force of greatest power, N; more never grinds more. inf without droop."""
        if self.speed_droop == 0:
            return np.inf
        return float(
            physics.peak_torque(self.free_speed, self.speed_droop) / (self.friction_ratio * self.disk_radius)
        )

    @property
    def peak_power(self) -> float:
        """Greatest power at the contact, W; inf without droop."""
        if self.speed_droop == 0:
            return np.inf
        torque = physics.peak_torque(self.free_speed, self.speed_droop)
        return float(physics.disk_power(torque, self.free_speed, self.speed_droop))

    @property
    def coefficients(self) -> Coefficients:
        """C1 (mm^2/N), C2 (mm^2/s) and C3 (1/s) of Brown (4.6); C3 at the free speed, mu included."""
        return Coefficients(
            C1=1 / (N_MM_S_PER_W * self.specific_energy),
            C2=-self.idle_power / (self.bead_width * self.specific_energy),
            C3=self.friction_ratio * self.disk_radius * self.free_speed / self.bead_width,
        )


def refuse_other_energy(process: GrindingProcess) -> None:
    """Refuse a specific energy that is in another unit."""
    energy = process.specific_energy
    if not ENERGIES[0] <= energy <= ENERGIES[1]:
        unit = units_of(GrindingProcess)["specific_energy"]
        raise ValueError(another_unit("specific_energy", energy, unit, ENERGIES, 10.0))


def check_units(process: GrindingProcess) -> None:
    """Refuse coefficients in other units. They are estimated, too: a `GrindingProcess` may hold any."""
    refuse_other_energy(process)
    if not RATIOS[0] <= process.friction_ratio <= RATIOS[1]:
        raise ValueError(
            "friction_ratio must be tangential over normal force, some 0.3; divide by 100 where percent is"
            f" meant; got {process.friction_ratio!r}"
        )
    if 0 < process.idle_power < _LEAST_POWER:
        warn(f"idle_power is {process.idle_power:g} W, some 100 are usual: multiply by 1000 for kW")
