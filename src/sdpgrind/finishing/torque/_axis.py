"""Torque axis: motor, tool and contact spring, with current converter and encoder."""

import dataclasses
from math import pi, sqrt

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, count, described, quantity

GRAVITY = 9.81  # m/s^2; source: Wang and Jan (2001)
SHORTEST = 1.0  # mm, chosen: lever arm below which another unit is meant


@described("finishing.axis")
class TorqueAxis(Described):
    """Motor that presses the tool against the surface: J theta'' = k_t i - T_f - T_L.

    The contact T_f = max(0, k_e (theta - theta_s)) is the spring of Wang and Jan (2001) (2), without pull;
    theta_s is the angle of first touch. The motion is their (3) with k_e theta for the printed k_e theta',
    from which (4) follows as printed. The torque constant is that of their Table 1; inertia and stiffness are
    the estimates of their section 6. Torques are in N m.

    Parameters
    ----------
    inertia : float
        J of motor and tool, kg m^2.
    contact_angular_stiffness : float
        Contact stiffness k_e at the motor, N m/rad.
    torque_constant : float
        k_t, N m/A.
    lever_arm : float
        Distance from the motor's axis to the contact, mm.
    current_limit : float
        Greatest current, A: 1 A in the source's section 5, 1.2 A in its Table 1.
    current_range : float
        Greatest current of the converter in either direction, A.
    bits : int
        Resolution of the converter, bits.
    encoder_counts : int
        Encoder counts per revolution; not given by the source.
    sample_time : float
        Sample time, s; not given by the source.

    Raises
    ------
    ValueError
        A value is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> axis = fin.TorqueAxis()
    >>> round(axis.natural_frequency, 1), round(axis.contact_stiffness, 3)  # rad/s, N/mm
    (104.2, 1.324)
    >>> round(axis.force_max, 3), round(axis.force_resolution, 3)  # N
    (1.947, 0.04)
    """

    inertia: float = quantity("kg m^2", above=0, at_most=1.0, hint=": is it in kg m^2?", default=0.0011)
    contact_angular_stiffness: float = quantity("N m/rad", above=0, default=11.95)
    torque_constant: float = quantity("N m/A", above=0, at_most=20.0, hint=": is it in N m/A?", default=0.185)
    _: dataclasses.KW_ONLY
    lever_arm: float = quantity("mm", above=0, usual=(0.0, 5000.0), typical=95, default=95.0)
    current_limit: float = quantity("A", above=0, default=1.0)
    current_range: float = quantity("A", above=0, default=5.0)
    bits: int = count(default=12)
    encoder_counts: int = count(at_most=2**53, default=20_000)
    sample_time: float = quantity("s", above=0, usual=(1e-7, 0.1), typical=1e-3, default=1e-3)

    def _check(self) -> None:
        if self.lever_arm < SHORTEST:
            raise self._refused("lever_arm", f">= {SHORTEST:g}; 95.0 for 0.095 m")
        if self.current_limit > self.current_range:
            raise self._refused("current_limit", f"<= current_range = {self.current_range:g}")

    @property
    def natural_frequency(self) -> float:
        """Undamped natural frequency in contact, sqrt(k_e/J), rad/s."""
        return sqrt(self.contact_angular_stiffness / self.inertia)

    @property
    def contact_stiffness(self) -> float:
        """Stiffness at the contact, k_e/R^2, N/mm."""
        return 1e3 * self.contact_angular_stiffness / self.lever_arm**2

    @property
    def current_step(self) -> float:
        """Resolution of the current, its unit A: full range over 2^bits, not over 2^bits - 1 as printed."""
        return 2 * self.current_range / 2.0**self.bits

    @property
    def torque_step(self) -> float:
        """Resolution of the commanded torque, N m."""
        return self.torque_constant * self.current_step

    @property
    def force_step(self) -> float:
        """Resolution of the commanded force, N (called a pressure in the source)."""
        return self.force(self.torque_step)

    @property
    def angle_step(self) -> float:
        """Resolution of the encoder, rad."""
        return 2 * pi / self.encoder_counts

    @property
    def force_resolution(self) -> float:
        """Force of one encoder count of contact deflection, N: the resolution of observation.

        The source's "resolution of the observer" is `torque_step`, that of the command.
        """
        return self.force(self.contact_angular_stiffness * self.angle_step)

    @property
    def torque_max(self) -> float:
        """Torque at the greatest current, N m."""
        return self.torque_constant * self.current_limit

    @property
    def force_max(self) -> float:
        """Force at the greatest current, without friction, N."""
        return self.force(self.torque_max)

    @property
    def parameters(self) -> Floats:
        """J (kg m^2), k_e (N m/rad), k_t (N m/A) and sample time (s) for `kernels.axis_tick`."""
        return np.array(
            [self.inertia, self.contact_angular_stiffness, self.torque_constant, self.sample_time],
            dtype=float,
        )

    def force(self, torque: float) -> float:
        """Return the force (N) of a torque on the lever arm, F = T/R, without contact angle and friction.

        Parameters
        ----------
        torque : float
            Torque, N m.
        """
        return torque / (1e-3 * self.lever_arm)


def true_axis(believed: TorqueAxis, truth: TorqueAxis | None) -> TorqueAxis:
    """True axis: the believed one, or another with the same sample time."""
    if truth is None:
        return believed
    if checks.kind("truth", truth, TorqueAxis).sample_time != believed.sample_time:
        raise checks.refuse(
            "truth.sample_time", f"that of the controller, {believed.sample_time:g}", truth.sample_time, "s"
        )
    return truth
