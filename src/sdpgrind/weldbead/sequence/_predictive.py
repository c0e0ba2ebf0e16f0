"""Depth of the next pass where its log coefficients are normal: scatter of passes, of beads, or both.

The removing power over K1 is c mu F/K1 - c' mu^2 F^2/K1 - K2/K1, c = 1e-3 R omega0 and c' = 1e-3 R^2 beta.
Its terms are log-normal: means, variances and covariances are closed forms, exact but for depths below 0,
which count as they are. With 15 % at both levels one pass in 100 removes nothing at twice the threshold
force, one in 11 at 1.5 times it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.weldbead.sequence._depths import Depths
from sdpgrind.weldbead.sequence._process import GrindingProcess

_TERMS = np.array([[-1.0, 0.0, 1.0], [-1.0, 0.0, 2.0], [-1.0, 1.0, 0.0]])
"""Exponents of K1, K2 and mu in the terms of friction, droop and idling."""


@dataclass(frozen=True)
class PredictiveDepths(Depths):
    """Random depth of a pass of log-normal coefficients whose means are those of the process.

    Parameters
    ----------
    covariance : tuple of tuple of float
        Covariance of the logarithms of K1, K2 and mu, (3, 3), unit 1.
    law : str
        Law of the depth, as in `Scatter`.
    """

    covariance: tuple[tuple[float, ...], ...]
    law: str

    @classmethod
    def of(cls, covariance: Floats, law: str) -> "PredictiveDepths":
        return cls(tuple(tuple(row) for row in covariance.tolist()), law)

    @cached_property
    def _factors(self) -> tuple[Floats, Floats]:
        """Means of the terms over those of the mean coefficients; relative covariances of the terms."""
        covariance = np.array(self.covariance)
        shared = _TERMS @ covariance @ _TERMS.T
        means = np.exp(0.5 * (np.diag(shared) - _TERMS @ np.diag(covariance)))
        return means, np.expm1(shared)

    def expected(self, process: GrindingProcess) -> GrindingProcess:
        """Return the process of the mean cut: J/mm^3, W, rad/(s N mm)."""
        friction, droop, idling = self._factors[0].tolist()
        return process.replace(
            specific_energy=process.specific_energy / friction,
            idle_power=process.idle_power * idling / friction,
            speed_droop=process.speed_droop * droop / friction,
        )

    def power_moments(self, process: GrindingProcess, normal_force: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return mean and sd, W, of K1 w V depth at a force, N, with the mean K1 of the process."""
        force = np.asarray(normal_force, dtype=float)
        torque = process.friction_ratio * process.disk_radius * force
        means, covariance = self._factors
        power = np.stack([
            torque * process.free_speed / N_MM_S_PER_W,
            -(torque**2) * process.speed_droop / N_MM_S_PER_W,
            np.full(force.shape, -process.idle_power),
        ], axis=-1) * means  # fmt: skip
        mean = np.maximum(power.sum(axis=-1), 0.0)
        variance = np.einsum("...i,ij,...j->...", power, covariance, power)
        return mean, np.where(mean > 0, np.sqrt(np.maximum(variance, 0.0)), 0.0)
