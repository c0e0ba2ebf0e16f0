"""Closed loop of axis and controller as a linear system: poles, frequency and step response, gain."""

import dataclasses
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.linalg

from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.parallel import one_blas_thread

INPUTS = ("torque_ref", "load_torque", "surface_angle")
OUTPUTS = ("contact_torque", "estimate")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AxisLoop:
    """Closed loop x' = A x + B u, y = C x + D u, in permanent contact.

    Inputs are torque reference (N m), load torque (N m) and angle of the surface (rad); outputs are the
    contact torque and its estimate (N m).

    Parameters
    ----------
    A, B, C, D : array, (n, n), (n, 3), (2, n), (2, 3)
        Matrices in rad, s and N m.
    sample_time : float
        Sample time, s; 0: continuous time.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> loop = fin.TorqueController(fin.TorqueAxis(), normal_force=1.111).loop()
    >>> loop
    AxisLoop(6 states, continuous, stable; slowest pole -16.54±8.88j 1/s)
    >>> loop.dc_gain("load_torque").round(9).tolist()  # contact, estimate
    [-1.0, 0.0]
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats
    sample_time: float = 0.0

    @cached_property
    def poles(self) -> Complex:
        """Poles, slowest first: 1/s, or in the z plane for a sampled loop."""
        with one_blas_thread():
            poles = np.linalg.eigvals(self.A).astype(complex)
        return np.asarray(
            poles[np.lexsort((poles.imag, -(np.abs(poles) if self.sample_time else poles.real)))]
        )

    def __repr__(self) -> str:
        kind, unit = (
            (f"sampled every {self.sample_time:g} s", "in z") if self.sample_time else ("continuous", "1/s")
        )
        slowest = self.poles[0]
        told = f"{slowest.real:.4g}" + (f"±{abs(slowest.imag):.3g}j" if slowest.imag else "")
        stable = "stable" if self.stable else "not stable"
        return f"AxisLoop({len(self.A)} states, {kind}, {stable}; slowest pole {told} {unit})"

    @property
    def stable(self) -> bool:
        """Whether every pole (1/s) decays."""
        return (
            bool(np.all(np.abs(self.poles) < 1.0))
            if self.sample_time
            else bool(np.all(self.poles.real < 0.0))
        )

    def dc_gain(self, name: str) -> Floats:
        """Return the static gains (2,) of contact torque and estimate, N m per unit of the input.

        By Wang (7) a constant load torque leaves no error: true with feedback of the true contact torque
        only.

        Parameters
        ----------
        name : {"torque_ref", "load_torque", "surface_angle"}
            Input.
        """
        return np.asarray(self.response(0.0, name).real)

    def response(self, frequency: npt.ArrayLike, name: str) -> Complex:
        """Return the complex gains (..., 2) of contact torque and estimate, N m per unit of the input.

        Parameters
        ----------
        frequency : array
            Angular frequencies, rad/s.
        name : {"torque_ref", "load_torque", "surface_angle"}
            Input.
        """
        k = INPUTS.index(checks.one_of("name", name, INPUTS))
        w = checks.finite_array("frequency", frequency, "rad/s")
        s = np.exp(1j * w * self.sample_time) if self.sample_time else 1j * w
        matrix = s[..., np.newaxis, np.newaxis] * np.eye(len(self.A)) - self.A
        with one_blas_thread():
            state = np.linalg.solve(matrix, np.broadcast_to(self.B[:, k : k + 1], (*w.shape, len(self.A), 1)))
        return np.asarray((self.C @ state)[..., 0] + self.D[:, k])

    def step_response(self, time: npt.ArrayLike, name: str = "torque_ref") -> Floats:
        """Return contact torque and estimate (..., 2) after a unit step of an input at time 0, N m per unit.

        Parameters
        ----------
        time : array
            s, >= 0; rounded down to samples in a sampled loop.
        name : {"torque_ref", "load_torque", "surface_angle"}
            Input.
        """
        k = INPUTS.index(checks.one_of("name", name, INPUTS))
        times = checks.finite_array("time", time, "s")
        with one_blas_thread():
            values = [self._stepped(t, k) for t in times.ravel()]
        return np.array(values).reshape(*times.shape, len(OUTPUTS))

    def _stepped(self, time: float, k: int) -> Floats:
        n = len(self.A)
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = self.A, self.B[:, k]
        if self.sample_time:
            block[n, n] = 1.0
            over = np.linalg.matrix_power(block, int(time / self.sample_time + 1e-9))
        else:
            over = scipy.linalg.expm(block * time)
        return np.asarray(self.C @ over[:n, n] + self.D[:, k])
