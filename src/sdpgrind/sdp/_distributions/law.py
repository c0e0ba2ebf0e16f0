"""What the solver asks of a random amount: partial moments on either side of a point, a quadrature, samples."""

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed

Size = int | tuple[int, ...]


class Law(ABC):
    """An array of laws of a random amount D, one for each control: closed forms, never a sampled density.

    Arguments ``y`` have the unit of D and broadcast against `shape`. Since ``(y - D)+ - (D - y)+ = y - D``, the second
    differences of `under` and of `over` in y are the same numbers; those of `under` are the accurate ones below the
    mean, those of `over` above it.

    Attributes
    ----------
    shape : tuple of int
        Shape of the array of laws.
    mean, sd : array
        Mean and standard deviation of D as the law really has them, of `shape`, in the unit of D.
    """

    shape: tuple[int, ...]
    mean: Floats
    sd: Floats

    @abstractmethod
    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""

    @abstractmethod
    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""

    @property
    @abstractmethod
    def support(self) -> tuple[Floats, Floats]:
        """Two arrays of `shape`, in the unit of D: less than 1e-17 of the probability lies below resp. above them."""

    @abstractmethod
    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""

    @abstractmethod
    def _fine(self) -> tuple[Floats, Floats]:
        """Give points and weights, last axis the points, that stand for the law as closely as floats allow."""

    def nodes(self, n: int) -> tuple[Floats, Floats]:
        """Return a quadrature of the law with `n` points on the last axis.

        The Gauss rule of the law itself: exact for polynomials of D up to degree 2n - 1, up to rounding. A law that has
        no more than `n` atoms comes back as these atoms.

        Parameters
        ----------
        n : int
            Number of points, >= 1.

        Returns
        -------
        points, weights : array
            Points in the unit of D and weights (they sum to 1), shape ``(*shape, n)``, or fewer on the last axis where
            the law has fewer atoms.
        """
        checks.count("n", n)
        points, weights = self._fine()
        return (points, weights) if points.shape[-1] <= n else gauss_rule(points, weights, n)


def checked_power(power: int) -> int:
    """Return `power`, which must be 0, 1 or 2."""
    return int(checks.one_of("power", power, (0, 1, 2)))


def amounts(name: str, value: npt.ArrayLike, least: float = -np.inf) -> Floats:
    """Return a finite float array, no entry of it below `least`."""
    array = checks.finite_array(name, value)
    if np.any(array < least):
        raise checks.refuse(name, f">= {least:g}", float(array.min()))
    return array


def atom_under(gap: Floats, power: int) -> Floats:
    """E((y - D)+)^power of a point mass, ``gap = y - D``."""
    return np.where(gap >= 0, 1.0, 0.0) if power == 0 else np.maximum(gap, 0.0) ** power


def atom_over(gap: Floats, power: int) -> Floats:
    """E((D - y)+)^power of a point mass, ``gap = y - D``."""
    return np.where(gap < 0, 1.0, 0.0) if power == 0 else np.maximum(-gap, 0.0) ** power


class LocationScale(Law):
    """A law ``location + scale U`` of a standard law U; scale 0 is a point mass."""

    _location: Floats
    _scale: Floats

    def _set(self, location: Floats, scale: Floats) -> None:
        location, scale = np.broadcast_arrays(location, scale)
        self.shape = location.shape
        self._location = location.copy()
        self._scale = np.where(scale < 1e-100, 0.0, scale)  # beneath it, squares of y/scale would overflow

    @abstractmethod
    def _unit_under(self, v: Floats, power: int) -> Floats: ...

    @abstractmethod
    def _unit_over(self, v: Floats, power: int) -> Floats: ...

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        gap, scale, spread = self._gap(y)
        smooth = scale ** checked_power(power) * self._unit_under(gap / scale, power)
        return smooth if np.all(spread) else np.where(spread, smooth, atom_under(gap, power))

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        gap, scale, spread = self._gap(y)
        smooth = scale ** checked_power(power) * self._unit_over(gap / scale, power)
        return smooth if np.all(spread) else np.where(spread, smooth, atom_over(gap, power))

    def _gap(self, y: npt.ArrayLike) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        spread = self._scale > 0
        return np.asarray(y, dtype=float) - self._location, np.where(spread, self._scale, 1.0), spread

    def _placed(self, unit: npt.ArrayLike) -> Floats:
        """Location and scale put on standard values, the last axis being theirs."""
        placed: Floats = self._location[..., None] + self._scale[..., None] * np.asarray(unit)
        return placed


def gauss_rule(points: Floats, weights: Floats, n: int) -> tuple[Floats, Floats]:
    """Return the n-point Gauss rule of each discrete measure (last axis), by Lanczos with full orthogonalisation."""
    centre = np.sum(points * weights, axis=-1, keepdims=True)
    spread = np.sqrt(np.sum((points - centre) ** 2 * weights, axis=-1, keepdims=True))
    unit = np.divide(points - centre, spread, out=np.zeros_like(points), where=spread > 0)
    nodes, vectors = np.linalg.eigh(_jacobi(unit, np.sqrt(weights), n))
    return centre + spread * nodes, vectors[..., 0, :] ** 2


def _jacobi(points: Floats, start: Floats, n: int) -> Floats:
    """Recurrence coefficients of the orthogonal polynomials, as symmetric tridiagonal matrices."""
    matrix = np.zeros((*points.shape[:-1], n, n))
    basis = np.zeros((*points.shape[:-1], n, points.shape[-1]))
    vector, norm = start, np.sqrt(np.sum(start**2, axis=-1))
    for k in range(n):
        # A measure of fewer atoms than n ends the recurrence: what follows is cut off and gets weight 0.
        basis[..., k, :] = np.divide(
            vector, norm[..., None], out=np.zeros_like(vector), where=norm[..., None] > 1e-12
        )
        vector = points * basis[..., k, :]
        matrix[..., k, k] = np.sum(vector * basis[..., k, :], axis=-1)
        for _ in range(2):
            along = np.einsum("...kp,...p->...k", basis, vector)
            vector = vector - np.einsum("...kp,...k->...p", basis, along)
        norm = np.sqrt(np.sum(vector**2, axis=-1))
        if k + 1 < n:
            matrix[..., k, k + 1] = matrix[..., k + 1, k] = np.where(norm > 1e-12, norm, 0.0)
    return matrix
