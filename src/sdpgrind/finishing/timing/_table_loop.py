"""Position loop of one axis of the xy table."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind import control
from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.finishing.timing import _table_kernels as table_kernels


class SampledTable(NamedTuple):
    """One sample of the loop: x' = transition x + old u + new u', position = output x, for a command u in mm.

    Attributes
    ----------
    transition : array, (3, 3)
        Transition of the state over a sample, dimensionless.
    old, new : array, (3,)
        Weights of the command (mm) before and after it.
    output : array, (3,)
        Weights of the state in the position (mm).
    """

    transition: Floats
    old: Floats
    new: Floats
    output: Floats

    @property
    def parameters(self) -> Floats:
        """All in one array (18,) for `kernels.table_step`; weights of a command in mm."""
        return np.concatenate([np.ravel(each) for each in self])


@described("finishing.table_loop")
class TableLoop(Described):
    """Position loop of one axis of the xy table: a motor with friction under a PID law (Wang, section 3).

    ``J P'' + B P' = Kt (Kp e + Ki int e + Kd e')`` with e = P* - P, so that P/P* = (Kt Kd s^2 + Kt Kp s + Kt
    Ki)/(J s^3 + (B + Kt Kd) s^2 + Kt Kp s + Kt Ki), as printed. Positions are of the motor, rad, or of the
    table, mm: the loop is linear, and its response has the unit of its command. Default values are chosen
    here, as the source gives none.

    Parameters
    ----------
    inertia : float
        J, kg m^2.
    damping : float
        B, N m s.
    torque_constant : float
        Kt, N m/A.
    kp, ki, kd : float
        Gains of the law, A/rad, A/(rad s), A s/rad.

    Raises
    ------
    ValueError
        When a value is not > 0 (damping and kd: < 0), or the loop is unstable; the message names its poles.

    Examples
    --------
    >>> loop = TableLoop()
    >>> loop.poles.round(2).tolist()
    [(-49.69+44.41j), (-49.69-44.41j), (-5.63+0j)]
    >>> round(loop.parabola_error(1000.0), 3)
    0.2
    """

    inertia: float = quantity("kg m^2", above=0, default=0.002)
    damping: float = quantity("N m s", at_least=0, default=0.01)
    torque_constant: float = quantity("N m/A", above=0, default=0.5)
    kp: float = quantity("A/rad", above=0, default=20.0)
    ki: float = quantity("A/(rad s)", above=0, default=100.0)
    kd: float = quantity("A s/rad", at_least=0, default=0.4)

    def _check(self) -> None:
        if not (self.damping + self.torque_constant * self.kd) * self.kp > self.inertia * self.ki:
            poles = ", ".join(f"{pole:.4g}" for pole in self.poles)
            raise ValueError(
                "(damping + torque_constant*kd)*kp must be > inertia*ki, else the loop is unstable;"
                f" its poles are {poles} (1/s)"
            )

    @property
    def numerator(self) -> Floats:
        """Numerator of P/P*, highest power of s first; s in 1/s, coefficients in N m and s."""
        return self.torque_constant * np.array([self.kd, self.kp, self.ki])

    @property
    def denominator(self) -> Floats:
        """Denominator of P/P*, highest power of s first; s in 1/s, coefficients in kg m^2, N m and s."""
        kt = self.torque_constant
        return np.array([self.inertia, self.damping + kt * self.kd, kt * self.kp, kt * self.ki])

    @property
    def poles(self) -> Complex:
        """Poles of the closed loop, 1/s."""
        return np.asarray(np.roots(self.denominator), dtype=complex)

    def response(self, frequency: npt.ArrayLike) -> Complex:
        """Return the complex gain P/P*, dimensionless.

        Parameters
        ----------
        frequency : array
            Angular frequencies, rad/s.
        """
        s = 1j * checks.finite_array("frequency", frequency, "rad/s")
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s), dtype=complex)

    def parabola_error(self, acceleration: float) -> float:
        """Return the steady error behind a command of constant acceleration, B a/(Kt Ki), mm; of a ramp, 0.

        Parameters
        ----------
        acceleration : float
            Acceleration of the command, mm/s^2.
        """
        return (
            self.damping
            * checks.number("acceleration", acceleration, "mm/s^2")
            / (self.torque_constant * self.ki)
        )

    def sampled(self, period: float) -> SampledTable:
        """Return the loop over a sample, exact for commands that are straight lines between samples.

        Parameters
        ----------
        period : float
            Time between two samples, s.

        Raises
        ------
        ValueError
            When it is not > 0.

        Examples
        --------
        >>> TableLoop().sampled(1e-3).transition.shape
        (3, 3)
        """
        A, B, C, _ = control.continuous(self.numerator, self.denominator)
        transition, old, new = control.ramped(A, B, checks.positive("period", period, "s"))
        return SampledTable(transition, old, new, C)

    def follow(self, command: npt.ArrayLike, period: float) -> Floats:
        """Return the table's response to a command, from rest at the first command.

        Parameters
        ----------
        command : array, (m,)
            Position commanded at each sample, mm, a straight line in between.
        period : float
            Time between two samples, s.

        Returns
        -------
        array, (m,)
            Position at each sample, mm.

        Examples
        --------
        >>> table = TableLoop()
        >>> ramp = 25.0 * np.arange(4001) * 1e-3
        >>> bool(abs(table.follow(ramp, 1e-3)[-1] - ramp[-1]) < 1e-9)
        True
        """
        told = checks.finite_array("command", command, "mm")
        if told.ndim != 1 or not told.size:
            raise checks.refuse("command", "of shape (m,) with m >= 1", told.shape, "mm")
        position = np.empty(told.size)
        table_kernels.follow(
            self.sampled(period).parameters, np.zeros(table_kernels.TABLE), told - told[0], position
        )
        return np.asarray(position + told[0])
