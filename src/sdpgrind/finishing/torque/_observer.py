"""Transfer functions of the torque observer: Wang (9), corrected."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._gains import PidffGains


class ObservedTorque(NamedTuple):
    """Polynomials in s, highest power first, of the observer's estimate: N/D of torques, M/D of motor speed.

    Attributes
    ----------
    torque : array
        N: k_od s^2 + k_op s + k_oi, or k_oi alone in the state form; times k_t^/k_t.
    speed : array
        M = J^ (J k_t^/(J^ k_t) - 1) s N, N m s/rad times D's unit.
    denominator : array
        D = J^ s^3 + k_od s^2 + k_op s + k_oi.
    """

    torque: Floats
    speed: Floats
    denominator: Floats

    def response(self, frequency: npt.ArrayLike) -> Complex:
        """Return the complex gains (..., 2) from contact and load torque (1) and from the speed (N m s/rad).

        Parameters
        ----------
        frequency : array
            Angular frequencies, rad/s.
        """
        s = 1j * checks.finite_array("frequency", frequency, "rad/s")
        tops = np.stack([np.polyval(self.torque, s), np.polyval(self.speed, s)], axis=-1)
        return np.asarray(tops / np.polyval(self.denominator, s)[..., np.newaxis])


def observed_torque(
    axis: TorqueAxis,
    gains: PidffGains | None = None,
    *,
    observer: str = "pid",
    truth: TorqueAxis | None = None,
) -> ObservedTorque:
    """Return the response of the observer's estimate to contact and load torque and motor speed: Wang (9).

    That = (N/D) [(k_t^/k_t)(T_f + T_L) + J^ (J k_t^/(J^ k_t) - 1) s omega], corrected: the source prints k_t
    in place of (k_t^/k_t) N, k_oi s^2 for k_od s^2, and no s before omega. With exact J^ and k_t^ it is (10),
    where k_oi s^2 is printed for k_od s^2, too. The observer always takes the load torque for contact torque.

    Parameters
    ----------
    axis : TorqueAxis
        Believed axis: J^, k_t^.
    gains : PidffGains, optional
        Default: those of the source.
    observer : {"pid", "state"}
        PID form, that of (9), or state form: N = k_oi.
    truth : TorqueAxis, optional
        True axis: J, k_t. Default: the believed one.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> seen = fin.torque.observed_torque(fin.TorqueAxis())
    >>> (seen.denominator / 0.0011).round(6).tolist()  # (s + 40)^3
    [1.0, 120.0, 4800.0, 64000.0]
    >>> abs(seen.response(0.0)).tolist()
    [1.0, 0.0]
    """
    checks.one_of("observer", observer, ("pid", "state"))
    gains, truth = PidffGains() if gains is None else gains, axis if truth is None else truth
    whole = np.array([gains.obs_kd, gains.obs_kp, gains.obs_ki])
    N = whole if observer == "pid" else whole[2:]
    share = axis.torque_constant / truth.torque_constant
    return ObservedTorque(
        share * N, (truth.inertia * share - axis.inertia) * np.append(N, 0.0), np.append(axis.inertia, whole)
    )
