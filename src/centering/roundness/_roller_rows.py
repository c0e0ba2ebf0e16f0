"""Rows of the fit that separates form and runout, and their normal matrix without products of long rows.

Products of harmonics are sums of harmonics up to the double degree: with ``S_k = sum exp(i k part_angle)``,
``sum cos j cos k = Re(S_(j-k) + S_(j+k))/2`` and so on.
"""

import dataclasses
from functools import cached_property
from math import inf, sqrt
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from centering.roundness._harmonic_fit import powers
from sdpgrind.base.checks import Complex, Floats


@dataclasses.dataclass(frozen=True, eq=False)
class Basis:
    """Harmonics of the part angle: rows 1, cos, sin, cos 2, ..., (2 upr_max + 1, n), and normal matrix."""

    rows: Floats
    gram: Floats

    @classmethod
    def of(cls, part_angle: Floats, upr_max: int) -> "Basis":
        """Basis of these angles, up to `upr_max`."""
        waves = powers(np.exp(1j * part_angle), upr_max + 1)
        return cls(_real_rows(waves), _gram(np.concatenate([waves.sum(axis=1), waves[1:] @ waves[-1]])))

    @cached_property
    def factor(self) -> Any:
        """Cholesky factor of the normal matrix."""
        return cho_factor(self.gram)

    def bordered(self, further: Floats) -> Floats:
        """Normal matrix of the harmonics and further rows."""
        shared = self.rows @ further.T
        return np.block([[self.gram, shared], [shared.T, further @ further.T]])

    def beyond(self, further: Floats) -> Floats:
        """Residuals of further rows after least squares by the harmonics."""
        return np.asarray(further - cho_solve(self.factor, self.rows @ further.T).T @ self.rows)


def harmonic_rows(part_angle: Floats, upr_max: int) -> Floats:
    """Rows 1, cos, sin, cos 2, sin 2, ... of the part angle, (2 upr_max + 1, n)."""
    return _real_rows(powers(np.exp(1j * part_angle), upr_max + 1))


def _real_rows(waves: Complex) -> Floats:
    """Rows 1, cos, sin, ... of complex waves."""
    rows = np.empty((2 * len(waves) - 1, waves.shape[1]))
    rows[0] = 1.0
    rows[2::2], rows[1::2] = waves.imag[1:], waves.real[1:]
    return rows


def _gram(sums: Complex) -> Floats:
    """Products of harmonics 0..n from sums 0..2n."""
    n = sums.size // 2
    k = np.arange(n + 1)
    above, apart = sums[k + k[:, np.newaxis]], sums[np.abs(k - k[:, np.newaxis])]
    later = np.sign(k - k[:, np.newaxis])  # sign of column minus row
    gram = np.empty((2 * n + 1, 2 * n + 1))
    cosine, sine = [0, *range(1, 2 * n, 2)], range(2, 2 * n + 1, 2)
    gram[np.ix_(cosine, cosine)] = 0.5 * (above.real + apart.real)
    gram[np.ix_(sine, sine)] = 0.5 * (apart.real - above.real)[1:, 1:]
    gram[np.ix_(cosine, sine)] = 0.5 * (above.imag + later * apart.imag)[:, 1:]
    gram[np.ix_(sine, cosine)] = gram[np.ix_(cosine, sine)].T
    return gram


def condition(gram: Floats) -> float:
    """Condition of the basis of a normal matrix; infinite above 1e7, where the matrix has no digits left."""
    values = np.linalg.eigvalsh(gram)
    return sqrt(values[-1] / values[0]) if values[0] > 1e-14 * values[-1] else inf
