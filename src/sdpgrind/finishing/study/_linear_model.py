"""Linear model of a study: a mean, and effects of factors (and of named interactions) that sum to zero.

Each sum of squares is the squared length of a projection onto the space of a term, orthogonal to all terms
that do not contain it: type II, in an orthogonal array the usual sum of squares.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats

_RANK = 1e-9  # residual length of a unit direction that counts as 0; chosen: covers rounding

Codes = npt.NDArray[np.int64]
Term = tuple[int, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearModel:
    """Terms over codes (observations, factors) of levels 0, 1, ...; a term is one factor or a pair."""

    codes: Codes
    counts: tuple[int, ...]
    terms: tuple[Term, ...]

    def kept(self, terms: Sequence[Term]) -> "LinearModel":
        """Model with these terms only."""
        return LinearModel(self.codes, self.counts, tuple(terms))

    def columns(self, codes: Codes, term: Term) -> Floats:
        """Columns of a term for settings (m, factors): products of contrasts that sum to zero over levels."""
        found = np.ones((len(codes), 1))
        for factor in term:
            marks = _sum_contrasts(self.counts[factor])[codes[:, factor]]
            found = (found[:, :, None] * marks[:, None, :]).reshape(len(codes), -1)
        return found

    def rows(self, codes: Codes) -> Floats:
        """Rows of the design for settings (m, factors)."""
        return np.column_stack([np.ones(len(codes)), *(self.columns(codes, term) for term in self.terms)])

    @cached_property
    def design(self) -> Floats:
        """Design of the observations, (n, p)."""
        return self.rows(self.codes)

    @cached_property
    def inverse(self) -> Floats:
        """Inverse of X'X; the design has full rank."""
        return np.asarray(np.linalg.inv(self.design.T @ self.design))

    @cached_property
    def full_rank(self) -> bool:
        """Whether all effects are estimable."""
        return bool(self._whole.shape[1] == self.design.shape[1])

    @cached_property
    def bases(self) -> tuple[Floats, ...]:
        """Orthonormal basis (n, df) of each term, orthogonal to the terms that do not contain it."""
        return tuple(self._basis(self._freed(term)) for term in self.terms)

    @cached_property
    def orthogonal(self) -> bool:
        """Whether each term is orthogonal to those that do not contain it: types I, II and III agree."""
        lost = (self._freed(term) - self.columns(self.codes, term) for term in self.terms)
        return all(np.abs(part).max(initial=0.0) < _RANK for part in lost)

    @property
    def df(self) -> tuple[int, ...]:
        """Degrees of freedom of the terms."""
        return tuple(basis.shape[1] for basis in self.bases)

    @property
    def error_df(self) -> int:
        """Degrees of freedom of the error."""
        return int(self.design.shape[0] - self.design.shape[1])

    def squares(self, y: Floats) -> Floats:
        """Sum of squares of each term, (..., terms), for observations (..., n)."""
        centred = y - y.mean(axis=-1, keepdims=True)
        parts = [np.sum((centred @ basis) ** 2, axis=-1) for basis in self.bases]
        return np.stack(parts, axis=-1) if parts else np.zeros((*y.shape[:-1], 0))

    def residuals(self, y: Floats) -> Floats:
        """Residuals, (..., n); the mean is subtracted first, against rounding."""
        centred = y - y.mean(axis=-1, keepdims=True)
        return np.asarray(centred - (centred @ self._whole) @ self._whole.T)

    def effects(self, y: Floats) -> Floats:
        """Coefficients (..., p) of the design for observations (..., n)."""
        return np.asarray(y @ self.design @ self.inverse)

    @cached_property
    def _whole(self) -> Floats:
        return self._basis(self.design)

    def _freed(self, term: Term) -> Floats:
        own = self.columns(self.codes, term)
        others = [self.columns(self.codes, other) for other in self.terms if not set(term) <= set(other)]
        rest = self._basis(np.column_stack([np.ones(len(self.codes)), *others]))
        return np.asarray(own - rest @ (rest.T @ own))

    @staticmethod
    def _basis(columns: Floats) -> Floats:
        """Orthonormal basis of columns of order one."""
        u, s, _ = np.linalg.svd(columns, full_matrices=False)
        return np.asarray(u[:, s > _RANK * np.sqrt(len(columns))])


def _sum_contrasts(count: int) -> Floats:
    """Matrix from the effects of all levels but the last to those of all: the last is minus their sum."""
    return np.vstack([np.eye(count - 1), -np.ones((1, count - 1))])
