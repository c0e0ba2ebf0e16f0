"""Law of a random amount: partial moments on either side of a point, quadrature, samples."""

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed

Size = int | tuple[int, ...]


class Law(ABC):
    """Array of laws of a random amount D, one for each control, in closed form.

    Arguments ``y`` have the unit of D and broadcast against `shape`. `under` and `over` have equal second
    differences in y, since ``(y - D)+ - (D - y)+ = y - D``; those of `under` are accurate below the mean,
    those of `over` above it.

    Attributes
    ----------
    shape : tuple of int
        Shape of the array of laws.
    mean, sd : array
        Mean and standard deviation of D, of `shape`, in the unit of D.
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
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""

    @abstractmethod
    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""

    @abstractmethod
    def _fine(self) -> tuple[Floats, Floats]:
        """Points and weights, on the last axis, of a quadrature exact to rounding."""

    def nodes(self, n: int) -> tuple[Floats, Floats]:
        """Return a quadrature of the law with `n` points on the last axis.

        The Gauss rule of the law: exact for polynomials of D up to degree 2n - 1. A law of at most `n` atoms
        gives its atoms.

        Parameters
        ----------
        n : int
            Number of points, >= 1.

        Returns
        -------
        points, weights : array
            Points in the unit of D and weights of sum 1, shape ``(*shape, n)``; fewer on the last axis for
            fewer atoms.
        """
        checks.count("n", n)
        points, weights = self._fine()
        return (points, weights) if points.shape[-1] <= n else gauss_rule(points, weights, n)


def checked_power(power: int) -> int:
    """Return `power`, which must be 0, 1 or 2."""
    return int(checks.one_of("power", power, (0, 1, 2)))


def amounts(name: str, value: npt.ArrayLike, least: float = -np.inf) -> Floats:
    """Return a finite float array with no entry below `least`."""
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
        self._scale = np.where(scale < 1e-100, 0.0, scale)  # smaller ones overflow in (y/scale)**2

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
        """Map the standard values `unit` (last axis) to location + scale * unit."""
        placed: Floats = self._location[..., None] + self._scale[..., None] * np.asarray(unit)
        return placed


class WrappedLaw(Law):
    """A law that is another one, `_law`, made or evaluated in a way of its own."""

    _law: Law

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        return self._law.under(y, power)

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        return self._law.over(y, power)

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""
        return self._law.support

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        return self._law.sample(rng, size)

    def _fine(self) -> tuple[Floats, Floats]:
        return self._law._fine()


def gauss_rule(points: Floats, weights: Floats, n: int) -> tuple[Floats, Floats]:
    """Return n-point Gauss rules of discrete measures (last axis), by Lanczos with reorthogonalisation."""
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
        # Fewer than n atoms end the recurrence: further nodes get weight 0.
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
