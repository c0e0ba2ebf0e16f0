"""Vertical force table of Brown (1988), Appendix B: motor, amplifier and screw in one data sheet."""

import dataclasses
from math import pi

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

_INCH_POUND = 4.4482216152605 * 25.4  # N*mm; derived: pound-force in N times inch in mm
_KRPM = 1000 * 2 * pi / 60  # rad/s; derived
_INCH = 25.4  # mm; source: definition


@stored("force.servo")
@dataclasses.dataclass(frozen=True)
class ServoTable(Frozen):
    """DC motor with a linear amplifier that turns a ball screw under a platform; Brown (1988), Appendix B.

    Defaults are the printed values, converted; the inertia of the bare motor is the rounded 4.25e-3 in lb
    s/kRPM with which the source calculates.

    Parameters
    ----------
    motor_inertia, inertia : float
        Rotational inertia of the bare motor, and of all that it moves, N mm s^2 (per rad).
    damping : float
        Viscous friction B, N mm s (per rad).
    inductance : float
        Armature inductance Lm, V s/A.
    resistance : float
        Armature resistance Rm, ohm (printed in W), V/A.
    torque_constant : float
        K_T, N mm/A.
    emf_constant : float
        K_e, V s (per rad).
    tachometer : float
        D_T, V s (per rad).
    amplifier_gain : float
        K3, A/V.
    command_gain, tachometer_gain : float
        Potentiometers R28 and R53, unit 1.
    lag, lead : float
        p_a and z_a of the amplifier, rad/s.
    position_sensor : float
        D_L, V/mm.
    lead_of_screw : float
        Travel of the platform per rad of the motor, mm.
    friction_torque : float
        Coulomb friction at the motor, N mm.

    Raises
    ------
    ValueError
        When a value is not finite, a friction is negative, or another value is not positive.

    Examples
    --------
    >>> servo = ServoTable()
    >>> round(servo.dc_gain, 4)  # mm/V
    0.6065
    """

    motor_inertia: float = 4.25e-3 * _INCH_POUND / _KRPM
    inertia: float = 9.313e-3 * _INCH_POUND / _KRPM
    damping: float = 0.063 * _INCH_POUND / _KRPM
    inductance: float = 0.09e-3
    resistance: float = 0.7
    torque_constant: float = 0.363 * _INCH_POUND
    emf_constant: float = 4.3 / _KRPM
    tachometer: float = 3.09 / _KRPM
    amplifier_gain: float = 36.7
    command_gain: float = 1.0
    tachometer_gain: float = 0.806
    lag: float = 1100.0
    lead: float = 5000.0
    position_sensor: float = 41.878 / _INCH
    lead_of_screw: float = _INCH / (5 * 2 * pi)
    friction_torque: float = 0.168 * _INCH_POUND

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            rule = checks.nonnegative if field.name in ("damping", "friction_torque") else checks.positive
            object.__setattr__(self, field.name, rule(field.name, getattr(self, field.name)))

    @property
    def motor_numerator(self) -> float:
        """Constant of the voltage-driven motor, K1 = K_T/(Lm J), rad/(V s^3)."""
        return self.torque_constant / (self.inductance * self.motor_inertia)

    @property
    def motor_denominator(self) -> Floats:
        """Polynomial of the voltage-driven motor, s^2 + A1 s + C1 (A1 in 1/s), highest power first."""
        A1 = self.resistance / self.inductance + self.damping / self.motor_inertia
        C1 = self.resistance * self.damping + self.emf_constant * self.torque_constant
        return np.array([1.0, A1, C1 / (self.inductance * self.motor_inertia)])

    @property
    def motor_poles(self) -> Floats:
        """Mechanical and electrical pole of the voltage-driven motor, rad/s."""
        return np.sort(np.roots(self.motor_denominator).real)[::-1]

    @property
    def motor_gain(self) -> float:
        """Speed of the voltage-driven motor per volt, rad/(s V)."""
        return float(self.motor_numerator / self.motor_denominator[-1])

    @property
    def motor_time_constant(self) -> float:
        """Mechanical time constant Tm = Rm J/(K_e K_T), s."""
        return self.resistance * self.motor_inertia / (self.emf_constant * self.torque_constant)

    @property
    def speed_feedback(self) -> float:
        """Damping by the tachometer, alpha = D_T R53 K3 K_T, N mm s (per rad)."""
        return self.tachometer * self.tachometer_gain * self.amplifier_gain * self.torque_constant

    @property
    def speed_gain(self) -> float:
        """Speed of the bare motor under speed control, K_V, rad/(s V)."""
        drive = self.command_gain * self.amplifier_gain * self.torque_constant
        return drive / (self.speed_feedback + self.damping)

    def amplifier_of(self, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
        """Return lag p_a and lead z_a, rad/s, from the measured resonance of the bare motor's speed loop.

        `natural_frequency` is in rad/s, `damping_ratio` is dimensionless.
        """
        natural_frequency = checks.positive("natural_frequency", natural_frequency, "rad/s")
        damping_ratio = checks.positive("damping_ratio", damping_ratio)
        J, B = self.motor_inertia, self.damping
        lag = J * natural_frequency**2 / (B + self.speed_feedback)
        rest = 2 * damping_ratio * natural_frequency - lag - B / J
        return lag, lag * self.speed_feedback / (J * rest)

    @property
    def dc_gain(self) -> float:
        """Platform travel per volt of command, R28/D_L, mm/V."""
        return self.command_gain / self.position_sensor

    @property
    def position_gain(self) -> float:
        """Acceleration of the platform per position error, D_L K3 K_T c/J2, 1/s^2."""
        torque = self.position_sensor * self.amplifier_gain * self.torque_constant
        return torque * self.lead_of_screw / self.inertia

    @property
    def stuck_band(self) -> float:
        """Command change held by friction, to each side, T_c/(D_L K3 K_T), mm."""
        return self.friction_torque / (self.position_sensor * self.amplifier_gain * self.torque_constant)
