"""Gains of the torque controllers: as printed, by poles, and of two laws beyond the source."""

from math import sqrt
from typing import Self

import numpy as np
import scipy.linalg

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.finishing.torque._axis import TorqueAxis


@described("finishing.pidff_gains")
class PidffGains(Described):
    """Gains of PID plus feedforward, Wang and Jan (2001) (6), and of its torque observer, (9).

    (5) has T_f + T_L where (6) has T*, since the load is not measured. ``PidffGains()`` are the gains printed
    in section 6 of the source: a baseline, not a design. Their observer, with poles at -40 1/s, is slower
    than the loop around it, with -61; together the slowest poles are at -16.5 1/s. `of_poles` designs others,
    with an observer three times as fast as the loop.

    Parameters
    ----------
    kp, ki, kd : float
        k_fp (1/s^2), k_fi (1/s^3), k_fd (1/s): three poles at -61 1/s with feedback of the true torque.
    obs_kp, obs_ki, obs_kd : float
        k_op (N m/rad), k_oi (N m/(rad s)), k_od (N m s/rad): three poles at -40 1/s of the observer alone.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.torque.PidffGains().pole  # 1/s
    61.0
    >>> gains = fin.torque.PidffGains.of_poles(fin.TorqueAxis(), pole=61.0, observer_pole=40.0)
    >>> round(gains.kp, 4), gains.ki, gains.kd
    (299.3636, 226981.0, 183.0)
    >>> round(gains.obs_kp, 6), round(gains.obs_ki, 6), round(gains.obs_kd, 6)
    (5.28, 70.4, 0.132)
    """

    kp: float = quantity("1/s^2", default=299.3636)
    ki: float = quantity("1/s^3", default=226981.0)
    kd: float = quantity("1/s", above=0, default=183.0)
    obs_kp: float = quantity("N m/rad", default=5.28)
    obs_ki: float = quantity("N m/(rad s)", default=70.4)
    obs_kd: float = quantity("N m s/rad", default=0.132)

    @classmethod
    def of_poles(cls, axis: TorqueAxis, *, pole: float = 61.0, observer_pole: float | None = None) -> Self:
        """Return the gains of three equal poles of the loop with the true torque, and three of the observer.

        k_fd = 3p, k_fp = 3p^2 - k_e/J, k_fi = p^3; k_od = 3qJ, k_op = 3q^2 J, k_oi = q^3 J. The joint loop
        has other poles: see `TorqueController.poles`.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        pole : float
            p, 1/s.
        observer_pole : float, optional
            q, 1/s. Default: three times the pole.

        Raises
        ------
        ValueError
            A pole is not > 0.
        """
        checks.kind("axis", axis, TorqueAxis)
        p = checks.positive("pole", pole, "1/s")
        q = 3.0 * p if observer_pole is None else checks.positive("observer_pole", observer_pole, "1/s")
        J = axis.inertia
        return cls(
            3.0 * p**2 - axis.contact_angular_stiffness / J,
            p**3,
            3.0 * p,
            3.0 * q**2 * J,
            q**3 * J,
            3.0 * q * J,
        )

    @property
    def pole(self) -> float:
        """Mean pole of the loop with the true torque, k_fd/3, 1/s."""
        return self.kd / 3.0

    def prefilter_rate(self, axis: TorqueAxis) -> float:
        """Return the rate of the prefilter that cancels the zero of Wang (8), 1/s: p/3 for a triple pole p.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        return axis.inertia * self.ki / (axis.inertia * self.kp + axis.contact_angular_stiffness)


@described("finishing.damping_gains")
class DampingGains(Described):
    """Constant torque less damping: u = T* - K_v omega, K_v = 2 zeta sqrt(k_e J), omega high-passed.

    The reference for all force controllers. Like (6), which takes k_e omega for the rate of T_f, it damps the
    absolute speed of the motor: on a moving surface this adds an error that a constant current does not have.
    `LqgGains` damps the speed relative to the surface.

    Parameters
    ----------
    damping : float
        zeta, unit 1.
    highpass_time : float
        Time constant of the high-pass on the speed, s.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> round(fin.torque.DampingGains().speed_gain(fin.TorqueAxis()), 5)  # N m s/rad
    0.11465
    """

    damping: float = quantity("1", above=0, default=0.5)
    highpass_time: float = quantity("s", above=0, default=0.1)

    def speed_gain(self, axis: TorqueAxis) -> float:
        """Return K_v, N m s/rad.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        return 2.0 * self.damping * sqrt(axis.contact_angular_stiffness * axis.inertia)


@described("finishing.lqg_gains")
class LqgGains(Described):
    """Kalman filter over [theta, omega, d, d'] and state feedback: damping relative to the surface.

    J omega' = u - k_e theta - d, d'' white; the estimate is k_e theta + d, and
    u = T* - K1 (estimate - T*)/k_e - K2 (omega + d'/k_e) with K1 = w^2 J - k_e, K2 = 2 zeta w J.

    Parameters
    ----------
    bandwidth : float
        w, rad/s.
    damping : float
        zeta, unit 1.
    density : float
        Root of the intensity of d'', N m/s^1.5: expected motion of the surface.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.torque.LqgGains().kalman(fin.TorqueAxis()).round(4).tolist()  # 1, 1/s, N m/rad, N m/(rad s)
    [0.2549, 37.4153, -5.5705, -300.9914]
    """

    bandwidth: float = quantity("rad/s", above=0, default=80.0)
    damping: float = quantity("1", above=0, default=0.9)
    density: float = quantity("N m/s^1.5", above=0, default=1.0)

    def feedback(self, axis: TorqueAxis) -> tuple[float, float]:
        """Return K1 (N m/rad) and K2 (N m s/rad).

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        J = axis.inertia
        return self.bandwidth**2 * J - axis.contact_angular_stiffness, 2.0 * self.damping * self.bandwidth * J

    def model(self, axis: TorqueAxis) -> tuple[Floats, Floats]:
        """Return A (4, 4) and B (4,) of x' = A x + B u for x = [theta, omega, d, d'], in rad, s and N m.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        J, stiffness = axis.inertia, axis.contact_angular_stiffness
        A = np.array(
            [[0.0, 1.0, 0.0, 0.0], [-stiffness / J, 0.0, -1.0 / J, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0] * 4]
        )
        return A, np.array([0.0, 1.0 / J, 0.0, 0.0])

    def sampled(self, axis: TorqueAxis) -> tuple[Floats, Floats, Floats]:
        """Return A (4, 4), B (4,) over a sample (rad, s, N m) at constant torque, covariance (4, 4) of d''.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        A, B = self.model(axis)
        block = np.zeros((5, 5))
        block[:4, :4], block[:4, 4] = A, B
        noise = np.zeros((8, 8))
        noise[:4, :4], noise[4:, 4:], noise[3, 7] = -A, A.T, self.density**2  # Van Loan's integral
        with one_blas_thread():
            over = scipy.linalg.expm(block * axis.sample_time)
            twice = scipy.linalg.expm(noise * axis.sample_time)
        return over[:4, :4], over[:4, 4], twice[4:, 4:].T @ twice[:4, 4:]

    def kalman(self, axis: TorqueAxis) -> Floats:
        """Return the gain (4,) of the stationary Kalman filter for readings rounded to counts, states/rad.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        A, _, added = self.sampled(axis)
        C, scale, reading = np.eye(4)[:1], self._scale(axis), _rounding(axis) ** 2
        with one_blas_thread():
            P = scipy.linalg.solve_discrete_are(
                (A / scale[:, np.newaxis] * scale).T, C.T, added / np.outer(scale, scale), np.eye(1)
            )
        P = np.asarray(P * np.outer(scale, scale))
        return np.asarray(P[0] / (P[0, 0] + reading))

    def kalman_continuous(self, axis: TorqueAxis) -> Floats:
        """Return the gain (4,) of the stationary Kalman filter in continuous time, 1/s times `kalman`'s.

        Parameters
        ----------
        axis : TorqueAxis
            Believed axis.
        """
        A, _ = self.model(axis)
        C, scale, reading = np.eye(4)[:1], self._scale(axis), _rounding(axis) ** 2 * axis.sample_time
        added = np.zeros((4, 4))
        added[3, 3] = (self.density / scale[3]) ** 2
        A = A / scale[:, np.newaxis] * scale
        with one_blas_thread():
            P = scipy.linalg.solve_continuous_are(A.T, C.T, added, np.eye(1) * axis.sample_time)
        return np.asarray(P[0] * scale[0] * scale / reading)

    def _scale(self, axis: TorqueAxis) -> Floats:
        """Magnitudes of the state errors at the filter's own rate; in rad, N m its equation scales badly."""
        angle = _rounding(axis)
        rate = (self.density / (axis.inertia * angle * axis.sample_time**0.5)) ** 0.25
        rate = min(rate, 1.0 / axis.sample_time)
        return angle * np.array([1.0, rate, axis.inertia * rate**2, axis.inertia * rate**3])


def _rounding(axis: TorqueAxis) -> float:
    """Standard deviation of rounding to counts, rad."""
    return axis.angle_step / sqrt(12.0)


Gains = PidffGains | DampingGains | LqgGains
