"""Laws with finitely many values."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator
from sdpgrind.sdp._distributions.law import Law, Size, amounts, atom_over, atom_under, checked_power


class Discrete(Law):
    """Law of finitely many values.

    Parameters
    ----------
    values : array_like
        The values, on the last axis, in the unit of D; the other axes make the `shape` of the array of laws.
    weights : array_like, optional
        Probabilities, scaled to sum to 1, broadcast against `values`. Default: equal.

    Raises
    ------
    ValueError
        When a value is not finite, a weight is negative, or weights sum to 0.

    Examples
    --------
    >>> law = Discrete([0.0, 1.0], weights=[1, 3])
    >>> float(law.mean), float(law.over(0.5, power=0))
    (0.75, 0.75)
    """

    def __init__(self, values: npt.ArrayLike, weights: npt.ArrayLike | None = None) -> None:
        values = np.atleast_1d(amounts("values", values))
        weights = amounts("weights", np.ones(values.shape[-1]) if weights is None else weights, 0.0)
        self._values, weights = np.broadcast_arrays(values, weights)
        total = weights.sum(axis=-1, keepdims=True)
        if self._values.shape[-1] == 0 or np.any(total <= 0):
            raise checks.refuse("weights", "of positive sum", float(total.min(initial=0.0)))
        self._weights = weights / total
        self.shape = self._values.shape[:-1]
        self.mean = np.sum(self._values * self._weights, axis=-1)
        self.sd = np.sqrt(np.sum((self._values - self.mean[..., None]) ** 2 * self._weights, axis=-1))

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        gap = np.asarray(y, dtype=float)[..., None] - self._values
        return np.asarray(np.sum(atom_under(gap, checked_power(power)) * self._weights, axis=-1))

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        gap = np.asarray(y, dtype=float)[..., None] - self._values
        return np.asarray(np.sum(atom_over(gap, checked_power(power)) * self._weights, axis=-1))

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Least and greatest value, two arrays of `shape`, in the unit of D."""
        return self._values.min(axis=-1), self._values.max(axis=-1)

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        size = self.shape if size is None else size
        uniform = generator(rng).random(np.broadcast_shapes(self.shape, size))[..., None]
        rank = np.sum(uniform >= np.cumsum(self._weights, axis=-1)[..., :-1], axis=-1)
        values = np.broadcast_to(self._values, (*rank.shape, self._values.shape[-1]))
        return np.take_along_axis(values, rank[..., None], axis=-1)[..., 0]

    def nodes(self, n: int = 1) -> tuple[Floats, Floats]:
        """Return all values (unit of D) and weights for any `n`: the exact rule."""
        return self._values, self._weights

    def _fine(self) -> tuple[Floats, Floats]:
        return self._values, self._weights


class Point(Discrete):
    """Deterministic amount, D = value.

    Parameters
    ----------
    value : array_like
        The amount, in the unit of D; its shape is the `shape` of the array of laws.

    Raises
    ------
    ValueError
        When a value is not finite.

    Examples
    --------
    >>> Point([0.5, 2.0]).under(1.0)
    array([0.5, 0. ])
    """

    def __init__(self, value: npt.ArrayLike) -> None:
        super().__init__(amounts("value", value)[..., None])
