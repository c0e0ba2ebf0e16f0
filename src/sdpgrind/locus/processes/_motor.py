"""A motor moves a joint with drifting inertia: Koren's example of a response and its limit."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.locus._problem.process import Varying

KG_MM2_PER_N_MM_S2 = 1000.0  # derived: inertia (kg mm^2) accelerated by 1 N mm at 1 rad/s^2


@described("locus.motor_axis")
class MotorAxis(Described):
    """Turn a joint by an angle in least time, with a load of unmeasured inertia: Koren (20) to (22).

    Controls: ``speed`` omega (rad/s), the greatest of the move; ``acceleration`` (rad/s^2) at start and stop.
    Hidden state: ``inertia`` x (kg mm^2), changed by the other axes of a robot.

    * Cost angle/omega + omega/acceleration: duration of the move, s; valid for omega^2 <= angle acceleration.
    * Constraint ``motor_power`` omega (J_0 + x) acceleration (22), the greatest of the move, <= omega T_m
      (21), W.

    Koren prints response and limit; the cost is chosen. The locus is omega^2 = angle acceleration (a
    triangular speed profile), up to the greatest speed; lighter loads run at that speed.

    Parameters
    ----------
    inertia_base : float
        J_0, inertia of the motor, kg mm^2.
    torque_max : float
        T_m, greatest torque, N mm.
    angle : float
        Angle of the move, rad.

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> axis = MotorAxis(inertia_base=100.0, torque_max=1000.0, angle=60.0)
    >>> round(axis.best_acceleration(700.0)), round(axis.speed_on_locus(1250.0), 2)  # rad/s^2, rad/s
    (1250, 273.86)
    """

    _: KW_ONLY
    inertia_base: float = quantity("kg mm^2", above=0)
    torque_max: float = quantity("N mm", above=0)
    angle: float = quantity("rad", above=0, usual=(1e-3, 1000.0), typical=60)

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Motor power <= its limit by the torque at that speed, W."""
        return (Varying(response=self._power, limit=self._limit, name="motor_power", unit="W"),)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of controls, hidden state and cost."""
        return {"speed": "rad/s", "acceleration": "rad/s^2", "inertia": "kg mm^2", "cost": "s"}

    def cost(self, s: Any, c: Any) -> Any:
        """Return the duration (s) for controls ``c``, angle/omega + omega/acceleration; ``s`` is unused."""
        return self.angle / c.speed + c.speed / c.acceleration

    def _power(self, s: Any, c: Any) -> Any:
        """Koren (22) with (20)."""
        torque = (self.inertia_base + s.inertia) * c.acceleration / KG_MM2_PER_N_MM_S2
        return c.speed * torque / N_MM_S_PER_W

    def _limit(self, s: Any, c: Any) -> Any:
        """Koren (21)."""
        return c.speed * self.torque_max / N_MM_S_PER_W

    def best_acceleration(self, inertia: Any) -> Any:
        """Return the acceleration (rad/s^2) of a load of `inertia` (kg mm^2) at the greatest torque."""
        return KG_MM2_PER_N_MM_S2 * self.torque_max / (self.inertia_base + inertia)

    def speed_on_locus(self, acceleration: Any) -> Any:
        """Return the speed (rad/s) of the locus at an acceleration (rad/s^2): (angle acceleration)^(1/2)."""
        return (self.angle * acceleration) ** 0.5

    def onset_inertia(self, speed_max: float) -> float:
        """Return the inertia (kg mm^2) above which the optimal speed is below `speed_max` (rad/s)."""
        speed = checks.positive("speed_max", speed_max, "rad/s")
        return float(KG_MM2_PER_N_MM_S2 * self.torque_max * self.angle / speed**2 - self.inertia_base)
