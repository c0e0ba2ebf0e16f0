"""Scatter of the three coefficients of a process: from pass to pass, or from bead to bead."""

from math import log1p, sqrt
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.weldbead.sequence._process import GrindingProcess

COEFFICIENTS = ("specific_energy", "idle_power", "friction_ratio")
"""Coefficients that scatter: K1, K2, mu."""
ASSUMED = 0.15  # relative sd where nothing tells it; chosen: the usual one of all three
_PERCENT = ": divide by 100 where percent is meant"
_ROUNDING = 1e-12  # chosen: asymmetry or negative eigenvalue of a correlation that is rounding


def _correlation(name: str, value: Any) -> Any:
    """Correlation matrix as a tuple of rows; None: independent."""
    matrix = np.asarray(value, dtype=float)
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        raise checks.refuse(name, "three rows of three numbers, for K1, K2 and mu", value)
    if np.max(np.abs(matrix - matrix.T)) > _ROUNDING or np.any(np.abs(np.diag(matrix) - 1) > _ROUNDING):
        raise checks.refuse(name, "symmetric with ones on its diagonal", value)
    if np.max(np.abs(matrix)) > 1 + _ROUNDING or np.linalg.eigvalsh(matrix)[0] < -1e3 * _ROUNDING:
        raise checks.refuse(name, "positive semi-definite, each number in [-1, 1]", value)
    return tuple(tuple(row) for row in matrix.tolist())


@described("weldbead.coefficient_scatter")
class CoefficientScatter(Described):
    """Log-normal coefficients with given means, drawn for each pass or bead.

    Parameters
    ----------
    specific_energy, idle_power, friction_ratio : float
        Standard deviation over mean, in [0, 1], unit 1.
    correlation : (3, 3) array_like, optional
        Correlation of the logarithms of K1, K2 and mu, unit 1. None: independent.

    Raises
    ------
    ValueError
        When a standard deviation is negative or above 1 (percent?), or the correlation is none.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import weldbead
    >>> process = weldbead.preset("P1").model
    >>> CoefficientScatter(0.0, 0.0, 0.0).drawn(process, np.random.default_rng(0)) == process
    True
    """

    specific_energy: float = quantity("1", at_least=0, at_most=1, hint=_PERCENT, default=0.15)
    idle_power: float = quantity("1", at_least=0, at_most=1, hint=_PERCENT, default=0.20)
    friction_ratio: float = quantity("1", at_least=0, at_most=1, hint=_PERCENT, default=0.15)
    correlation: tuple[tuple[float, ...], ...] | None = custom(_correlation, unit="1", default=None)

    @property
    def log_covariance(self) -> Floats:
        """Covariance of the logarithms of K1, K2 and mu, shape (3, 3), unit 1."""
        sd = np.sqrt(np.log1p(np.array([getattr(self, name) for name in COEFFICIENTS]) ** 2))
        rho = np.eye(3) if self.correlation is None else np.array(self.correlation)
        return np.asarray(sd[:, None] * rho * sd)

    @classmethod
    def of_logs(cls, covariance: Floats) -> "CoefficientScatter":
        """Return the scatter of a covariance (3, 3) of the logarithms of K1, K2 and mu, unit 1."""
        variance = np.diag(covariance)
        sd = np.sqrt(np.where(variance > 0, variance, np.inf))
        off = covariance / np.outer(sd, sd)
        rho: Any = np.where(np.eye(3) > 0, 1.0, off) if np.any(off - np.diag(np.diag(off))) else None
        energy, idle, friction = np.minimum(np.sqrt(np.expm1(variance)), 1.0).tolist()  # 1 and its rounding
        return cls(energy, idle, friction, correlation=rho)

    def drawn(self, process: GrindingProcess, rng: np.random.Generator) -> GrindingProcess:
        """Return the process with drawn coefficients (J/mm^3, W, 1).

        Parameters
        ----------
        process : GrindingProcess
            Process with the means.
        rng : numpy.random.Generator
            Random source; always three draws.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import weldbead
        >>> process = weldbead.preset("P1").model
        >>> rng = np.random.default_rng(0)
        >>> energies = [CoefficientScatter().drawn(process, rng).specific_energy for _ in range(2000)]
        >>> bool(abs(np.mean(energies) - 10.0) < 0.1), bool(abs(np.std(energies) - 1.5) < 0.1)  # J/mm^3
        (True, True)
        """
        normals = self._alike(rng.standard_normal(3))
        factors = [
            _lognormal(getattr(self, name), normal)
            for name, normal in zip(COEFFICIENTS, normals.tolist(), strict=True)
        ]
        return process.replace(
            **{name: getattr(process, name) * f for name, f in zip(COEFFICIENTS, factors, strict=True)}
        )

    def _alike(self, normals: Floats) -> Floats:
        """Give three independent normal draws the correlation."""
        if self.correlation is None:
            return normals
        value, vector = np.linalg.eigh(np.array(self.correlation))
        return np.asarray(vector @ (np.sqrt(np.maximum(value, 0.0)) * normals))


def _lognormal(relative_sd: float, normal: float) -> float:
    """Log-normal number of mean 1."""
    variance = log1p(relative_sd**2)
    return float(np.exp(sqrt(variance) * normal - variance / 2))
