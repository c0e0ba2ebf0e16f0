"""Position drive of the platform, from command to position, with stiction, play and backlash as data."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.units import hz
from sdpgrind.control import held
from sdpgrind.weldbead.force._kernels import DriveCore
from sdpgrind.weldbead.force._servo import ServoTable

if TYPE_CHECKING:
    from scipy.signal import TransferFunction


@described("force.drive")
class TableDrive(Described):
    """Platform position X (mm) for a command X_c (mm): Brown (1988), (7.2), with friction added.

    v' = gain F(s) (X_c - tachometer v - X) - damping v - friction, F(s) = (s/lead + 1)/(s/lag + 1).

    Parameters
    ----------
    gain : float
        Acceleration per position error, 1/s^2.
    damping : float
        Deceleration per speed, 1/s.
    tachometer : float
        Speed feedback, position error per speed, s.
    lag, lead : float
        Pole and zero of the amplifier, rad/s; equal ones cancel.
    stuck_band : float
        Command change to each side that Coulomb friction at the motor holds, mm; 0: none.
    play : float
        Whole width of a play between motor and platform that no load closes, mm: Brown's friction "reflected
        to the output" (4.8 N over the contact stiffness).
    backlash : float
        Whole dead zone of gearbox and screw, mm, closed while the contact presses the platform down.
    dc_gain : float
        Travel per volt of command, mm/V; informative, commands are in mm.

    Raises
    ------
    ValueError
        When a value is not finite, or negative, or 0 where it must not be.

    Examples
    --------
    >>> import numpy as np
    >>> drive = table_drive("appendix-b")
    >>> np.round(np.abs(drive.poles) / (2 * np.pi), 1)  # Hz
    array([  9. , 312.9, 312.9])
    """

    gain: float = quantity("1/s^2", above=0)
    damping: float = quantity("1/s", above=0)
    tachometer: float = quantity("s", at_least=0, default=0.0)
    lag: float = quantity("rad/s", above=0, default=1000.0)
    lead: float = quantity("rad/s", above=0, default=1000.0)
    stuck_band: float = quantity("mm", at_least=0, usual=(0.0, 2.0), typical=0.01, default=0.0)
    play: float = quantity("mm", at_least=0, usual=(0.0, 5.0), typical=0.05, default=0.0)
    backlash: float = quantity("mm", at_least=0, usual=(0.0, 5.0), typical=0.05, default=0.0)
    dc_gain: float = quantity("mm/V", above=0, default=1.0)

    @property
    def transfer(self) -> "TransferFunction":
        """Transfer function from command to position (mm/mm, s in rad/s) without friction; Brown (7.2)."""
        from scipy.signal import TransferFunction  # it imports half of SciPy

        return TransferFunction(*self.polynomials)

    @property
    def polynomials(self) -> tuple[Floats, Floats]:
        """Numerator and denominator of `transfer` (mm/mm), highest power of s (rad/s) first."""
        if self.lag == self.lead:
            speed = self.damping + self.gain * self.tachometer
            return np.array([self.gain]), np.array([1.0, speed, self.gain])
        k, d, h, p, ratio = self.gain, self.damping, self.tachometer, self.lag, self.lag / self.lead
        top = [k * ratio, k * p]
        low = [1.0, p + d + k * h * ratio, p * (d + k * h) + k * ratio, k * p]
        return np.array(top), np.array(low)

    @property
    def poles(self) -> Complex:
        """Poles, rad/s, slowest first."""
        roots = np.asarray(np.roots(self.polynomials[1]), dtype=complex)
        return roots[np.argsort(np.abs(roots), kind="stable")]

    @property
    def lag_time(self) -> float:
        """Lag of the platform behind a slow command, s."""
        top, low = self.polynomials
        return float(low[-2] / low[-1] - (top[-2] / top[-1] if len(top) > 1 else 0.0))

    @property
    def reduced(self) -> tuple[float, float]:
        """Two real poles b1 <= b2 that replace the drive up to 60 Hz, rad/s; its own two where real."""
        own = np.abs(self.poles)
        if len(own) == 2 and np.all(self.poles.imag == 0):
            return float(own[0]), float(own[1])
        return _two_poles(self.response, float(own[0]))

    def response(self, frequency: Floats) -> Complex:
        """Return the complex gain (mm/mm) at an angular `frequency`, rad/s."""
        s = 1j * np.asarray(frequency, dtype=float)
        top, low = self.polynomials
        return np.asarray(np.polyval(top, s) / np.polyval(low, s))

    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """Return the effects of state (mm, mm/s, mm), command (mm) and friction (mm/s^2) on the state."""
        k, d, h, p, ratio = self.gain, self.damping, self.tachometer, self.lag, self.lag / self.lead
        accelerate = [-k * ratio, -d - k * h * ratio, k * (1 - ratio)]
        A = np.array([[0.0, 1.0, 0.0], accelerate, [-p, -p * h, -p]])
        return A, np.array([0.0, k * ratio, p]), np.array([0.0, -1.0, 0.0])

    def core(self, step: float) -> DriveCore:
        """Return the constants of `drive_step` with sub-steps of length `step`, s."""
        A, command, friction = self.matrices()
        nothing = np.zeros(3)
        moved = held(A, command, nothing, 0.0, step)
        slowed = held(A, friction, nothing, 0.0, step)
        return DriveCore(
            *(moved.A, moved.B, slowed.B),
            *(self.gain, self.lag / self.lead, self.tachometer, float(np.exp(-self.lag * step))),
            *(self.gain * self.stuck_band, self.play / 2, self.backlash / 2),
        )

    def start(self, position: float) -> Floats:
        """Return the state of `drive_step` at rest at a position, mm."""
        return np.array([position, 0.0, 0.0, position, position])


def _two_poles(response: Callable[[Floats], Complex], first: float) -> tuple[float, float]:
    """Least squares of the complex response up to 60 Hz, on an even grid."""
    frequency = hz(np.linspace(0.5, 60.0, 120))
    goal = response(frequency)

    def miss(logs: Floats) -> Floats:
        b = np.exp(logs)
        left = b[0] * b[1] / ((1j * frequency + b[0]) * (1j * frequency + b[1])) - goal
        return np.concatenate([left.real, left.imag])

    found = np.sort(np.exp(least_squares(miss, np.log([first, 30 * first]), xtol=1e-12, ftol=1e-12).x))
    return float(found[0]), float(found[1])


def servo_drive(servo: ServoTable) -> TableDrive:
    """Return the position drive of a `servo` table (N mm, V, A, rad/s); friction becomes a stuck band, mm.

    Examples
    --------
    >>> round(servo_drive(ServoTable()).stuck_band * 1e3, 2)  # micrometres
    7.65
    """
    tachometer = servo.tachometer * servo.tachometer_gain / (servo.position_sensor * servo.lead_of_screw)
    return TableDrive(
        gain=servo.position_gain,
        damping=servo.damping / servo.inertia,
        tachometer=tachometer,
        lag=servo.lag,
        lead=servo.lead,
        stuck_band=servo.stuck_band,
        dc_gain=servo.dc_gain,
    )


def table_drive(name: str = "design") -> TableDrive:
    """Return a table drive by name.

    Parameters
    ----------
    name : str
        ``"design"``: two poles at 9 and 40 Hz without friction, Brown (7.3), the conservative design model.
        ``"appendix-b"``: the third-order drive of Appendix B with its friction torque (stuck band in mm).
        ``"appendix-b-linear"``: the same without friction.

    Examples
    --------
    >>> [round(pole / 6.283185307, 6) for pole in table_drive().reduced]  # Hz
    [9.0, 40.0]
    """
    checks.one_of("name", name, ("design", "appendix-b", "appendix-b-linear"))
    if name == "design":
        b1, b2 = hz(9.0), hz(40.0)
        return TableDrive(gain=b1 * b2, damping=b1 + b2, dc_gain=ServoTable().dc_gain)
    drive = servo_drive(ServoTable())
    return drive if name == "appendix-b" else drive.replace(stuck_band=0.0)
